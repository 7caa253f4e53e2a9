// A small host renderer on the GPU. Kernels make surfaces and light from a ray's number.
#pragma once

#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg_test {

/// Points on the unit box's walls, with three BSDFs.
struct walls {
  std::uint64_t seed = 3;
  WFPG_HD test_surface operator()(std::uint32_t ray) const {
    const vec2 u = hashed_numbers{seed}(ray, 0);
    const vec3 normal = face_normal(ray % 6);
    const bsdf_kind kind = ray % 5 < 3    ? bsdf_kind::lambert
                           : ray % 5 == 3 ? bsdf_kind::glossy
                                          : bsdf_kind::glass;
    return make_surface(face_point(ray % 6, u.x, u.y), normal, normal, kind);
  }
};

/// Light on the walls, most of it in a corner of the ceiling.
struct light_walls {
  wfpg::exitance_cache_view cache;
  WFPG_HD void operator()(std::size_t i) const {
    const test_surface s = walls()(static_cast<std::uint32_t>(i));
    const bool bright = s.position.y == 1.0f && s.position.x > 0.7f;
    cache.deposit(s.position, s.normal, bright ? 10.0f : 0.1f);
  }
};

}  // namespace wfpg_test
