// The voxels that triangles touch, by overlap tests in double precision.
#pragma once

#include "support/random_meshes.hpp"

#include <wfpg/base/morton.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

namespace wfpg_test {

/// How many triangles touch a voxel, and how many are so near that they may count.
struct touching {
  std::uint32_t certainly = 0;
  std::uint32_t perhaps = 0;
};
using touched_voxels = std::map<wfpg::morton_code, touching>;

/// Separating axes in double precision.
inline bool overlaps(const glm::dvec3 (&triangle)[3], glm::dvec3 centre, double half) {
  glm::dvec3 axes[13] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  axes[3] = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  for (int edge = 0; edge < 3; ++edge)
    for (int axis = 0; axis < 3; ++axis)
      axes[4 + 3 * edge + axis] = glm::cross(axes[axis], triangle[(edge + 1) % 3] - triangle[edge]);
  for (const glm::dvec3& axis : axes) {
    const double p[3] = {glm::dot(axis, triangle[0] - centre), glm::dot(axis, triangle[1] - centre),
                         glm::dot(axis, triangle[2] - centre)};
    const double radius = half * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
    if (*std::min_element(p, p + 3) > radius || *std::max_element(p, p + 3) < -radius) return false;
  }
  return true;
}

/// Collects the voxels of one triangle by descent from the whole grid. A cube that it does not touch is
/// skipped.
inline void collect(const glm::dvec3 (&triangle)[3], wfpg::uvec3 first, std::uint32_t size,
                    touched_voxels& found) {
  const double tolerance = 0x1p-10 + 0x1p-12;  // the documented one, plus the rounding of grid coordinates
  const glm::dvec3 centre = glm::dvec3(first) + 0.5 * size;
  if (!overlaps(triangle, centre, 0.5 * size + tolerance)) return;
  if (size == 1) {
    touching& voxel = found[wfpg::morton_encode(first)];
    voxel.certainly += overlaps(triangle, centre, 0.5) ? 1 : 0;
    ++voxel.perhaps;
    return;
  }
  for (std::uint32_t octant = 0; octant < 8; ++octant)
    collect(triangle, first + wfpg::uvec3(octant & 1, octant >> 1 & 1, octant >> 2) * (size / 2), size / 2,
            found);
}

inline touched_voxels brute_force(const test_mesh& mesh, const wfpg::voxel_grid& grid) {
  touched_voxels found;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    glm::dvec3 triangle[3];
    for (int i = 0; i < 3; ++i)
      triangle[i] =
          (glm::dvec3(mesh.vertex(t, i)) - glm::dvec3(grid.origin)) * (double(grid.resolution) / grid.side);
    collect(triangle, wfpg::uvec3(0u), grid.resolution, found);
  }
  return found;
}

}  // namespace wfpg_test
