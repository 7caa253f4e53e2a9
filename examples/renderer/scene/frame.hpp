// Directions that are drawn in an orthonormal frame.
#pragma once

#include <wfpg/base/math.hpp>

#include <glm/common.hpp>

#include <cmath>

namespace render {

using wfpg::frame;
using wfpg::pi;
using wfpg::uvec3;
using wfpg::vec2;
using wfpg::vec3;

/// A point of the unit disk, uniform by area.
WFPG_HD inline vec2 uniform_disk(vec2 u) {
  const float radius = std::sqrt(u.x);
  const float angle = 2.0f * pi * u.y;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

/// A unit vector above the plane z = 0 with density z / pi.
WFPG_HD inline vec3 cosine_hemisphere(vec2 u) {
  const vec2 disk = uniform_disk(u);
  return {disk.x, disk.y, std::sqrt(glm::max(0.0f, 1.0f - u.x))};
}

}  // namespace render
