// The light of the analytic room, a unit cube whose walls send radiance that is known everywhere. Each wall
// has a dim background with a gradient. One wall is brighter as a whole. Disks on the walls add their own
// radiance: broad lights, and bright spots.
//
// Cost: O(disks) a look-up. Memory: a few hundred bytes.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace room {

using wfpg::vec2;
using wfpg::vec3;

inline constexpr int walls = 6;

/// A point on a wall. Wall 2 a + b is perpendicular to axis a, at the coordinate b.
struct wall_point {
  vec3 position{0.0f};
  int wall = 0;
};

/// Normal of a wall, into the room.
inline vec3 normal_of(int wall) {
  vec3 n(0.0f);
  n[wall / 2] = wall % 2 == 0 ? 1.0f : -1.0f;
  return n;
}
/// Point of a wall at two coordinates in [0, 1].
inline wall_point point_on(int wall, vec2 uv) {
  const int axis = wall / 2;
  wall_point result{vec3(static_cast<float>(wall % 2)), wall};
  result.position[(axis + 1) % 3] = uv.x;
  result.position[(axis + 2) % 3] = uv.y;
  return result;
}
/// Inverse of point_on().
inline vec2 coordinates(const wall_point& p) {
  const int axis = p.wall / 2;
  return {p.position[(axis + 1) % 3], p.position[(axis + 2) % 3]};
}
/// The point that a ray from a wall hits. `direction` has unit length and leads into the room.
inline wall_point hit_from(const wall_point& from, vec3 direction) {
  float nearest = 3.0e38f;
  int hit = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int wall = 2 * axis + (direction[axis] > 0.0f ? 1 : 0);
    if (direction[axis] == 0.0f || wall == from.wall) continue;
    const float distance = (static_cast<float>(wall % 2) - from.position[axis]) / direction[axis];
    if (distance >= nearest) continue;
    nearest = distance;
    hit = wall;
  }
  const wall_point there{from.position + nearest * direction, hit};
  return point_on(hit, glm::clamp(coordinates(there), vec2(0.0f), vec2(1.0f)));
}

/// A disk on a wall that adds radiance to the background. Disks of one wall do not overlap.
struct disk {
  wall_point centre;
  float radius = 0.0f;
  float radiance = 0.0f;  ///< W/(m² sr)
  float area() const { return wfpg::pi * radius * radius; }
};

/// Radiance that leaves the walls, equal in all directions.
struct wall_light {
  std::array<float, walls> base{};   ///< background in the middle of a wall, W/(m² sr)
  std::array<vec2, walls> slopes{};  ///< its gradient over base
  std::vector<disk> disks;

  float background(const wall_point& p) const {
    const auto wall = static_cast<std::size_t>(p.wall);
    return base[wall] * (1.0f + glm::dot(slopes[wall], coordinates(p) - 0.5f));
  }
  float radiance(const wall_point& p) const {
    float sum = background(p);
    for (const disk& d : disks)
      if (d.centre.wall == p.wall && glm::distance(d.centre.position, p.position) < d.radius)
        sum += d.radiance;
    return sum;
  }
};

/// The lights of a seed, and how much its spots are to bring.
struct arrangement {
  wall_light light;
  std::size_t first_spot = 0;  ///< disks from here on are spots
  float share = 0.0f;          ///< part of the irradiance that the spots bring, in the mean over places
};

/// Lights of a seed: a bright wall, three broad disks of radii 0.06 to 0.3, and three spots. A spot spans
/// 0.0005 to 0.003 sr from a typical place, and the spots bring 13 to 34% of the irradiance.
/// Their radiance is 1 as yet: set_share() scales it.
inline arrangement make_arrangement(std::uint32_t seed) {
  std::uint64_t state = wfpg::hash(0x726f6f6d, seed);
  const auto next = [&] {
    state = wfpg::hash(state, 1);
    return wfpg::unit_vec2(state);
  };
  arrangement result;
  wall_light& light = result.light;
  for (std::size_t wall = 0; wall < walls; ++wall) {
    light.base[wall] = 0.5f + next().x;
    light.slopes[wall] = 1.0f * next() - 0.5f;
  }
  light.base[static_cast<std::size_t>(next().x * walls)] *= 3.0f;
  const auto add = [&](float radius, float radiance) {
    for (;;) {
      const int wall = static_cast<int>(next().x * walls);
      const wall_point centre = point_on(wall, radius + (1.0f - 2.0f * radius) * next());
      bool is_free = true;
      for (const disk& d : light.disks)
        is_free = is_free && (d.centre.wall != wall ||
                              glm::distance(d.centre.position, centre.position) > d.radius + radius);
      if (is_free) return light.disks.push_back({centre, radius, radiance});
    }
  };
  for (int broad = 0; broad < 3; ++broad) {
    // One after the other, since compilers may evaluate arguments in any order.
    const float radiance = 1.0f + 5.0f * next().x, radius = 0.06f * std::pow(5.0f, next().x);
    add(radius, radiance);
  }
  result.first_spot = light.disks.size();
  // A typical place sees a spot at a distance of 0.8, and at a cosine of 0.8.
  for (int spot = 0; spot < 3; ++spot)
    add(std::sqrt(0.0005f * std::pow(6.0f, next().x) * 0.8f / wfpg::pi), 1.0f);
  // Spots of equal power: small ones are brighter.
  for (std::size_t i = result.first_spot; i < light.disks.size(); ++i)
    light.disks[i].radiance = 1.0f / light.disks[i].area();
  result.share = 0.13f + 0.21f * next().x;
  return result;
}

}  // namespace room
