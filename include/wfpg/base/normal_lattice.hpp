// Normals that tables are made for.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>

namespace wfpg::detail {

/// Normals on a lattice over the octahedral square, its edges included: the axes are among them.
struct normal_lattice {
  std::uint32_t steps = 0;  // along a side

  WFPG_HD std::uint32_t size() const { return (steps + 1) * (steps + 1); }
  WFPG_HD vec3 normal(std::uint32_t i) const {
    return square_to_sphere(vec2(static_cast<float>(i % (steps + 1)), static_cast<float>(i / (steps + 1))) /
                            static_cast<float>(steps));
  }
  /// Of the nearest one, about.
  WFPG_HD std::uint32_t index(vec3 normal) const {
    const vec2 uv = sphere_to_square(normal) * static_cast<float>(steps) + 0.5f;
    const auto x = min(static_cast<std::uint32_t>(max(uv.x, 0.0f)), steps);
    const auto y = min(static_cast<std::uint32_t>(max(uv.y, 0.0f)), steps);
    return y * (steps + 1) + x;
  }
};

}  // namespace wfpg::detail
