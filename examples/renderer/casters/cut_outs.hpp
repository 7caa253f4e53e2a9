// Surfaces that an alpha mask cuts holes into: a ray that hits a hole goes on behind it.
#pragma once

#include "scene/device_scene.hpp"

#include <wfpg/base/math.hpp>

namespace render {

/// The first hit that is not in a hole. `cast(ray)` gives the first hit as `triangle` and `distance`, inside
/// (t_min, t_max) alone; `scene` is null where nothing is cut out.
template <class Cast>
WFPG_HD auto cast_through_cut_outs(const scene_view* scene, wfpg::ray ray, const Cast& cast) {
  for (;;) {
    const auto found = cast(ray);
    if (!scene || !found.triangle.is_hit() || !scene->is_cut_out(found.triangle)) return found;
    const float distance = glm::max(found.distance, 1e-30f);  // nothing smaller need have a successor
    ray.t_min = wfpg::bits_float(wfpg::float_bits(distance) + 1u);
  }
}

}  // namespace render
