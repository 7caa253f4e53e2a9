// Alpha masks that cut holes into surfaces. A ray that hits a hole continues behind it.
#pragma once

#include "scene/device_scene.hpp"

#include <wfpg/base/math.hpp>

namespace render {

/// The first hit that is not in a hole. `cast(ray)` returns the first hit as `triangle` and `distance`, only
/// inside (t_min, t_max). `scene` is null if it has no holes.
///
/// Inline, so that a ray stays in registers. A compiler copies one in wider pieces than it was stored in. A
/// processor reads these once all earlier stores have reached the cache.
template <class Cast>
[[gnu::always_inline]] WFPG_HD inline auto cast_through_cut_outs(const scene_view* scene,
                                                                 const wfpg::ray& ray, const Cast& cast) {
  for (wfpg::ray rest = ray;;) {
    const auto found = cast(rest);
    if (!scene || !found.triangle.is_hit() || !scene->is_cut_out(found.triangle)) return found;
    const float distance = glm::max(found.distance, 1e-30f);  // smaller numbers may have no successor
    rest.t_min = wfpg::bits_float(wfpg::float_bits(distance) + 1u);
  }
}

}  // namespace render
