// Shared by the tests of the renderer's files and scenes: a temporary folder and checks of a scene.
#pragma once

#include "scene/scene.hpp"
#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstdint>
#include <string>

namespace render_test {

using render::scene;
using render::vec3;
using wfpg_test::content_of;
using wfpg_test::files_in;
using wfpg_test::temporary_folder;

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

inline void check_close(vec3 a, vec3 b, float tolerance = 1e-5f) {
  INFO(a.x << ' ' << a.y << ' ' << a.z << " against " << b.x << ' ' << b.y << ' ' << b.z);
  CHECK(glm::length(a - b) <= tolerance);
}

inline vec3 corner(const scene& s, std::size_t triangle, int i) {
  return s.positions[s.triangles[triangle][i]];
}

inline vec3 face_normal(const scene& s, std::size_t t) {
  return glm::normalize(glm::cross(corner(s, t, 1) - corner(s, t, 0), corner(s, t, 2) - corner(s, t, 0)));
}

inline void check_consistent(const scene& s) {
  REQUIRE(s.triangles.size() == s.triangle_materials.size());
  CHECK((s.normals.empty() || s.normals.size() == s.positions.size()));
  CHECK((s.uvs.empty() || s.uvs.size() == s.positions.size()));
  std::size_t bad = 0;
  for (const render::uvec3& t : s.triangles)
    for (int i = 0; i < 3; ++i) bad += t[i] >= s.positions.size();
  for (std::uint32_t m : s.triangle_materials) bad += m >= s.materials.size();
  for (const vec3& n : s.normals) bad += std::abs(glm::length(n) - 1.0f) > 1e-4f;
  for (const render::material& m : s.materials) bad += m.base_texture.index >= int(s.textures.size());
  CHECK(bad == 0);
  CHECK(glm::length(s.view.forward) == Approx(1.0f));
  CHECK(glm::length(glm::cross(s.view.forward, s.view.up)) > 0.01f);
  CHECK(s.view.vertical_fov > 0.0f);
  CHECK(s.view.vertical_fov < 3.1416f);
}

}  // namespace render_test
