// A scene of one square, and queries of pictures.
#pragma once

#include "scene/scene.hpp"

#include <wfpg/base/types.hpp>

#include <cstring>
#include <vector>

namespace render_test {

using render::vec3;

inline double mean_of(const std::vector<vec3>& pixels) {
  double sum = 0.0;
  for (const vec3& p : pixels) sum += static_cast<double>(wfpg::luminance(p));
  return sum / static_cast<double>(pixels.size());
}

inline bool same_bits(const std::vector<vec3>& a, const std::vector<vec3>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(vec3)) == 0;
}

/// One square of side 2 in the plane z = 0 that faces +z, with a given material.
inline render::scene square_of(const render::material& material) {
  render::scene s;
  s.name = "square";
  s.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  s.triangle_materials = {0, 0};
  s.materials = {material};
  s.view.position = {0, 0, 2};
  s.view.vertical_fov = 0.5f;
  return s;
}

}  // namespace render_test
