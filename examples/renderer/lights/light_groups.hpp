// Groups of a scene's lights. Lights in a group are near each other and have one orientation, so that a place
// prefers or avoids all of them.
#pragma once

#include "scene/scene.hpp"

#include <cstdint>
#include <vector>

namespace render {

/// Consecutive lights, and their fraction of all lights' power.
struct light_group {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  float share = 1.0f;
};

/// All lights of a scene. An environment map is the last, and in its own group if there are several.
struct grouped_lights {
  static constexpr std::uint32_t beyond_triangles = 0x80000000u;

  std::vector<std::uint32_t> lights;  ///< group by group: a triangle, or another light's number and that bit
  std::vector<double> powers;         ///< of each, over pi
  std::vector<light_group> groups;
  std::vector<std::uint8_t> triangle_groups;  ///< of every triangle of the scene; empty: there is one group
  double total_power = 0.0;
  float scene_radius = 0.0f;  ///< of a sphere around the scene
  vec3 scene_centre{0.0f};    ///< of that sphere
};

/// Makes at most `most` groups, in [1, 255], and one more for an environment map. Flat emitters are not
/// divided. Lights that are close relative to the scene stay together.
grouped_lights group_lights(const scene& host, std::uint32_t most);

}  // namespace render
