// Scenes with an environment map. The indirect light of one has little noise, so that a small bias shows.
#pragma once

#include "scene/builtin_scenes.hpp"
#include "scene/scene_builder.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace wfpg_test {

/// A map of 8 x 4 texels. The brightest is five times as bright as the darkest.
inline render::environment_map patchy_sky(float brightness) {
  render::environment_map sky{8, 4, {}};
  for (int i = 0; i < sky.width * sky.height; ++i)
    sky.texels.push_back(brightness * (0.6f + 0.6f * static_cast<float>(i * 7 % 5)) *
                         wfpg::vec3(0.8f, 1.0f, 1.3f));
  return sky;
}

/// A room with a ceiling of two emitters, an open front and a map in front of it, seen from inside. Light
/// comes from everywhere, and half of it is indirect.
inline render::scene bright_room() {
  using render::vec3;
  render::scene_builder b("bright-room");
  const auto emitter = [&b](float reflectance, float radiance) {
    render::material m;
    m.base_color = vec3(reflectance);
    m.emission = vec3(radiance);
    return b.add(m);
  };
  const auto white = b.diffuse(vec3(0.85f)), wood = b.diffuse({0.85f, 0.6f, 0.5f});
  const auto floor = b.glossy(render::material_kind::plastic, {0.6f, 0.65f, 0.6f}, 0.3f);
  constexpr std::uint32_t open = render::room_materials::open;
  b.room({{-1.0f, 0.0f, -1.0f}, {1.0f, 2.0f, 1.0f}}, {wood, white, floor, open, white, open});
  for (const bool left : {false, true})
    b.parallelogram({left ? -1.0f : 0.0f, 2.0f, -1.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 2.0f},
                    {{0.0f, -1.0f, 0.0f}, emitter(0.7f, left ? 2.5f : 1.5f)});
  b.box({{0.35f, 0.3f, -0.3f}, {0.6f, 0.6f, 0.6f}, 0.4f}, white);
  b.look({0.0f, 1.0f, 0.95f}, {0.0f, 0.8f, -1.0f}, 1.3f);
  render::scene s = b.finish(6);
  s.sky = patchy_sky(0.7f);
  return s;
}

/// cornell-box with a point, a spot and a directional light in place of its lamp.
inline render::scene lamps_without_extent() {
  using render::punctual_kind, wfpg::vec3;
  render::scene s = render::make_builtin_scene("cornell-box");
  for (render::material& m : s.materials) m.emission = vec3(0.0f);
  const vec3 down = glm::normalize(vec3(0.3f, -1.0f, 0.2f)), in = glm::normalize(vec3(0.1f, -0.2f, 1.0f));
  s.punctual_lights = {{punctual_kind::point, {2.0f, 4.5f, 2.5f}, down, {10.0f, 8.0f, 5.0f}},
                       {punctual_kind::spot, {3.5f, 5.0f, 3.0f}, down, {10.0f, 15.0f, 20.0f}, 0.95f, 0.8f},
                       {punctual_kind::directional, {}, in, vec3(0.5f)}};
  return s;
}

/// A built-in scene, the bright room, or cornell-box with other lights.
inline render::scene make_test_scene(const std::string& name) {
  if (name == "lamps without extent") return lamps_without_extent();
  if (name == "bright-room") return bright_room();
  if (name != "cornell-box with a map") return render::make_builtin_scene(name);
  render::scene s = render::make_builtin_scene("cornell-box");
  s.sky = patchy_sky(0.5f);
  return s;
}

}  // namespace wfpg_test
