// The equal-area octahedral map: round trips both ways, areas, neighbours across the square's edges, packing.
#include "support/catch.hpp"
#include "support/policies.hpp"

#include <wfpg/base/octahedral_map.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::vec2;
using wfpg::vec3;

constexpr double pi = 3.14159265358979323846;

double angle_between(vec3 a, vec3 b) {
  const glm::dvec3 p(a), q(b);
  return std::atan2(glm::length(glm::cross(p, q)), glm::dot(p, q));
}

/// The two maps under one name.
struct sphere {
  WFPG_HD static vec3 direction(vec2 uv) { return wfpg::square_to_sphere(uv); }
  WFPG_HD static vec2 square(vec3 d) { return wfpg::sphere_to_square(d); }
  static constexpr double area = 4.0 * pi;
  WFPG_HD static bool covers(vec3) { return true; }
};
struct hemisphere {
  WFPG_HD static vec3 direction(vec2 uv) { return wfpg::square_to_hemisphere(uv); }
  WFPG_HD static vec2 square(vec3 d) { return wfpg::hemisphere_to_square(d); }
  static constexpr double area = 2.0 * pi;
  WFPG_HD static bool covers(vec3 d) { return d.z >= 0.0f; }
};

/// Points of the square: a grid with its edges, its diagonals, points close to them, and random points.
std::vector<vec2> square_points() {
  std::vector<vec2> points;
  for (int x = 0; x <= 32; ++x)
    for (int y = 0; y <= 32; ++y) points.push_back(vec2(x, y) / 32.0f);
  for (const float tiny : {1.0e-7f, 1.0e-5f, 1.0e-3f})
    for (int i = 0; i <= 32; ++i) {
      const float t = static_cast<float>(i) / 32.0f;
      for (const vec2 p : {vec2(tiny, t), vec2(1.0f - tiny, t), vec2(0.5f + tiny, t), vec2(0.5f - tiny, t)}) {
        points.push_back(p);
        points.push_back({p.y, p.x});
      }
    }
  random_numbers random(11);
  while (points.size() < 20000) {
    const float u = random.unit();
    points.push_back({u, random.unit()});
  }
  return points;
}

