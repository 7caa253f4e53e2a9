// Places in the analytic room, and exact integrals over what they see. One sample of irradiance is
// L cos / p for a direction of density p. Its relative variance is
//   integral of (L cos)² / p over the hemisphere, over E², minus 1.
//
// The background is summed over cells of equal solid angle, and each disk over parts of equal area. Edges of
// lights need no fine grid then.
//
// Cost: 57,600 directions a place, and 200 to 3,200 a disk.
#pragma once

#include "light.hpp"

#include <wfpg/base/octahedral_map.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace room {

/// Places on the walls, from a fixed seed. No place is nearer to an edge of the room than 0.03.
inline std::vector<wall_point> make_places(std::size_t count) {
  std::vector<wall_point> places;
  for (std::size_t i = 0; i < count; ++i)
    places.push_back(
        point_on(static_cast<int>(i % walls), 0.03f + 0.94f * wfpg::unit_vec2(wfpg::hash(0x706c6163, i))));
  return places;
}

/// A part of the integrals over a place's hemisphere.
struct visible_part {
  vec3 direction;     ///< unit length, toward the part
  double irradiance;  ///< L cos times its solid angle
  double squares;     ///< (L cos)² times its solid angle; of a disk, what it adds
};

/// Cells along a side of the hemisphere that the background is summed over. A multiple of many fields' F.
inline constexpr int background_side = 240;

/// Calls visit(visible_part) for all that a place sees.
template <class Visit>
void visit_parts(const wall_light& light, const wall_point& place, const Visit& visit) {
  const vec3 normal = normal_of(place.wall);
  const wfpg::frame basis(normal);
  const double solid_angle = 2.0 * static_cast<double>(wfpg::pi) / (background_side * background_side);
  for (int y = 0; y < background_side; ++y)
    for (int x = 0; x < background_side; ++x) {
      const vec2 uv = (vec2(static_cast<float>(x), static_cast<float>(y)) + 0.5f) * (1.0f / background_side);
      const vec3 local = wfpg::square_to_hemisphere(uv);
      const vec3 direction = basis.to_world(local);
      const double value = static_cast<double>(light.background(hit_from(place, direction)) * local.z);
      visit(visible_part{direction, value * solid_angle, value * value * solid_angle});
    }
  for (const disk& d : light.disks) {
    if (d.centre.wall == place.wall) continue;
    const int rings = d.radius < 0.05f ? 10 : 40, segments = 2 * rings;
    const double area = static_cast<double>(d.area()) / (rings * segments);
    for (int ring = 0; ring < rings; ++ring)
      for (int segment = 0; segment < segments; ++segment) {
        const float r = d.radius * std::sqrt((static_cast<float>(ring) + 0.5f) / static_cast<float>(rings));
        const float phi =
            2.0f * wfpg::pi * (static_cast<float>(segment) + 0.5f) / static_cast<float>(segments);
        const wall_point at =
            point_on(d.centre.wall, coordinates(d.centre) + r * vec2(std::cos(phi), std::sin(phi)));
        const vec3 toward = at.position - place.position;
        const vec3 direction = glm::normalize(toward);
        const float cosine = glm::dot(direction, normal);
        const double part =
            area * static_cast<double>(-glm::dot(direction, normal_of(at.wall)) / glm::dot(toward, toward));
        const auto below = static_cast<double>(light.background(at));
        const double sum = below + static_cast<double>(d.radiance);
        const auto c = static_cast<double>(cosine);
        visit(visible_part{direction, (sum - below) * c * part, (sum * sum - below * below) * c * c * part});
      }
  }
}

/// Scales the spots so that they bring `share` of the irradiance, in the mean over places.
inline void set_share(arrangement& a, const std::vector<wall_point>& places) {
  double spots = 0.0, others = 0.0;
  wall_light without = a.light;
  without.disks.resize(a.first_spot);
  wall_light alone;
  alone.disks.assign(a.light.disks.begin() + static_cast<std::ptrdiff_t>(a.first_spot), a.light.disks.end());
  for (const wall_point& place : places) {
    visit_parts(without, place, [&](const visible_part& p) { others += p.irradiance; });
    visit_parts(alone, place, [&](const visible_part& p) { spots += p.irradiance; });
  }
  const double share = static_cast<double>(a.share);
  for (std::size_t i = a.first_spot; i < a.light.disks.size(); ++i)
    a.light.disks[i].radiance *= static_cast<float>(share / (1.0 - share) * others / spots);
}

/// Mean and median over places.
struct mean_and_median {
  double mean = 0.0, median = 0.0;
  explicit mean_and_median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    median = 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
  }
};

/// Relative variances of one sample at each place: of a guide alone, and half and half with a cosine.
struct variances {
  std::vector<double> alone, half;
};

/// Measures a guide. `density(place, direction)`: of the guide alone, per steradian.
/// It must be above 0 where light comes from; for a place without a guide it is the cosine's.
template <class Density>
variances measure(const wall_light& light, const std::vector<wall_point>& places, const Density& density) {
  variances result;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const vec3 normal = normal_of(places[i].wall);
    double irradiance = 0.0, alone = 0.0, half = 0.0;
    visit_parts(light, places[i], [&](const visible_part& part) {
      const auto guided = static_cast<double>(density(i, part.direction));
      const auto cosine = static_cast<double>(glm::dot(part.direction, normal) / wfpg::pi);
      irradiance += part.irradiance;
      alone += part.squares / std::max(guided, 1.0e-30);
      half += part.squares / (0.5 * (guided + cosine));
    });
    const double square = irradiance * irradiance;
    result.alone.push_back(alone / square - 1.0);
    result.half.push_back(half / square - 1.0);
  }
  return result;
}

/// Measures the cosine alone.
inline variances measure_cosine(const wall_light& light, const std::vector<wall_point>& places) {
  return measure(light, places, [&](std::size_t i, vec3 direction) {
    return glm::dot(direction, normal_of(places[i].wall)) / wfpg::pi;
  });
}

}  // namespace room
