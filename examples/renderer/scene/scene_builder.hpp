// Builds scenes of quads, boxes, spheres and water. Every quad gets the side that it faces, because emitters
// emit only on that side.
#pragma once

#include "scene/scene.hpp"

#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace render {

/// Where a surface faces, and its material.
struct side {
  vec3 facing;
  std::uint32_t material;
};

/// A box, rotated about the vertical axis through its centre.
struct box_shape {
  vec3 centre;
  vec3 size;
  float turn = 0.0f;  ///< radians, counter-clockwise seen from above
};

/// An axis-aligned box by its corners.
struct room_shape {
  vec3 lower;
  vec3 upper;
};

/// The materials of a room's six sides, indices into scene::materials. `open` leaves a side out.
struct room_materials {
  static constexpr std::uint32_t open = 0xffffffffu;
  std::uint32_t left, right;     ///< x = lower, x = upper
  std::uint32_t floor, ceiling;  ///< y = lower, y = upper
  std::uint32_t back, front;     ///< z = lower, z = upper
};

/// Rotation about the vertical axis, counter-clockwise seen from above (y towards the viewer).
inline vec3 turned(vec3 v, float angle) {
  const float c = std::cos(angle), s = std::sin(angle);
  return {c * v.x + s * v.z, v.y, c * v.z - s * v.x};
}

/// The surface of water: `level` plus the sum of its waves.
class water_surface {
 public:
  struct wave {
    vec2 wave_vector;  ///< radians per unit along x and z
    float amplitude;
    float phase;  ///< radians
  };

  water_surface(float level, std::vector<wave> waves) : level_(level), waves_(std::move(waves)) {}

  /// The point above (x, z), and the normal there, unit length.
  std::pair<vec3, vec3> at(vec2 xz) const {
    float height = level_;
    vec2 slope(0.0f);
    for (const wave& w : waves_) {
      const float angle = glm::dot(w.wave_vector, xz) + w.phase;
      height += w.amplitude * std::sin(angle);
      slope += w.amplitude * std::cos(angle) * w.wave_vector;
    }
    return {{xz.x, height, xz.y}, glm::normalize(vec3(-slope.x, 1.0f, -slope.y))};
  }

 private:
  float level_;
  std::vector<wave> waves_;
};

/// Makes a scene piece by piece. finish() returns it.
class scene_builder {
 public:
  explicit scene_builder(std::string name) { scene_.name = std::move(name); }

  std::uint32_t add(const material& m) {
    scene_.materials.push_back(m);
    return static_cast<std::uint32_t>(scene_.materials.size() - 1);
  }

  std::uint32_t diffuse(vec3 reflectance) {
    material m;
    m.base_color = reflectance;
    return add(m);
  }

  std::uint32_t lamp(vec3 radiance) {
    material m;
    m.base_color = vec3(0.0f);
    m.emission = radiance;
    return add(m);
  }

  /// Smooth or rough glass; `alpha` is the roughness of the latter.
  std::uint32_t glass(material_kind kind, float alpha = 0.1f) { return glossy(kind, vec3(1.0f), alpha); }

  /// A plastic or a metal.
  std::uint32_t glossy(material_kind kind, vec3 colour, float alpha) {
    material m;
    m.kind = kind;
    m.base_color = colour;
    m.alpha = alpha;
    return add(m);
  }

  /// The planar quad p0 p1 p2 p3 with corners in order around it, counter-clockwise seen from the direction
  /// `facing`.
  void quad(const vec3 (&p)[4], vec3 facing, std::uint32_t material_index) {
    const bool flip = glm::dot(glm::cross(p[1] - p[0], p[2] - p[0]), facing) < 0.0f;
    const auto first = static_cast<std::uint32_t>(scene_.positions.size());
    scene_.positions.insert(scene_.positions.end(), std::begin(p), std::end(p));
    const std::uint32_t second = flip ? first + 3 : first + 1, fourth = flip ? first + 1 : first + 3;
    triangle({first, second, first + 2}, material_index);
    triangle({first, first + 2, fourth}, material_index);
  }

  /// The parallelogram with one corner and two edges.
  void parallelogram(vec3 corner, vec3 u, vec3 v, const side& s) {
    quad({corner, corner + u, corner + u + v, corner + v}, s.facing, s.material);
  }

  /// A closed box whose six sides face outwards. Adjacent faces share their corners bit for bit.
  void box(const box_shape& shape, std::uint32_t material_index) {
    const auto at = [&](vec3 signs) { return shape.centre + turned(0.5f * shape.size * signs, shape.turn); };
    for (int axis = 0; axis < 3; ++axis)
      for (float sign : {-1.0f, 1.0f}) {
        vec3 normal(0.0f), u(0.0f), v(0.0f);
        normal[axis] = sign;
        u[(axis + 1) % 3] = 1.0f;
        v[(axis + 2) % 3] = 1.0f;
        quad({at(normal - u - v), at(normal + u - v), at(normal + u + v), at(normal - u + v)},
             turned(normal, shape.turn), material_index);
      }
  }

