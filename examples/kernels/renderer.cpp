// Checks what the host is asked for, and chooses the device.
#include "renderer.hpp"

#include "on_devices.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace kernels {
namespace {

void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument(what);
}

void check(const render::scene& scene, const settings& wanted) {
  require(wanted.width >= 1 && wanted.height >= 1, "width and height: expected at least 1 pixel each");
  require(wanted.max_depth >= 1 && wanted.max_depth <= 1024, "max_depth: expected 1 to 1024");
  require(std::isfinite(wanted.fog) && wanted.fog >= 0.0f, "fog: expected a finite number, at least 0");
  require(scene.textures.empty(), scene.name + " has textures, which this host does not have");
  for (const render::material& m : scene.materials)
    require(m.kind < render::first_kind_of_all_lobes && m.kind != render::material_kind::thin_dielectric,
            scene.name + " has a thin or a metallic-roughness material, which this host does not have");
}

}  // namespace

std::unique_ptr<renderer> make_renderer(device where, const render::scene& scene, const settings& wanted) {
  check(scene, wanted);
  switch (where) {
    case device::serial:
      return make_on_one_thread(scene, wanted);
    case device::cuda:
      return make_on_gpu(scene, wanted);
    default:
      return make_on_tbb(scene, wanted);
  }
}

}  // namespace kernels
