// The built-in scenes, one function each.
#include "scene/builtin_scenes.hpp"

#include "scene/scene_builder.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace render {
namespace {

constexpr vec3 red{0.65f, 0.05f, 0.05f};
constexpr vec3 green{0.12f, 0.45f, 0.15f};
constexpr vec3 up{0.0f, 1.0f, 0.0f};

/// A block of the published Cornell data: its top with corners in order, and its height. Its sides go down to
/// the floor.
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
  // Half a unit below the published height, which is the ceiling's. Coplanar surfaces would hide each other
  // at random.
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

/// A box with a wall in its middle, which reaches the floor, the ceiling and the back. In front of it is a
/// passage.
scene cornell_wall() {
  scene_builder b("cornell-wall");
  const auto white = b.diffuse(vec3(0.75f)), left = b.diffuse(red), right = b.diffuse(green);
  const auto light = b.lamp({60.0f, 48.0f, 27.0f});
  b.room({{-1.0f, 0.0f, -1.0f}, {1.0f, 2.0f, 1.0f}},
         {left, right, white, white, white, room_materials::open});
  for (float sign : {-1.0f, 1.0f})
    b.parallelogram({0.04f * sign, 0.0f, -1.0f}, {0.0f, 2.0f, 0.0f}, {0.0f, 0.0f, 1.1f},
                    {{sign, 0.0f, 0.0f}, white});
  b.parallelogram({-0.04f, 0.0f, 0.1f}, {0.08f, 0.0f, 0.0f}, {0.0f, 2.0f, 0.0f}, {{0.0f, 0.0f, 1.0f}, white});
  b.box({{-0.55f, 0.6f, -0.35f}, {0.45f, 1.2f, 0.45f}, 0.3f}, white);
  b.box({{0.5f, 0.25f, -0.1f}, {0.5f, 0.5f, 0.5f}, -0.3f}, white);
  // So far back that the wall's edge hides it from the whole left half.
  b.ceiling_lamp({0.55f, 1.99f, -0.7f}, {0.4f, 0.3f}, light);
  b.look({0.0f, 1.0f, 3.9f}, {0.0f, 1.0f, 0.0f}, 0.686f);
  return b.finish(8);
}

/// The separating wall of `ajar`, z in [-0.05, 0.05], with a doorway 1.0 wide and 2.2 high in its middle. Has
/// only its visible faces.
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
  // Two rooms of 4 x 3 x 4 plus the thickness of the wall between them. z > 0 is the dark room.
  b.room({{-2.0f, 0.0f, -4.05f}, {2.0f, 3.0f, 4.05f}}, {white, white, floor, white, white, white});
  wall_with_doorway(b, white);
  // The hinge is at x = -0.5. The door opens into the dark room, 0.24 m at its free edge.
  const vec3 hinge(-0.5f, 1.1f, 0.0f);
  const float angle = -0.25f;
  b.box({hinge + turned({0.49f, 0.0f, 0.0f}, angle), {0.98f, 2.18f, 0.04f}, angle}, wood);
  b.box({{0.85f, 0.3f, 0.95f}, {0.6f, 0.6f, 0.6f}, 0.5f}, brass);
  // On the side of the door's free edge, so that the door hides the lamp from the dark room.
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
  // A trough hides the lamp from below, so all light comes from the ceiling.
  b.parallelogram({-1.5f, 2.2f, -1.9f}, {0.5f, 0.0f, 0.0f}, {0.0f, 0.0f, 3.0f}, {-up, white});
  b.parallelogram({-1.5f, 2.2f, -1.9f}, {0.0f, 0.25f, 0.0f}, {0.0f, 0.0f, 3.0f},
                  {{-1.0f, 0.0f, 0.0f}, white});
  b.parallelogram({-1.0f, 2.2f, -1.9f}, {0.0f, 0.25f, 0.0f}, {0.0f, 0.0f, 3.0f}, {{1.0f, 0.0f, 0.0f}, white});
  b.parallelogram({-1.35f, 2.25f, -1.0f}, {0.2f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.2f}, {up, light});
  b.box({{0.7f, 0.4f, -0.6f}, {0.8f, 0.8f, 0.8f}, 0.4f}, copper);
  b.look({0.9f, 1.5f, 1.85f}, {-0.1f, 1.2f, -1.0f}, 1.1f);
  return b.finish(8);
}

