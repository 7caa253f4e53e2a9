// The host on each device, in a file of its own each, since a file has one compiler.
#pragma once

#include "renderer.hpp"

namespace kernels {

std::unique_ptr<renderer> make_on_one_thread(const render::scene& scene, const settings& wanted);
std::unique_ptr<renderer> make_on_tbb(const render::scene& scene, const settings& wanted);
std::unique_ptr<renderer> make_on_gpu(const render::scene& scene, const settings& wanted);

}  // namespace kernels
