// The host on one thread.
#include "casters/embree_caster.hpp"
#include "on_devices.hpp"
#include "wavefront.hpp"

namespace kernels {

std::unique_ptr<renderer> make_on_one_thread(const render::scene& scene, const settings& wanted) {
  return std::make_unique<wavefront<serial, render::embree_scene>>(scene, wanted);
}

}  // namespace kernels