/// Four rooms in a row, z from 1.5 to -8.5, with three lamps each. Walls without thickness between them leave
/// a passage on alternate sides.
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

/// A closed room of 4 x 3.2 x 4 whose walls hold the water. The camera is in the water.
scene caustic_pool() {
  scene_builder b("caustic-pool");
  const auto white = b.diffuse(vec3(0.75f)), tiles = b.diffuse({0.35f, 0.55f, 0.6f}),
             stone = b.diffuse({0.7f, 0.65f, 0.55f});
  const auto light = b.lamp(vec3(50.0f));
  material smooth_water;
  smooth_water.kind = material_kind::dielectric;
  smooth_water.base_color = vec3(1.0f);
  smooth_water.ior = 1.33f;
  const auto water = b.add(smooth_water);
  b.room({{-2.0f, 0.0f, -2.0f}, {2.0f, 3.2f, 2.0f}}, {tiles, tiles, white, white, tiles, tiles});
  b.box({{0.7f, 0.3f, -0.9f}, {0.6f, 0.6f, 0.6f}, 0.4f}, stone);
  // Waves shorter than a metre, whose crests focus about as deep as the floor. The sheet extends behind the
  // walls, so that no path passes its edge.
  const water_surface surface(1.2f, {{{7.3f, 2.9f}, 0.018f, 0.3f},
                                     {{-4.3f, 8.3f}, 0.013f, 1.7f},
                                     {{10.9f, -6.4f}, 0.007f, 4.1f},
                                     {{5.6f, 13.7f}, 0.0045f, 2.6f}});
  b.water(surface, 2.02f, 64, water);
  b.ceiling_lamp({0.0f, 3.15f, -0.4f}, {0.4f, 0.4f}, light);
  b.look({-0.4f, 0.95f, 1.9f}, {0.0f, 0.4f, -0.4f}, 1.2f);
  return b.finish(8);
}

/// Chrome and glass balls in a closed room. The lamp is in a box of glass, so all light comes through it.
scene mirror_balls() {
  scene_builder b("mirror-balls");
  const auto white = b.diffuse(vec3(0.75f)), left = b.diffuse(red), right = b.diffuse(green),
             floor = b.diffuse({0.5f, 0.45f, 0.4f});
  const auto light = b.lamp(vec3(120.0f));
  const auto chrome = b.glossy(material_kind::mirror, vec3(0.95f), 0.1f),
             glass = b.glass(material_kind::dielectric);
  b.room({{-2.0f, 0.0f, -2.0f}, {2.0f, 3.0f, 2.0f}}, {left, right, floor, white, white, white});
  const auto place = [&](float x, float z, float radius, std::uint32_t material_index) {
    b.sphere({x, radius + 0.001f, z}, radius, 32, material_index);
  };
  place(-1.1f, -1.0f, 0.6f, chrome);
  place(0.3f, -1.2f, 0.5f, chrome);
  place(1.3f, -0.5f, 0.4f, chrome);
  place(-0.5f, 0.2f, 0.4f, glass);
  place(0.6f, 0.3f, 0.35f, glass);
  const vec3 lamp_centre(0.0f, 2.7f, -0.3f);
  b.ceiling_lamp(lamp_centre, {0.25f, 0.25f}, light);
  b.box({lamp_centre, {0.5f, 0.24f, 0.5f}}, glass);
  b.look({0.0f, 1.3f, 1.95f}, {0.0f, 0.7f, -1.0f}, 1.1f);
  return b.finish(10);
}

