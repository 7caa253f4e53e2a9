// The built-in scenes: a small builder of quads and boxes, and one function a scene.
// Every quad is given the side it faces, because emitters emit to that side only.
#include "builtin_scenes.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace render {
namespace {

/// Where a surface faces and what it is made of.
struct side {
  vec3 facing;
  std::uint32_t material;
};

/// A box on the floor or anywhere else, turned about the vertical axis through its centre.
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

/// The materials of a room's six sides, indices into scene::materials; `open` leaves a side out.
struct room_materials {
  static constexpr std::uint32_t open = 0xffffffffu;
  std::uint32_t left, right;     ///< x = lower, x = upper
  std::uint32_t floor, ceiling;  ///< y = lower, y = upper
  std::uint32_t back, front;     ///< z = lower, z = upper
};

/// Rotation about the vertical axis, counter-clockwise seen from above (y towards the viewer).
vec3 turned(vec3 v, float angle) {
  const float c = std::cos(angle), s = std::sin(angle);
  return {c * v.x + s * v.z, v.y, c * v.z - s * v.x};
}

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

  /// A plastic or a metal.
  std::uint32_t glossy(material_kind kind, vec3 colour, float alpha) {
    material m;
    m.kind = kind;
    m.base_color = colour;
    m.alpha = alpha;
    return add(m);
  }

  /// The planar quad p0 p1 p2 p3, corners in order around it, counter-clockwise seen from where `facing`
  /// points to.
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

  /// A closed box whose six sides face outwards; faces that meet share their corners to the last bit.
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

  void look(vec3 from, vec3 at, float vertical_fov) {
    scene_.view.position = from;
    scene_.view.forward = glm::normalize(at - from);
    scene_.view.up = vec3(0.0f, 1.0f, 0.0f);
    scene_.view.vertical_fov = vertical_fov;
  }

  scene finish(int max_depth) {
    scene_.max_depth = max_depth;
    return std::move(scene_);
  }

 private:
  void triangle(uvec3 corners, std::uint32_t material_index) {
    scene_.triangles.push_back(corners);
    scene_.triangle_materials.push_back(material_index);
  }

  scene scene_;
};

constexpr vec3 red{0.65f, 0.05f, 0.05f};
constexpr vec3 green{0.12f, 0.45f, 0.15f};
constexpr vec3 up{0.0f, 1.0f, 0.0f};

/// A block of the published Cornell data: its top, corners in order, and its height; sides go down to the
/// floor.
void cornell_block(scene_builder& builder, const vec2 (&top)[4], float height, std::uint32_t material_index) {
  const vec2 centre = 0.25f * (top[0] + top[1] + top[2] + top[3]);
  const auto at = [](vec2 p, float y) { return 0.01f * vec3(p.x, y, p.y); };
  builder.quad({at(top[0], height), at(top[1], height), at(top[2], height), at(top[3], height)}, up,
               material_index);
  for (int i = 0; i < 4; ++i) {
    const vec2 a = top[i], b = top[(i + 1) % 4], out = 0.5f * (a + b) - centre;
    builder.quad({at(a, 0.0f), at(b, 0.0f), at(b, height), at(a, height)}, {out.x, 0.0f, out.y},
                 material_index);
  }
}