  /// The sides of an axis-aligned room, facing inwards.
  void room(const room_shape& shape, const room_materials& sides) {
    const std::uint32_t materials[6] = {sides.left,    sides.right, sides.floor,
                                        sides.ceiling, sides.back,  sides.front};
    for (int i = 0; i < 6; ++i) {
      if (materials[i] == room_materials::open) continue;
      const int axis = i / 2;
      const vec3 size = shape.upper - shape.lower;
      vec3 corner = shape.lower, inwards(0.0f), u(0.0f), v(0.0f);
      u[(axis + 1) % 3] = size[(axis + 1) % 3];
      v[(axis + 2) % 3] = size[(axis + 2) % 3];
      inwards[axis] = i % 2 == 0 ? 1.0f : -1.0f;
      if (i % 2 == 1) corner[axis] = shape.upper[axis];
      parallelogram(corner, u, v, {inwards, materials[i]});
    }
  }

  /// A horizontal rectangle that faces down.
  void ceiling_lamp(vec3 centre, vec2 size, std::uint32_t material_index) {
    const vec3 u(size.x, 0.0f, 0.0f), v(0.0f, 0.0f, size.y);
    parallelogram(centre - 0.5f * (u + v), u, v, {vec3(0.0f, -1.0f, 0.0f), material_index});
  }

  /// A closed sphere that faces outwards, of `rings` rings of twice as many quads, with smooth normals.
  void sphere(vec3 centre, float radius, int rings, std::uint32_t material_index) {
    const auto first = static_cast<std::uint32_t>(scene_.positions.size());
    const auto row = 2 * static_cast<std::uint32_t>(rings), last = first + 1 + (row / 2 - 1) * row;
    scene_.normals.resize(first, vec3(0.0f));
    const auto add_vertex = [&](vec3 normal) {
      scene_.positions.push_back(centre + radius * normal);
      scene_.normals.push_back(normal);
    };
    add_vertex({0.0f, 1.0f, 0.0f});
    for (int ring = 1; ring < rings; ++ring)
      for (int i = 0; i < 2 * rings; ++i) {
        const float step = 3.14159265f / static_cast<float>(rings);
        const float theta = step * static_cast<float>(ring), phi = step * static_cast<float>(i);
        add_vertex({std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)});
      }
    add_vertex({0.0f, -1.0f, 0.0f});
    for (std::uint32_t i = 0; i < row; ++i) {
      const std::uint32_t next = (i + 1) % row;
      triangle({first, first + 1 + i, first + 1 + next}, material_index);
      for (std::uint32_t above = first + 1; above + row < last; above += row) {
        triangle({above + i, above + row + i, above + row + next}, material_index);
        triangle({above + i, above + row + next, above + next}, material_index);
      }
      triangle({last, last - row + next, last - row + i}, material_index);
    }
  }

  /// Water over the square |x|, |z| <= half_side, of cells x cells squares, with smooth normals. It faces up.
  void water(const water_surface& surface, float half_side, int cells, std::uint32_t material_index) {
    const auto first = static_cast<std::uint32_t>(scene_.positions.size());
    const auto row = static_cast<std::uint32_t>(cells) + 1;
    scene_.normals.resize(first, vec3(0.0f));
    for (int i = 0; i <= cells; ++i)
      for (int j = 0; j <= cells; ++j) {
        const vec2 place = vec2(j, i) / static_cast<float>(cells);
        const auto [position, normal] = surface.at(half_side * (2.0f * place - 1.0f));
        scene_.positions.push_back(position);
        scene_.normals.push_back(normal);
      }
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j) {
        const std::uint32_t a = first + static_cast<std::uint32_t>(i) * row + static_cast<std::uint32_t>(j);
        triangle({a, a + row, a + row + 1}, material_index);
        triangle({a, a + row + 1, a + 1}, material_index);
      }
  }

  void sky(environment_map map) { scene_.sky = std::move(map); }
  void sky(vec3 constant) { scene_.environment = constant; }

  void look(vec3 from, vec3 at, float vertical_fov) {
    scene_.view.position = from;
    scene_.view.forward = glm::normalize(at - from);
    scene_.view.up = vec3(0.0f, 1.0f, 0.0f);
    scene_.view.vertical_fov = vertical_fov;
  }

  scene finish(int max_depth) {
    scene_.max_depth = max_depth;
    add_flat_normals();
    return std::move(scene_);
  }

 private:
  void triangle(uvec3 corners, std::uint32_t material_index) {
    scene_.triangles.push_back(corners);
    scene_.triangle_materials.push_back(material_index);
  }

  // Gives all vertices a normal if some have one. The others get that of their face, which they belong to
  // alone.
  void add_flat_normals() {
    if (scene_.normals.empty()) return;
    scene_.normals.resize(scene_.positions.size(), vec3(0.0f));
    for (const uvec3& t : scene_.triangles) {
      const vec3 a = scene_.positions[t.x], b = scene_.positions[t.y], c = scene_.positions[t.z];
      for (int i = 0; i < 3; ++i)
        if (scene_.normals[t[i]] == vec3(0.0f))
          scene_.normals[t[i]] = glm::normalize(glm::cross(b - a, c - a));
    }
  }

  scene scene_;
};

}  // namespace render
