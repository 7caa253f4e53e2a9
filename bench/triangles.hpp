// Small triangles that fill the unit cube, and random points and directions in it.
#pragma once

#include "timing.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>
#include <vector>

namespace bench {

using wfpg::hash;
using wfpg::unit_vec2;
using wfpg::uvec3;
using wfpg::vec2;
using wfpg::vec3;

WFPG_HD inline vec3 random_point(std::uint64_t stream, std::uint64_t i) {
  const vec2 xy = unit_vec2(hash(hash(stream, 0), i));
  return {xy.x, xy.y, unit_vec2(hash(hash(stream, 1), i)).x};
}
WFPG_HD inline vec3 random_direction(std::uint64_t stream, std::uint64_t i) {
  return wfpg::square_to_sphere(unit_vec2(hash(hash(stream, 2), i)));
}

/// Equilateral triangles in the unit cube, or the cube's faces. 100,000 triangles have edge 0.02; more have
/// the same total area.
template <class Exec>
class triangles_of {
 public:
  triangles_of(const Exec& exec, std::size_t thousands) {
    std::vector<vec3> positions;
    if (thousands == 0) add_box(positions);
    const float edge = 0.02f * std::sqrt(100.0f / static_cast<float>(thousands));
    for (std::uint32_t i = 0; i < 1000 * thousands; ++i) {
      const vec3 a = random_point(1, i), along = random_direction(1, i);
      const vec3 aside = glm::normalize(glm::cross(along, random_direction(2, i)));
      positions.insert(positions.end(),
                       {a, a + edge * along, a + edge * (0.5f * along + 0.8660254f * aside)});
    }
    std::vector<uvec3> triangles;
    for (std::uint32_t i = 0; i < positions.size(); i += 3) triangles.push_back({i, i + 1, i + 2});
    positions_ = {exec, positions};
    triangles_ = {exec, triangles};
  }

  wfpg::triangle_mesh_view view() const { return {positions_.view(), triangles_.view()}; }

 private:
  static void add_box(std::vector<vec3>& positions) {
    for (int axis = 0; axis < 3; ++axis)
      for (const float side : {0.0f, 1.0f}) {
        vec3 corner(0.0f), u(0.0f), v(0.0f);
        corner[axis] = side;
        u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1.0f;
        positions.insert(positions.end(),
                         {corner, corner + u, corner + u + v, corner, corner + u + v, corner + v});
      }
  }

  wfpg::buffer<vec3, Exec> positions_;
  wfpg::buffer<uvec3, Exec> triangles_;
};

}  // namespace bench
