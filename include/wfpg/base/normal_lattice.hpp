// A lattice of normals, for tables with one entry for each of a set of normals.
// Source of its map: Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD".
// Cost: one map of base/octahedral_map.hpp a call. Memory: 4 bytes; normals are computed, not stored.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>

namespace wfpg::detail {

/// (steps + 1)² normals on a square grid over the octahedral map, the square's edges included.
/// Where `steps` is even, the six axis directions are among them.
/// Entries on an edge name their directions twice, and the four corners are all -z: tables stay rectangular.
struct normal_lattice {
  /// Intervals along a side of the square. Must be positive before normal() or index() is called.
  std::uint32_t steps = 0;  // along a side

  /// Returns the number of normals, duplicates on the edges included.
  WFPG_HD std::uint32_t size() const { return (steps + 1) * (steps + 1); }
  /// Returns normal `i`, i < size(): unit length, row by row of the square.
  WFPG_HD vec3 normal(std::uint32_t i) const {
    return square_to_sphere(vec2(static_cast<float>(i % (steps + 1)), static_cast<float>(i / (steps + 1))) /
                            static_cast<float>(steps));
  }
  /// Returns the index of the normal that is nearest in the square to a unit normal, in [0, size()).
  /// Near the square's edges another one may be a little nearer on the sphere.
  WFPG_HD std::uint32_t index(vec3 normal) const {
    const vec2 uv = sphere_to_square(normal) * static_cast<float>(steps) + 0.5f;
    const auto x = min(static_cast<std::uint32_t>(max(uv.x, 0.0f)), steps);
    const auto y = min(static_cast<std::uint32_t>(max(uv.y, 0.0f)), steps);
    return y * (steps + 1) + x;
  }
};

}  // namespace wfpg::detail