scene cornell_box() {
  scene_builder b("cornell-box");
  const auto white = b.diffuse({0.73f, 0.73f, 0.73f}), left = b.diffuse(red), right = b.diffuse(green);
  const auto light = b.lamp({17.0f, 12.0f, 4.0f});
  const auto at = [](float x, float y, float z) { return 0.01f * vec3(x, y, z); };
  // The published room is not quite a box: the left wall leans outwards.
  b.quad({at(552.8f, 0, 0), at(0, 0, 0), at(0, 0, 559.2f), at(549.6f, 0, 559.2f)}, up, white);
  b.quad({at(556, 548.8f, 0), at(556, 548.8f, 559.2f), at(0, 548.8f, 559.2f), at(0, 548.8f, 0)}, -up, white);
  b.quad({at(549.6f, 0, 559.2f), at(0, 0, 559.2f), at(0, 548.8f, 559.2f), at(556, 548.8f, 559.2f)},
         {0.0f, 0.0f, -1.0f}, white);
  b.quad({at(0, 0, 559.2f), at(0, 0, 0), at(0, 548.8f, 0), at(0, 548.8f, 559.2f)}, {1.0f, 0.0f, 0.0f}, right);
  b.quad({at(552.8f, 0, 0), at(549.6f, 0, 559.2f), at(556, 548.8f, 559.2f), at(556, 548.8f, 0)},
         {-1.0f, 0.0f, 0.0f}, left);
  cornell_block(b, {{130, 65}, {82, 225}, {240, 272}, {290, 114}}, 165.0f, white);
  cornell_block(b, {{423, 247}, {265, 296}, {314, 456}, {472, 406}}, 330.0f, white);
  // Half a unit below the published height, which is the ceiling's: two coplanar surfaces have no order.
  b.quad({at(343, 548.3f, 227), at(343, 548.3f, 332), at(213, 548.3f, 332), at(213, 548.3f, 227)}, -up,
         light);
  // Film 0.025 square, focal length 0.035.
  b.look(at(278, 273, -800), at(278, 273, 0), 2.0f * std::atan(0.0125f / 0.035f));
  return b.finish(8);
}

scene cornell_enclosed() {
  scene_builder b("cornell-enclosed");
  const auto white = b.diffuse(vec3(0.75f)), left = b.diffuse(red), right = b.diffuse(green);
  const auto light = b.lamp({18.0f, 14.0f, 7.0f});
  material smooth_glass;
  smooth_glass.kind = material_kind::dielectric;
  smooth_glass.base_color = vec3(1.0f);
  const auto glass = b.add(smooth_glass);
  b.room({{-1.0f, 0.0f, -1.0f}, {1.0f, 2.0f, 1.0f}},
         {left, right, white, white, white, room_materials::open});
  b.box({{-0.33f, 0.6f, -0.29f}, {0.6f, 1.2f, 0.6f}, 0.3f}, white);
  b.box({{0.35f, 0.3f, 0.33f}, {0.6f, 0.6f, 0.6f}, -0.3f}, white);
  const vec3 lamp_centre(0.0f, 1.8f, 0.0f);
  b.ceiling_lamp(lamp_centre, {0.47f, 0.38f}, light);
  b.box({lamp_centre, {0.70f, 0.24f, 0.60f}}, glass);
  b.look({0.0f, 1.0f, 3.9f}, {0.0f, 1.0f, 0.0f}, 0.686f);
  return b.finish(8);
}

/// The separating wall of `ajar`, z in [-0.05, 0.05], with a doorway 1.0 wide and 2.2 high in its middle.
/// Only the faces that can be seen are made.
void wall_with_doorway(scene_builder& b, std::uint32_t material_index) {
  for (float sign : {-1.0f, 1.0f}) {
    const vec3 facing(0.0f, 0.0f, sign);
    const float z = 0.05f * sign;
    b.parallelogram({-2.0f, 0.0f, z}, {1.5f, 0.0f, 0.0f}, {0.0f, 3.0f, 0.0f}, {facing, material_index});
    b.parallelogram({0.5f, 0.0f, z}, {1.5f, 0.0f, 0.0f}, {0.0f, 3.0f, 0.0f}, {facing, material_index});
    b.parallelogram({-0.5f, 2.2f, z}, {1.0f, 0.0f, 0.0f}, {0.0f, 0.8f, 0.0f}, {facing, material_index});
    b.parallelogram({0.5f * sign, 0.0f, -0.05f}, {0.0f, 2.2f, 0.0f}, {0.0f, 0.0f, 0.1f},
                    {{-sign, 0.0f, 0.0f}, material_index});
  }
  b.parallelogram({-0.5f, 2.2f, -0.05f}, {1.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.1f}, {-up, material_index});
}

