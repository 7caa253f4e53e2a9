// Orthonormal frames, and the directions on a sphere that are drawn in them.
#pragma once

#include <wfpg/base/types.hpp>

#include <glm/common.hpp>

#include <cmath>

namespace render {

using wfpg::uvec3;
using wfpg::vec2;
using wfpg::vec3;

inline constexpr float pi = 3.14159265358979f;

/// A right-handed frame whose third axis is a given unit vector.
struct frame {
  vec3 tangent{1.0f, 0.0f, 0.0f};
  vec3 bitangent{0.0f, 1.0f, 0.0f};
  vec3 normal{0.0f, 0.0f, 1.0f};

  frame() = default;
  // Duff et al. 2017, "Building an orthonormal basis, revisited": no branch, no singularity.
  WFPG_HD explicit frame(vec3 n) : normal(n) {
    const float sign = n.z < 0.0f ? -1.0f : 1.0f;
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    tangent = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    bitangent = {b, sign + n.y * n.y * a, -n.y};
  }

  WFPG_HD vec3 to_local(vec3 w) const {
    return {glm::dot(w, tangent), glm::dot(w, bitangent), glm::dot(w, normal)};
  }
  WFPG_HD vec3 to_world(vec3 w) const { return w.x * tangent + w.y * bitangent + w.z * normal; }
};

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
