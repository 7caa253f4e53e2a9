// Directions that are drawn in an orthonormal frame.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <glm/common.hpp>

#include <cmath>

namespace render {

using wfpg::frame;
using wfpg::pi;
using wfpg::uvec3;
using wfpg::vec2;
using wfpg::vec3;

/// The ray from a point in a direction, which has unit length.
WFPG_HD inline wfpg::ray ray_along(vec3 origin, vec3 direction) {
  wfpg::ray ray;
  ray.origin = origin;
  ray.direction = direction;
  return ray;
}
/// The ray from a point to another. Its t_max is 0 where they are one, and then it has no direction.
WFPG_HD inline wfpg::ray ray_between(vec3 from, vec3 to) {
  wfpg::ray ray;
  ray.origin = from;
  ray.t_max = glm::length(to - from);
  if (ray.t_max > 0.0f) ray.direction = (to - from) / ray.t_max;
  return ray;
}

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