scene ajar() {
  scene_builder b("ajar");
  const auto white = b.diffuse(vec3(0.75f)), wood = b.diffuse({0.6f, 0.42f, 0.28f});
  const auto light = b.lamp(vec3(6000.0f));
  const auto floor = b.glossy(material_kind::plastic, {0.5f, 0.45f, 0.4f}, 0.25f);
  const auto brass = b.glossy(material_kind::conductor, {0.95f, 0.79f, 0.55f}, 0.2f);
  // Two rooms of 4 x 3 x 4 and the thickness of the wall between them; z > 0 is the dark one.
  b.room({{-2.0f, 0.0f, -4.05f}, {2.0f, 3.0f, 4.05f}}, {white, white, floor, white, white, white});
  wall_with_doorway(b, white);
  // The hinge is at x = -0.5 and the door opens into the dark room, 0.24 m at its free edge.
  const vec3 hinge(-0.5f, 1.1f, 0.0f);
  const float angle = -0.25f;
  b.box({hinge + turned({0.49f, 0.0f, 0.0f}, angle), {0.98f, 2.18f, 0.04f}, angle}, wood);
  b.box({{0.85f, 0.3f, 0.95f}, {0.6f, 0.6f, 0.6f}, 0.5f}, brass);
  // On the side of the door's free edge: the door then hides the lamp from the dark room.
  b.ceiling_lamp({1.7f, 2.9f, -3.75f}, {0.3f, 0.3f}, light);
  b.look({-0.4f, 1.6f, 3.85f}, {0.1f, 1.2f, 0.0f}, 0.9f);
  return b.finish(8);
}

scene thin_wall() {
  scene_builder b("thin-wall");
  const auto white = b.diffuse(vec3(0.75f)), back = b.diffuse(green),
             divider = b.diffuse({0.7f, 0.6f, 0.45f});
  const auto light = b.lamp(vec3(200.0f));
  b.room({{-2.0f, 0.0f, -2.0f}, {2.0f, 3.0f, 2.0f}}, {white, white, white, white, back, white});
  b.parallelogram({0.0f, 0.0f, -2.0f}, {0.0f, 0.0f, 4.0f}, {0.0f, 2.6f, 0.0f}, {{1.0f, 0.0f, 0.0f}, divider});
  b.box({{1.1f, 0.35f, -1.0f}, {0.7f, 0.7f, 0.7f}, 0.4f}, white);
  b.ceiling_lamp({-1.0f, 2.5f, 0.0f}, {0.4f, 0.4f}, light);
  b.look({1.7f, 1.5f, 1.85f}, {0.6f, 1.5f, -1.0f}, 1.1f);
  return b.finish(6);
}

scene glossy_room() {
  scene_builder b("glossy-room");
  const auto white = b.diffuse(vec3(0.75f));
  const auto steel = b.glossy(material_kind::conductor, vec3(0.75f), 0.3f),
             copper = b.glossy(material_kind::conductor, {0.9f, 0.6f, 0.45f}, 0.3f);
  const auto light = b.lamp(vec3(150.0f));
  b.room({{-2.0f, 0.0f, -2.0f}, {2.0f, 3.0f, 2.0f}}, {copper, steel, steel, white, steel, steel});
  // A trough hides the lamp from below: all light comes by way of the ceiling.
  b.parallelogram({-1.5f, 2.2f, -1.9f}, {0.5f, 0.0f, 0.0f}, {0.0f, 0.0f, 3.0f}, {-up, white});
  b.parallelogram({-1.5f, 2.2f, -1.9f}, {0.0f, 0.25f, 0.0f}, {0.0f, 0.0f, 3.0f},
                  {{-1.0f, 0.0f, 0.0f}, white});
  b.parallelogram({-1.0f, 2.2f, -1.9f}, {0.0f, 0.25f, 0.0f}, {0.0f, 0.0f, 3.0f}, {{1.0f, 0.0f, 0.0f}, white});
  b.parallelogram({-1.35f, 2.25f, -1.0f}, {0.2f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.2f}, {up, light});
  b.box({{0.7f, 0.4f, -0.6f}, {0.8f, 0.8f, 0.8f}, 0.4f}, copper);
  b.look({0.9f, 1.5f, 1.85f}, {-0.1f, 1.2f, -1.0f}, 1.1f);
  return b.finish(8);
}

