// The host's ray caster, and the guider that is made with it.
#pragma once

#if KERNELS_GUIDE
#include "geometry.hpp"
#include "renderer.hpp"

#include <wfpg/path_guider.hpp>

namespace kernels {

/// A batch of hits as the guide asks for them: the distance, or the environment's luminance.
struct answer_guide {
  render::scene_view scene;
  wfpg::array_view<const wfpg::ray> rays;
  const triangle_hit* found;
  wfpg::array_view<wfpg::ray_hit> hits;

  KERNELS_BOTH void operator()(std::size_t i) const {
    const wfpg::ray& asked = rays[i];
    if (found[i].is_hit())
      hits[i] = {glm::length(scene.point(found[i]).position - asked.origin), 0.0f};
    else
      hits[i] = {-1.0f, wfpg::luminance(scene.environment.radiance(asked.direction))};
  }
};

template <class Device>
struct guide_caster {
  const geometry<Device>* traced;
  render::scene_view scene;

  template <class Exec>
  void cast(const Exec& exec, wfpg::array_view<const wfpg::ray> rays,
            wfpg::array_view<wfpg::ray_hit> hits) const {
    const wfpg::buffer<triangle_hit, Exec> found(exec, rays.size());
    traced->trace(rays.data(), rays.size(), found.data());
    launch<Device>(rays.size(), answer_guide{scene, rays, found.data(), hits});
  }
};

template <class Device>
using guider_on = wfpg::path_guider<typename Device::policy>;

/// Makes a guider before the first sample. It compiles in a file of its own, since the octree takes longest.
template <class Device>
guider_on<Device> make_guider(const guide_caster<Device>& caster, const wfpg::bounds3& bounds,
                              const settings& wanted);

}  // namespace kernels
#endif
