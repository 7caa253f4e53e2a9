// The host on TBB's threads.
#include "casters/embree_caster.hpp"
#include "on_devices.hpp"
#include "wavefront.hpp"

namespace kernels {

std::unique_ptr<renderer> make_on_tbb(const render::scene& scene, const settings& wanted) {
  return std::make_unique<wavefront<tbb_threads, render::embree_scene>>(scene, wanted);
}

}  // namespace kernels