/// Four rooms in a row, z from 1.5 to -8.5, with three lamps each, and walls without thickness between them
/// that leave a passage on alternate sides.
scene many_lamps() {
  scene_builder b("many-lamps");
  const auto white = b.diffuse(vec3(0.7f)), left = b.diffuse(red), right = b.diffuse(green);
  const auto floor = b.glossy(material_kind::plastic, {0.45f, 0.42f, 0.38f}, 0.2f);
  b.room({{-2.0f, 0.0f, -8.5f}, {2.0f, 3.0f, 1.5f}}, {left, right, floor, white, white, white});
  const float brightness[4][3] = {
      {40.0f, 5.0f, 15.0f}, {2.0f, 30.0f, 8.0f}, {60.0f, 1.0f, 15.0f}, {5.0f, 90.0f, 40.0f}};
  for (int room = 0; room < 4; ++room) {
    const float z = 0.25f - 2.5f * static_cast<float>(room);
    if (room > 0)
      b.parallelogram({room % 2 == 1 ? -2.0f : -0.8f, 0.0f, z + 1.25f}, {2.8f, 0.0f, 0.0f},
                      {0.0f, 3.0f, 0.0f}, {{0.0f, 0.0f, 1.0f}, white});
    for (int i = 0; i < 3; ++i)
      b.ceiling_lamp({1.3f * static_cast<float>(i - 1), 2.6f, z}, {0.3f, 0.15f},
                     b.lamp(brightness[room][i] * vec3(1.0f, 0.8f, 0.55f)));
  }
  b.box({{0.6f, 0.3f, -0.4f}, {0.6f, 0.6f, 0.6f}, 0.4f}, white);
  scene s = b.finish(8);
  punctual_light bulb;
  bulb.position = {-1.6f, 0.9f, -2.0f};
  bulb.intensity = {0.2f, 0.4f, 1.0f};
  punctual_light spot;
  spot.kind = punctual_kind::spot;
  spot.position = {-1.5f, 2.8f, 0.2f};
  spot.direction = glm::normalize(vec3(0.6f, -1.0f, -0.4f));
  spot.intensity = vec3(3.0f);
  spot.cos_inner = 0.95f;
  spot.cos_outer = 0.9f;
  s.punctual_lights = {bulb, spot};
  s.view.position = {-1.6f, 1.7f, 1.4f};
  s.view.forward = glm::normalize(vec3(0.75f, -0.12f, -1.0f));
  s.view.up = up;
  s.view.vertical_fov = 1.1f;
  return s;
}

scene furnace() {
  scene_builder b("furnace");
  material wall;
  wall.base_color = vec3(0.5f);
  wall.emission = vec3(1.0f);
  const auto m = b.add(wall);
  b.room({vec3(-1.0f), vec3(1.0f)}, {m, m, m, m, m, m});
  b.look({0.1f, 0.2f, 0.7f}, {0.0f, 0.0f, -1.0f}, 0.9f);
  return b.finish(8);
}

using maker = scene (*)();

const std::vector<std::pair<std::string, maker>>& makers() {
  static const std::vector<std::pair<std::string, maker>> all = {
      {"cornell-box", cornell_box}, {"cornell-enclosed", cornell_enclosed}, {"ajar", ajar},
      {"thin-wall", thin_wall},     {"glossy-room", glossy_room},           {"many-lamps", many_lamps},
      {"furnace", furnace}};
  return all;
}

}  // namespace

std::vector<std::string> builtin_scene_names() {
  std::vector<std::string> names;
  for (const auto& entry : makers()) names.push_back(entry.first);
  return names;
}

bool is_builtin_scene(const std::string& name) {
  for (const auto& entry : makers())
    if (entry.first == name) return true;
  return false;
}

scene make_builtin_scene(const std::string& name) {
  std::string known;
  for (const auto& entry : makers()) {
    if (entry.first == name) return entry.second();
    known += (known.empty() ? "" : ", ") + entry.first;
  }
  throw std::invalid_argument("unknown built-in scene '" + name + "', known are: " + known);
}

double furnace_radiance(int max_depth) {
  double sum = 0.0, term = 1.0;
  for (int k = 0; k < max_depth; ++k, term *= 0.5) sum += term;
  return sum;
}

}  // namespace render