/// A room after Veach's of 1997. A lamp in a shade that is open above lights the ceiling. A spot in a tube
/// lights a glass egg on a table.
scene veach_bidir() {
  scene_builder b("veach-bidir");
  const auto white = b.diffuse(vec3(0.7f)), wall = b.diffuse({0.6f, 0.55f, 0.45f}),
             wood = b.diffuse({0.45f, 0.3f, 0.2f}), metal = b.diffuse(vec3(0.3f));
  const auto warm = b.lamp({300.0f, 240.0f, 160.0f}), bright = b.lamp(vec3(400.0f));
  const auto glass = b.glass(material_kind::dielectric);
  b.room({{-2.0f, 0.0f, -2.0f}, {2.0f, 2.6f, 2.0f}}, {wall, wall, wood, white, wall, wall});
  b.box({{0.3f, 0.35f, -0.4f}, {1.4f, 0.7f, 0.9f}}, wood);
  b.sphere({0.3f, 0.951f, -0.35f}, 0.25f, 32, glass);
  // Four sides around a lamp that faces up or down, seen from outside and inside.
  const auto shade = [&](vec3 centre, float half, float height) {
    for (int side = 0; side < 4; ++side) {
      const float turn = 1.57079633f * static_cast<float>(side);
      const vec3 out = turned({0.0f, 0.0f, half}, turn), along = turned({2.0f * half, 0.0f, 0.0f}, turn);
      b.parallelogram(centre + out - 0.5f * along, along, {0.0f, height, 0.0f}, {out / half, metal});
    }
  };
  const vec3 floor_lamp(-1.4f, 1.6f, -1.3f), spot(0.3f, 2.25f, -0.35f);
  b.box({{floor_lamp.x, 0.5f * floor_lamp.y - 0.01f, floor_lamp.z}, {0.05f, floor_lamp.y - 0.02f, 0.05f}},
        metal);
  b.parallelogram(floor_lamp - vec3(0.1f, 0.0f, 0.1f), {0.2f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.2f}, {up, warm});
  shade(floor_lamp - vec3(0.0f, 0.05f, 0.0f), 0.15f, 0.35f);
  b.ceiling_lamp(spot, {0.08f, 0.08f}, bright);
  shade(spot - vec3(0.0f, 0.3f, 0.0f), 0.06f, 0.32f);
  b.look({0.9f, 1.4f, 1.9f}, {-0.2f, 1.0f, -0.8f}, 1.1f);
  return b.finish(8);
}

/// Spheres of metal, of plastic and of glass on a floor.
scene materials() {
  scene_builder b("materials");
  const auto floor = b.diffuse(vec3(0.45f)), light = b.lamp(vec3(15.0f));
  const auto silver = b.glossy(material_kind::mirror, vec3(0.95f, 0.93f, 0.88f), 0.1f),
             gold = b.glossy(material_kind::mirror, {1.0f, 0.78f, 0.34f}, 0.1f),
             copper = b.glossy(material_kind::conductor, {0.95f, 0.64f, 0.54f}, 0.1f);
  const auto varnish = b.glossy(material_kind::smooth_plastic, {0.5f, 0.03f, 0.03f}, 0.1f),
             paint = b.glossy(material_kind::plastic, {0.06f, 0.2f, 0.6f}, 0.15f);
  const auto clear = b.glass(material_kind::dielectric), frosted = b.glass(material_kind::rough_dielectric);
  b.parallelogram({-8.0f, 0.0f, -8.0f}, {16.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 16.0f}, {up, floor});
  const auto place = [&](float x, float z, std::uint32_t material_index) {
    b.sphere({x, 0.501f, z}, 0.5f, 32, material_index);
  };
  place(-1.2f, -1.2f, silver);
  place(0.0f, -1.2f, gold);
  place(1.2f, -1.2f, copper);
  place(-0.6f, 0.0f, varnish);
  place(0.6f, 0.0f, paint);
  place(-1.8f, 0.0f, clear);
  place(1.8f, 0.0f, frosted);
  b.box({{0.0f, 0.2f, 1.0f}, {2.4f, 0.4f, 0.4f}},
        b.glossy(material_kind::smooth_plastic, {0.1f, 0.35f, 0.12f}, 0.1f));
  b.ceiling_lamp({0.0f, 3.5f, 0.5f}, {1.5f, 1.5f}, light);
  b.sky(vec3(0.16f, 0.19f, 0.24f));
  b.look({0.0f, 2.2f, 5.2f}, {0.0f, 0.4f, -0.3f}, 0.62f);
  return b.finish(8);
}

