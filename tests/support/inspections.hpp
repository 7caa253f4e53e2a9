// Small scenes and renderings to inspect.
#pragma once

#include "app/render.hpp"
#include "scene/scene.hpp"

#include <numeric>
#include <vector>

namespace inspect_test {

using wfpg::vec3;

inline double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// A floor below a sky of radiance 1, seen from above its edge. Rays of the picture's upper half hit nothing.
inline render::scene lit_floor(render::material_kind kind) {
  render::scene s;
  s.name = "floor";
  s.positions = {{-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  s.triangle_materials = {0, 0};
  s.materials.resize(1);
  s.materials[0].kind = kind;
  s.view.position = {0.0f, 1.0f, 3.0f};
  s.environment = vec3(1.0f);
  s.max_depth = 3;
  return s;
}

inline render::render_options small(int side, int spp) {
  render::render_options options;
  options.width = options.height = side;
  options.max_depth = 4;
  options.spp = spp;
  options.octree_resolution = 32;
  options.kept.resolution = 8;
  options.field_resolution = 8;
  options.binning.rays_per_bin = 32;
  return options;
}

}  // namespace inspect_test
