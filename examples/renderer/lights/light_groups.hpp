// A scene's lights in groups that a place is likely to prefer or to avoid as a whole: near each other, and of
// one orientation.
#pragma once

#include "scene/scene.hpp"

#include <cstdint>
#include <vector>

namespace render {

/// Lights that follow each other, and the share of all lights' power that is theirs.
struct light_group {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  float share = 1.0f;
};

/// All lights of a scene. An environment map is the last, and alone where there are several groups.
struct grouped_lights {
  static constexpr std::uint32_t beyond_triangles = 0x80000000u;

  std::vector<std::uint32_t> lights;  ///< group by group: a triangle, or another light's number and that bit
  std::vector<double> powers;         ///< of each, over pi
  std::vector<light_group> groups;
  std::vector<std::uint8_t> triangle_groups;  ///< of every triangle of the scene; empty: there is one group
  double total_power = 0.0;
  float scene_radius = 0.0f;  ///< of a sphere around the scene
};

/// In at most `most` groups, in [1, 255], and one more for an environment map. Flat emitters are not divided,
/// and lights that are close to each other for their scene stay together.
grouped_lights group_lights(const scene& host, std::uint32_t most);

}  // namespace render