/// A hazy sky from the horizon to the zenith, the ground's colour below, and a sun whose glow falls by e from
/// texel to texel. Texels are looked up bilinearly but sampled as constants, so a sharper disc would give
/// bright pixels.
environment_map sunny_sky(vec3 toward_sun) {
  environment_map sky;
  sky.width = 512;
  sky.height = 256;
  const float step = 3.14159265f / static_cast<float>(sky.height);
  for (int row = 0; row < sky.height; ++row)
    for (int column = 0; column < sky.width; ++column) {
      const float theta = step * (static_cast<float>(row) + 0.5f);
      const float phi = step * (static_cast<float>(column) + 0.5f - 0.5f * static_cast<float>(sky.width));
      const vec3 w(std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi));
      const float haze = std::exp(-4.0f * glm::max(w.y, 0.0f));
      vec3 radiance =
          w.y < 0.0f ? vec3(0.3f, 0.28f, 0.24f) : glm::mix(vec3(0.16f, 0.3f, 0.62f), vec3(0.75f), haze);
      const float angle = std::acos(glm::clamp(glm::dot(w, toward_sun), -1.0f, 1.0f));
      radiance += std::exp(-angle / step) * vec3(3000.0f, 2600.0f, 2000.0f);
      sky.texels.push_back(radiance);
    }
  return sky;
}

