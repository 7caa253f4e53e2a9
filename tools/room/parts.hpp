// The light of places in parts, of which distributions are made. It comes from one of four sources: the
// exact light, its mean over a part of the wall that shares a field, paths that fields learnt from, or the
// exitance cache that the same paths filled. This tells a distribution's own error from what it could know.
//
// Memory: 28 bytes a part; 57,600 parts for exact light, 16 times as many for shared light, of one place at a
// time; all paths for recorded light.
#pragma once

#include "method.hpp"
#include "wfpg_method.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace room {

/// A part of the light of a hemisphere.
struct light_part {
  vec3 local;        ///< direction in the frame of the normal
  vec2 square;       ///< of the octahedral map, in [0, 1]²
  float irradiance;  ///< what it adds to the integral of L cos
  float squares;     ///< what it adds to the integral of (L cos)²
};
using light_parts = std::vector<light_part>;

inline light_part part_of(const wfpg::frame& basis, vec3 direction, double irradiance, double squares) {
  const vec3 local = basis.to_local(direction);
  return {local, wfpg::hemisphere_to_square({local.x, local.y, wfpg::max(local.z, 0.0f)}),
          static_cast<float>(irradiance), static_cast<float>(squares)};
}

/// Sources of parts, as the program names them.
inline constexpr std::array<const char*, 4> source_names{"exact", "shared", "recorded", "cache"};

/// Parts of light for each place of one arrangement.
class place_parts {
 public:
  /// `source`: one of source_names.
  place_parts(const std::string& source, const settings& set, const wall_light& light,
              const std::vector<wall_point>& places)
      : places_(places), light_(light), shares_(source == "shared") {
    if (source == "exact" || source == "shared") return;
    wfpg_method method(light, wfpg_options(set, places.size()));
    if (source == "recorded") bins_.resize(walls * bins_a_side * bins_a_side);
    for (std::uint32_t sample = 0; sample < set.samples; ++sample) {
      method.train(sample);
      if (source == "recorded") take_paths(light, method.drawn(), path_numbers{sample});
    }
    if (source == "cache") take_cache(method.cache());
  }

  light_parts of(std::size_t place) const {
    if (!bins_.empty()) return bins_[bin(places_[place])];
    if (!parts_.empty()) return parts_[place];
    return shares_ ? shared(places_[place]) : exact(places_[place], 1.0);
  }

 private:
  // About as many as wfpg has fields in the room.
  static constexpr int bins_a_side = 16;
  // Origins along the side of a bin, whose light the bin shares.
  static constexpr int origins_a_side = 4;

  static std::size_t bin(const wall_point& p) {
    const vec2 c = coordinates(p) * static_cast<float>(bins_a_side);
    const int x = std::min(static_cast<int>(c.x), bins_a_side - 1);
    const int y = std::min(static_cast<int>(c.y), bins_a_side - 1);
    return static_cast<std::size_t>((p.wall * bins_a_side + y) * bins_a_side + x);
  }
  // The light of a place, times a weight.
  light_parts exact(const wall_point& place, double weight) const {
    const wfpg::frame basis(normal_of(place.wall));
    light_parts parts;
    visit_parts(light_, place, [&](const visible_part& p) {
      parts.push_back(part_of(basis, p.direction, weight * p.irradiance, weight * p.squares));
    });
    return parts;
  }
  // The mean light of a bin, over the places from which a field's cones may start.
  light_parts shared(const wall_point& place) const {
    const vec2 corner = glm::floor(coordinates(place) * static_cast<float>(bins_a_side));
    light_parts parts;
    for (int i = 0; i < origins_a_side * origins_a_side; ++i) {
      const vec2 cell(static_cast<float>(i % origins_a_side), static_cast<float>(i / origins_a_side));
      const vec2 uv = corner + (cell + 0.5f) / static_cast<float>(origins_a_side);
      const light_parts one = exact(point_on(place.wall, uv / static_cast<float>(bins_a_side)),
                                    1.0 / (origins_a_side * origins_a_side));
      parts.insert(parts.end(), one.begin(), one.end());
    }
    return parts;
  }
  // Estimates both integrals by the paths that begin in a bin.
  void take_paths(const wall_light& light, const std::vector<wfpg::sampled_direction>& drawn,
                  const path_numbers& numbers) {
    for (std::uint32_t path = 0; path < drawn.size(); ++path) {
      const wall_point from = numbers.origin(path);
      const wfpg::sampled_direction& next = drawn[path];
      const float cosine = glm::dot(next.direction, normal_of(from.wall));
      if (!(next.pdf > 0.0f) || !(cosine > 0.0f)) continue;
      const auto value = static_cast<double>(cosine * light.radiance(hit_from(from, next.direction)));
      const auto pdf = static_cast<double>(next.pdf);
      bins_[bin(from)].push_back(
          part_of(wfpg::frame(normal_of(from.wall)), next.direction, value / pdf, value * value / pdf));
    }
  }
  // Each voxel is a small square on its wall.
  void take_cache(const wfpg::exitance_cache_view& cache) {
    const wfpg::sparse_voxel_octree_view& tree = cache.octree();
    const float size = tree.node_size(tree.depth());
    std::vector<vec3> centres;
    for (wfpg::node_id leaf = tree.first_leaf(); leaf < tree.node_count(); ++leaf)
      centres.push_back(tree.centre(leaf));
    for (const wall_point& place : places_) {
      const wfpg::frame basis(normal_of(place.wall));
      light_parts& parts = parts_.emplace_back();
      for (std::size_t i = 0; i < centres.size(); ++i) {
        const auto leaf = static_cast<wfpg::node_id>(tree.first_leaf() + i);
        const vec3 toward = centres[i] - place.position, direction = glm::normalize(toward);
        const float cosine = glm::dot(direction, basis.z);
        const std::uint32_t side = cache.side_facing(leaf, -direction);
        const float there = std::abs(glm::dot(direction, cache.normal(leaf)));
        if (!(cosine > 0.01f)) continue;
        const auto solid_angle = static_cast<double>(size * size * there / glm::dot(toward, toward));
        const auto value = static_cast<double>(cosine * cache.read(leaf, side));
        parts.push_back(part_of(basis, direction, value * solid_angle, value * value * solid_angle));
      }
    }
  }

  std::vector<wall_point> places_;
  wall_light light_;
  bool shares_;
  std::vector<light_parts> parts_;  // a place, for the cache alone
  std::vector<light_parts> bins_;   // a part of a wall, for recorded light alone
};

}  // namespace room