/// Axes, edges of the octants, directions close to the poles and the equator, random directions.
std::vector<vec3> directions() {
  std::vector<vec3> all;
  for (int i = 0; i < 27; ++i)
    if (i != 13) all.push_back(glm::normalize(vec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
  random_numbers random(12);
  for (const float small : {1.0e-10f, 1.0e-6f, 1.0e-4f, 1.0e-2f})
    for (int i = 0; i < 60; ++i) {
      const vec3 d = random.direction();
      all.push_back(glm::normalize(vec3(d.x, d.y, small)));
      all.push_back(glm::normalize(vec3(d.x, d.y, -small)));
      all.push_back(glm::normalize(vec3(small * d.x, small * d.y, d.z < 0.0f ? -1.0f : 1.0f)));
      all.push_back(glm::normalize(vec3(small * d.x, d.y, d.z)));
    }
  while (all.size() < 20000) all.push_back(random.direction());
  return all;
}

/// Round trips of all points, computed on the policy.
template <class Map, class Exec>
void check_square_round_trip(const Exec& exec) {
  const std::vector<vec2> points = square_points();
  const wfpg::buffer<vec2, Exec> from(exec, points), back(exec, points.size());
  const wfpg::buffer<vec3, Exec> through(exec, points.size());
  const auto f = from.view(), b = back.view();
  const auto t = through.view();
  exec.for_each(points.size(), [=] WFPG_HD(std::size_t i) {
    t[i] = Map::direction(f[i]);
    b[i] = Map::square(t[i]);
  });
  const std::vector<vec2> returned = back.to_host(exec);
  const std::vector<vec3> on_sphere = through.to_host(exec);
  double worst = 0.0, worst_length = 0.0;
  bool inside = true;
  constexpr float slack = fast_math ? 1.0e-7f : 0.0f;
  for (std::size_t i = 0; i < points.size(); ++i) {
    worst = std::max(worst, double(glm::length(returned[i] - points[i])));
    worst_length = std::max(worst_length, std::abs(glm::length(glm::dvec3(on_sphere[i])) - 1.0));
    for (const float x : {returned[i].x, returned[i].y}) inside &= x >= -slack && x <= 1.0f + slack;
    inside &= Map::covers(on_sphere[i]);
  }
  CHECK(inside);
  CHECK(worst < 1.0e-6);
  CHECK(worst_length < 1.0e-6);
}

template <class Map, class Exec>
void check_direction_round_trip(const Exec& exec) {
  std::vector<vec3> all = directions();
  all.erase(std::remove_if(all.begin(), all.end(), [](vec3 d) { return !Map::covers(d); }), all.end());
  const wfpg::buffer<vec3, Exec> from(exec, all), back(exec, all.size());
  const auto f = from.view(), b = back.view();
  exec.for_each(all.size(), [=] WFPG_HD(std::size_t i) { b[i] = Map::direction(Map::square(f[i])); });
  const std::vector<vec3> returned = back.to_host(exec);
  int far = 0;
  for (std::size_t i = 0; i < all.size(); ++i) far += !(angle_between(all[i], returned[i]) < 2.0e-6);
  CHECK(far == 0);
}

WFPG_TEST_CASE("points of the square round trip through the octahedral map", "[octahedral_map]") {
  check_square_round_trip<sphere>(Exec());
  check_square_round_trip<hemisphere>(Exec());
}

WFPG_TEST_CASE("directions round trip through the octahedral map", "[octahedral_map]") {
  check_direction_round_trip<sphere>(Exec());
  check_direction_round_trip<hemisphere>(Exec());
}

TEST_CASE("poles and edges of the octahedral map have known places", "[octahedral_map]") {
  const auto close = [](vec3 a, vec3 b) { return angle_between(a, b) < 1.0e-6; };
  CHECK(close(wfpg::square_to_sphere({0.5f, 0.5f}), {0, 0, 1}));
  for (const float u : {0.0f, 1.0f})
    for (const float v : {0.0f, 1.0f}) CHECK(close(wfpg::square_to_sphere({u, v}), {0, 0, -1}));
  CHECK(close(wfpg::square_to_sphere({1.0f, 0.5f}), {1, 0, 0}));
  CHECK(close(wfpg::square_to_sphere({0.5f, 0.0f}), {0, -1, 0}));
  CHECK(close(wfpg::square_to_hemisphere({0.5f, 0.5f}), {0, 0, 1}));
  for (int i = 0; i <= 20; ++i) {
    const float t = static_cast<float>(i) / 20.0f;
    CHECK(close(wfpg::square_to_sphere({0.0f, t}), wfpg::square_to_sphere({0.0f, 1.0f - t})));
    CHECK(close(wfpg::square_to_sphere({t, 1.0f}), wfpg::square_to_sphere({1.0f - t, 1.0f})));
    CHECK(std::abs(wfpg::square_to_hemisphere({t, 0.0f}).z) < 1.0e-6f);
    CHECK(std::abs(wfpg::square_to_sphere({0.5f * t, 0.5f + 0.5f * t}).z) < 1.0e-6f);
  }
}

/// Solid angle of a spherical triangle (Van Oosterom & Strackee 1983), signed.
WFPG_HD double solid_angle(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
  return 2.0 *
         std::atan2(glm::dot(a, glm::cross(b, c)), 1.0 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
}

/// Solid angle of a cell of the map, from `steps` points along each of its edges.
template <class Map>
WFPG_HD double cell_area(int x, int y, int size, int steps) {
  const auto on_sphere = [&](double cx, double cy) {
    const vec2 uv(static_cast<float>(cx / size), static_cast<float>(cy / size));
    return glm::normalize(glm::dvec3(Map::direction(uv)));
  };
  const glm::dvec3 middle = on_sphere(x + 0.5, y + 0.5);
  const int corner[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
  double area = 0.0;
  glm::dvec3 before = on_sphere(x, y);
  for (int edge = 0; edge < 4; ++edge)
    for (int step = 1; step <= steps; ++step) {
      const double t = double(step) / steps;
      const glm::dvec3 next = on_sphere(x + corner[edge][0] + t * (corner[edge + 1][0] - corner[edge][0]),
                                        y + corner[edge][1] + t * (corner[edge + 1][1] - corner[edge][1]));
      area += solid_angle(middle, before, next);
      before = next;
    }
  return std::abs(area);
}

/// The largest relative error of any cell's area, and the error of their sum.
template <class Map, class Exec>
void check_areas(const Exec& exec, int size, int steps) {
  const std::size_t cells = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  const wfpg::buffer<double, Exec> areas(exec, cells);
  const auto out = areas.view();
  exec.for_each(cells, [=] WFPG_HD(std::size_t i) {
    out[i] = cell_area<Map>(static_cast<int>(i) % size, static_cast<int>(i) / size, size, steps);
  });
  const double expected = Map::area / static_cast<double>(cells);
  double worst = 0.0, sum = 0.0;
  for (const double area : areas.to_host(exec)) {
    worst = std::max(worst, std::abs(area / expected - 1.0));
    sum += area;
  }
  INFO("grid " << size);
  CHECK(worst < 1.0e-5);
  CHECK(std::abs(sum / Map::area - 1.0) < 1.0e-5);
}

WFPG_TEST_CASE("the octahedral map preserves area to 1e-5", "[octahedral_map]") {
  const Exec exec;
  check_areas<sphere>(exec, 16, 256);
  check_areas<sphere>(exec, 7, 1000);
  check_areas<hemisphere>(exec, 16, 256);
  check_areas<hemisphere>(exec, 7, 1000);
}

/// How many corners two cells share on the sphere.
int shared_corners(int ax, int ay, int bx, int by, int size) {
  int shared = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      const float scale = 1.0f / static_cast<float>(size);
      const vec3 a = wfpg::square_to_sphere(vec2(ax + i % 2, ay + i / 2) * scale);
      const vec3 b = wfpg::square_to_sphere(vec2(bx + j % 2, by + j / 2) * scale);
      shared += angle_between(a, b) < 1.0e-3 ? 1 : 0;
    }
  return shared;
}

struct cell {
  int x, y;
};
cell wrapped(int x, int y, int size) {
  wfpg::wrap_octahedral(x, y, size);
  REQUIRE((x >= 0 && x < size && y >= 0 && y < size));
  return {x, y};
}

TEST_CASE("wrapped cells are neighbours on the sphere", "[octahedral_map]") {
  for (const int size : {2, 4, 5, 8, 16}) {
    int apart = 0, moved = 0, stuck = 0;
    const auto compare = [&](int x, int y, int dx, int dy, int corners) {
      const cell a = wrapped(x, y, size), b = wrapped(x + dx, y + dy, size);
      apart += shared_corners(a.x, a.y, b.x, b.y, size) < corners ? 1 : 0;
    };
    for (int along = 0; along < size; ++along)
      for (int across = -size; across < 2 * size - 1; ++across) {
        compare(across, along, 1, 0, 2);  // each step crosses one edge, inside and outside of the grid
        compare(along, across, 0, 1, 2);
      }
    for (int along = 0; along < size; ++along)
      for (const int outside :
           {-1, size}) {  // outside points do not mirror to the same row, except in the edge's middle
        const int inside = outside < 0 ? 0 : size - 1;
        const bool middle = 2 * along + 1 == size;
        stuck += (wrapped(outside, along, size).y == along) != middle ? 1 : 0;
        stuck += (wrapped(along, outside, size).x == along) != middle ? 1 : 0;
        apart += wrapped(outside, along, size).x != inside || wrapped(along, outside, size).y != inside;
      }
    for (int x = 0; x < size; ++x)
      for (int y = 0; y < size; ++y) {
        const cell same = wrapped(x, y, size);
        moved += same.x != x || same.y != y ? 1 : 0;
        for (const int dx : {-1, 1})
          for (const int dy : {-1, 1}) compare(x, y, dx, dy, 1);
      }
    INFO("grid " << size);
    CHECK(apart == 0);
    CHECK(stuck == 0);
    CHECK(moved == 0);
  }
}

WFPG_TEST_CASE("packed directions are within 0.01 degrees", "[octahedral_map]") {
  const Exec exec;
  std::vector<vec3> all = directions();
  const wfpg::buffer<vec3, Exec> from(exec, all), back(exec, all.size());
  const auto f = from.view(), b = back.view();
  exec.for_each(all.size(),
                [=] WFPG_HD(std::size_t i) { b[i] = wfpg::unpack_direction(wfpg::pack_direction(f[i])); });
  const std::vector<vec3> returned = back.to_host(exec);
  int far = 0, exact = 0, no_units = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double angle = angle_between(all[i], returned[i]);
    far += !(angle < 0.01 * pi / 180.0);
    exact += angle == 0.0;
    no_units += !(std::abs(glm::length(glm::dvec3(returned[i])) - 1.0) < 1.0e-6);
  }
  CHECK(far == 0);
  CHECK(exact < static_cast<int>(all.size()) / 2);
  CHECK(no_units == 0);
}

// With -ffast-math a length may come from the processor's estimate of a reciprocal root.
WFPG_TEST_CASE("packed axes are exact", "[octahedral_map][bits]") {
  for (int i = 0; i < 6; ++i) {
    vec3 axis(0.0f);
    axis[i / 2] = i % 2 == 0 ? 1.0f : -1.0f;
    CHECK(wfpg::unpack_direction(wfpg::pack_direction(axis)) == axis);
  }
}

}  // namespace