scene outdoor() {
  scene_builder b("outdoor");
  const auto ground = b.diffuse({0.32f, 0.3f, 0.24f}), wall = b.diffuse({0.7f, 0.65f, 0.58f}),
             clay = b.diffuse({0.6f, 0.28f, 0.18f});
  const auto paint = b.glossy(material_kind::plastic, {0.08f, 0.25f, 0.5f}, 0.2f),
             brass = b.glossy(material_kind::conductor, {0.95f, 0.79f, 0.55f}, 0.25f),
             varnish = b.glossy(material_kind::smooth_plastic, {0.35f, 0.02f, 0.03f}, 0.1f);
  const auto frosted = b.glass(material_kind::rough_dielectric, 0.2f);
  b.parallelogram({-12.0f, 0.0f, -16.0f}, {24.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 24.0f}, {up, ground});
  b.box({{-1.2f, 1.0f, -1.9f}, {4.6f, 2.0f, 0.3f}, 0.35f}, wall);
  const auto place = [&](float x, float z, float radius, std::uint32_t material_index) {
    b.sphere({x, radius + 0.001f, z}, radius, 32, material_index);
  };
  place(-1.7f, -0.5f, 0.7f, clay);
  place(-0.1f, -0.6f, 0.6f, brass);
  place(1.3f, -0.5f, 0.7f, paint);
  place(-0.8f, 0.8f, 0.4f, varnish);
  place(0.5f, 0.8f, 0.45f, frosted);
  b.sky(sunny_sky(glm::normalize(vec3(0.75f, 0.55f, 0.25f))));
  b.look({0.3f, 1.7f, 5.6f}, {-0.1f, 0.6f, -0.3f}, 0.62f);
  return b.finish(8);
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

punctual_light lamp_at(vec3 position, vec3 intensity) {
  punctual_light lamp;
  lamp.position = position;
  lamp.intensity = intensity;
  return lamp;
}

scene fog_lamp() {
  scene_builder b("fog-lamp");
  b.look({0.0f, 0.4f, 5.0f}, {0.0f, 0.0f, 0.0f}, 0.9f);
  scene s = b.finish(8);
  s.fog = {vec3(0.02f), {0.06f, 0.08f, 0.1f}, 0.4f};
  s.punctual_lights = {lamp_at(vec3(0.0f), {40.0f, 36.0f, 28.0f})};
  return s;
}

/// The inside of a solid.
material filled(float ior, vec3 absorption, vec3 scattering, float g) {
  material m;
  m.kind = material_kind::dielectric;
  m.base_color = vec3(1.0f);
  m.ior = ior;
  m.absorption = absorption;
  m.scattering = scattering;
  m.g = g;
  return m;
}

/// A box so large and deep that its sides and its bottom do not show.
scene slab() {
  scene_builder b("slab");
  const vec3 scattering(0.95f, 0.9f, 0.5f);
  b.box({{0.0f, -20.0f, 0.0f}, {120.0f, 40.0f, 120.0f}},
        b.add(filled(1.0f, vec3(1.0f) - scattering, scattering, 0.0f)));
  b.sky(vec3(1.0f));
  b.look({0.0f, 12.0f, 24.0f}, {0.0f, 0.0f, 0.0f}, 0.9f);
  return b.finish(256);
}

/// A closed room of 4 x 3 x 4. A screen from wall to wall has a level slit, and behind it is the lamp. The
/// camera looks along the sheet of light.
scene fog_spot() {
  scene_builder b("fog-spot");
  const auto white = b.diffuse(vec3(0.7f)), wood = b.diffuse({0.6f, 0.42f, 0.28f});
  b.room({{-2.0f, 0.0f, -2.0f}, {2.0f, 3.0f, 2.0f}}, {white, white, white, white, white, white});
  for (const float y : {0.0f, 2.03f})
    b.parallelogram({-1.2f, y, -2.0f}, {0.0f, y > 0.0f ? 0.97f : 1.97f, 0.0f}, {0.0f, 0.0f, 4.0f},
                    {{1.0f, 0.0f, 0.0f}, wood});
  b.box({{0.6f, 0.3f, -0.6f}, {0.6f, 0.6f, 0.6f}, 0.4f}, white);
  b.look({0.4f, 1.5f, 1.9f}, {-0.1f, 1.3f, -1.0f}, 1.1f);
  scene s = b.finish(8);
  punctual_light spot = lamp_at({-1.8f, 2.5f, 0.0f}, {200.0f, 180.0f, 140.0f});
  spot.kind = punctual_kind::spot;
  spot.direction = glm::normalize(vec3(0.6f, -0.5f, 0.0f));
  spot.cos_inner = 0.97f;
  spot.cos_outer = 0.92f;
  s.punctual_lights = {spot};
  s.fog = {vec3(0.01f), vec3(0.15f), 0.3f};
  return s;
}

/// A closed room of 4 x 3 x 4. A lamp in the ceiling shines on a ball of glass.
scene glass_caustic_fog() {
  scene_builder b("glass-caustic-fog");
  const auto grey = b.diffuse(vec3(0.4f)), floor = b.diffuse({0.5f, 0.45f, 0.4f});
  b.room({{-2.0f, 0.0f, -2.0f}, {2.0f, 3.0f, 2.0f}}, {grey, grey, floor, grey, grey, grey});
  b.ceiling_lamp({0.0f, 2.98f, -0.2f}, {0.16f, 0.16f}, b.lamp({500.0f, 460.0f, 380.0f}));
  b.sphere({0.0f, 1.8f, -0.2f}, 0.5f, 32, b.glass(material_kind::dielectric));
  b.look({0.0f, 1.3f, 1.9f}, {0.0f, 1.2f, -1.0f}, 1.1f);
  scene s = b.finish(12);
  s.fog = {vec3(0.02f), vec3(0.6f), 0.2f};
  return s;
}

/// A closed room with two candles of one wax, each with a small flame. Light enters the left one unbent; the
/// right one has wax's index.
scene wax() {
  scene_builder b("wax");
  const auto wall = b.diffuse({0.25f, 0.25f, 0.3f}), wood = b.diffuse({0.45f, 0.3f, 0.2f});
  b.room({{-1.5f, 0.0f, -1.5f}, {1.5f, 2.5f, 1.5f}}, {wall, wall, wood, wall, wall, wall});
  std::vector<punctual_light> flames;
  for (const float side : {-1.0f, 1.0f}) {
    const float x = 0.55f * side, height = side < 0.0f ? 1.1f : 0.8f;
    b.box({{x, 0.5f * height + 0.001f, 0.0f}, {0.5f, height, 0.5f}, 0.3f * side},
          b.add(filled(side < 0.0f ? 1.0f : 1.44f, {0.02f, 0.1f, 0.4f}, {12.0f, 10.0f, 8.0f}, 0.3f)));
    flames.push_back(lamp_at({x, height + 0.12f, 0.0f}, {3.0f, 1.8f, 0.7f}));
  }
  b.look({0.0f, 1.2f, 1.45f}, {0.0f, 0.65f, -0.5f}, 1.0f);
  scene s = b.finish(64);
  s.punctual_lights = flames;
  return s;
}

/// A closed room with five bottles of liquids on a shelf before a mirror. A lamp in a box of glass lights
/// them, so that light samples find no light.
scene bottles() {
  scene_builder b("bottles");
  const auto white = b.diffuse(vec3(0.6f)), wood = b.diffuse({0.5f, 0.35f, 0.22f});
  b.room({{-1.5f, 0.0f, -1.2f}, {1.5f, 2.2f, 1.5f}}, {white, white, wood, white, white, white});
  b.box({{0.0f, 0.35f, -0.75f}, {2.6f, 0.7f, 0.7f}}, wood);
  b.parallelogram({-1.3f, 0.75f, -1.15f}, {2.6f, 0.0f, 0.0f}, {0.0f, 1.1f, 0.0f},
                  {{0.0f, 0.0f, 1.0f}, b.glossy(material_kind::mirror, vec3(0.9f), 0.1f)});
  const material liquids[] = {filled(1.33f, {0.05f, 0.6f, 2.5f}, vec3(0.0f), 0.0f),          // tea
                              filled(1.34f, vec3(0.02f), {14.0f, 14.0f, 13.0f}, 0.7f),       // milk
                              filled(1.33f, {0.1f, 1.0f, 3.0f}, {2.0f, 1.4f, 0.8f}, 0.5f),   // juice
                              filled(1.0f, vec3(0.05f), vec3(1.2f), 0.0f),                   // smoke
                              filled(1.47f, {1.5f, 0.3f, 0.6f}, {0.4f, 0.5f, 0.4f}, 0.8f)};  // oil
  for (int i = 0; i < 5; ++i) {
    const auto inside = b.add(liquids[i]);
    const float x = 0.5f * static_cast<float>(i - 2), height = i % 2 == 0 ? 0.6f : 0.45f;
    if (i == 3)
      b.sphere({x, 0.93f, -0.7f}, 0.22f, 24, inside);
    else
      b.box({{x, 0.701f + 0.5f * height, -0.7f}, {0.3f, height, 0.3f}, 0.2f * static_cast<float>(i - 2)},
            inside);
  }
  const vec3 lamp_centre(0.3f, 2.0f, 0.2f);
  b.ceiling_lamp(lamp_centre, {0.2f, 0.2f}, b.lamp({160.0f, 150.0f, 130.0f}));
  b.box({lamp_centre, {0.4f, 0.2f, 0.4f}}, b.glass(material_kind::dielectric));
  b.look({0.0f, 1.35f, 1.4f}, {0.0f, 0.95f, -0.9f}, 0.95f);
  return b.finish(32);
}

using maker = scene (*)();

const std::vector<std::pair<std::string, maker>>& makers() {
  static const std::vector<std::pair<std::string, maker>> all = {{"cornell-box", cornell_box},
                                                                 {"cornell-enclosed", cornell_enclosed},
                                                                 {"cornell-wall", cornell_wall},
                                                                 {"ajar", ajar},
                                                                 {"thin-wall", thin_wall},
                                                                 {"glossy-room", glossy_room},
                                                                 {"caustic-pool", caustic_pool},
                                                                 {"mirror-balls", mirror_balls},
                                                                 {"veach-bidir", veach_bidir},
                                                                 {"many-lamps", many_lamps},
                                                                 {"materials", materials},
                                                                 {"outdoor", outdoor},
                                                                 {"furnace", furnace},
                                                                 {"fog-lamp", fog_lamp},
                                                                 {"slab", slab},
                                                                 {"fog-spot", fog_spot},
                                                                 {"glass-caustic-fog", glass_caustic_fog},
                                                                 {"wax", wax},
                                                                 {"bottles", bottles}};
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
