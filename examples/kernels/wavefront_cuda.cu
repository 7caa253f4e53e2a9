// The host on a GPU.
#include "casters/bvh_scene.hpp"
#include "on_devices.hpp"
#include "wavefront.hpp"

namespace kernels {

std::unique_ptr<renderer> make_on_gpu(const render::scene& scene, const settings& wanted) {
  wfpg::check_cuda(cudaFree(nullptr), "--device cuda finds no GPU that it can use; cudaFree");
  return std::make_unique<wavefront<gpu, render::bvh_scene<gpu::policy>>>(scene, wanted);
}

}  // namespace kernels
