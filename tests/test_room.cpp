// wfpg-room: its integrals against closed forms, and what its methods learn.
#include "distributions.hpp"
#include "support/policies.hpp"
#include "wfpg_method.hpp"

#include <cmath>
#include <vector>

using namespace room;

namespace {

/// Walls that send 2 W/(m² sr) everywhere.
wall_light even_light() {
  wall_light light;
  light.base.fill(2.0f);
  return light;
}
double irradiance(const wall_light& light, const wall_point& place) {
  double sum = 0.0;
  visit_parts(light, place, [&](const visible_part& part) { sum += part.irradiance; });
  return sum;
}

TEST_CASE("room: a ray hits the wall that it leads to", "[room]") {
  for (int from = 0; from < walls; ++from)
    for (int to = 0; to < walls; ++to) {
      if (from == to) continue;
      const wall_point start = point_on(from, {0.3f, 0.6f}), end = point_on(to, {0.2f, 0.9f});
      const wall_point found = hit_from(start, glm::normalize(end.position - start.position));
      CHECK(found.wall == to);
      CHECK(glm::distance(found.position, end.position) < 1e-6f);
      CHECK(glm::dot(normal_of(to), start.position - end.position) > 0.0f);
    }
}

TEST_CASE("room: irradiance is that of closed forms", "[room]") {
  const double pi = 3.14159265358979;
  const wall_point middle = point_on(4, {0.5f, 0.5f});
  CHECK(irradiance(even_light(), middle) == Approx(2.0 * pi).epsilon(1e-4));
  // A disk opposite to a place: E = pi L r² / (r² + h²).
  for (const float radius : {0.01f, 0.3f}) {
    wall_light light;
    light.disks.push_back({point_on(5, {0.5f, 0.5f}), radius, 3.0f});
    const auto square = static_cast<double>(radius * radius);
    CHECK(irradiance(light, middle) == Approx(3.0 * pi * square / (square + 1.0)).epsilon(1e-3));
  }
}

TEST_CASE("room: variances are those of closed forms", "[room]") {
  const std::vector<wall_point> places = make_places(12);
  const variances uniform = measure(even_light(), places, [](std::size_t, vec3) { return 0.5f / wfpg::pi; });
  const variances cosine = measure_cosine(even_light(), places);
  for (std::size_t i = 0; i < places.size(); ++i) {
    CHECK(uniform.alone[i] == Approx(1.0 / 3.0).epsilon(1e-3));
    CHECK(std::abs(cosine.alone[i]) < 1e-3);
    CHECK(std::abs(cosine.half[i]) < 1e-3);
  }
}

TEST_CASE("room: spots bring their share of the irradiance", "[room]") {
  const std::vector<wall_point> places = make_places(12);
  arrangement a = make_arrangement(3);
  set_share(a, places);
  wall_light without = a.light;
  without.disks.resize(a.first_spot);
  double all = 0.0, others = 0.0;
  for (const wall_point& place : places) {
    all += irradiance(a.light, place);
    others += irradiance(without, place);
  }
  CHECK(1.0 - others / all == Approx(a.share).epsilon(1e-4));
  CHECK((a.share > 0.12f && a.share < 0.35f));
}

TEST_CASE("room: designs are densities, and better ones have less variance", "[room]") {
  const std::vector<wall_point> places = make_places(2);
  arrangement a = make_arrangement(2);
  set_share(a, places);
  const settings set;
  const place_parts exact("exact", set, a.light, places);
  const auto variance = [&](const char* design, bool roots) {
    return mean_and_median(measure_design(design, roots, set, exact, a.light, places).at_places.alone).mean;
  };
  const double grid = variance("grid", false);
  for (const char* const design : {"blocks", "quadtree", "caps"})
    for (const bool roots : {false, true}) CHECK(variance(design, roots) < 0.9 * grid);
  CHECK(variance("grid", true) < 0.6 * grid);
  // A grid for all places of a bin is worse than one for each place.
  const place_parts shared("shared", set, a.light, places);
  CHECK(mean_and_median(measure_design("grid", true, set, shared, a.light, places).at_places.alone).mean >
        1.1 * variance("grid", true));
  // The densities of all designs integrate to 1.
  const auto integral = [](const auto& density) {
    constexpr int side = 512;
    double sum = 0.0;
    for (int i = 0; i < side * side; ++i)
      sum += density((vec2(static_cast<float>(i % side), static_cast<float>(i / side)) + 0.5f) / 512.0f);
    return sum * hemisphere / (side * side);
  };
  for (const std::size_t place : {std::size_t(0), std::size_t(1)})
    for (const bool roots : {false, true}) {
      const light_parts parts = exact.of(place);
      for (const char* const design : {"grid", "blocks", "quadtree"}) {
        CAPTURE(design, place, roots);
        const split_grid cells(design_of(design, 24), parts, roots, 0.01);
        CHECK(integral([&](vec2 uv) { return cells.pdf(uv); }) == Approx(1.0).epsilon(0.005));
      }
      const caps_over_grid caps(8, parts, roots, 0.01);
      // Caps at the horizon lose what lies below it.
      CHECK(integral([&](vec2 uv) {
              return caps.pdf({wfpg::square_to_hemisphere(uv), uv, 0.0f, 0.0f});
            }) == Approx(1.0).epsilon(0.02));
    }
}

TEST_CASE("room: recorded paths and the cache hold the light", "[room]") {
  const std::vector<wall_point> places = make_places(6);
  wall_light light = even_light();
  light.disks.push_back({point_on(1, {0.5f, 0.5f}), 0.25f, 20.0f});
  settings set;
  set.samples = 3;
  set.paths = 60000;
  set.slot_resolution = 8;
  set.budget_mib = 4.0;
  // Light from around the disk, and from elsewhere.
  const auto is_near = [&](const wall_point& place, vec3 direction) {
    return glm::distance(hit_from(place, direction).position, light.disks[0].centre.position) < 0.3f;
  };
  for (const char* const source : {"recorded", "cache"}) {
    const place_parts parts(source, set, light, places);
    double found[2] = {0.0, 0.0}, expected[2] = {0.0, 0.0};
    for (std::size_t i = 0; i < places.size(); ++i) {
      const wfpg::frame basis(normal_of(places[i].wall));
      for (const light_part& p : parts.of(i))
        found[is_near(places[i], basis.to_world(p.local))] += static_cast<double>(p.irradiance);
      visit_parts(light, places[i],
                  [&](const visible_part& p) { expected[is_near(places[i], p.direction)] += p.irradiance; });
    }
    INFO(source);
    if (source == std::string("cache")) {
      for (int near = 0; near < 2; ++near) CHECK(found[near] / expected[near] == Approx(1.0).epsilon(0.05));
    } else {
      // A sum over the paths of a bin, of which there are about so many. Their origins are not the place.
      const double scale = 6.0 * 256.0 / (3.0 * 60000.0), all = expected[0] + expected[1];
      CHECK(scale * (found[0] + found[1]) / all == Approx(1.0).epsilon(0.25));
    }
  }
}

TEST_CASE("room: kept fields learn the light, alike in each run", "[room]") {
  const std::vector<wall_point> places = make_places(12);
  wall_light light = even_light();
  light.disks.push_back({point_on(1, {0.3f, 0.4f}), 0.1f, 200.0f});
  settings set;
  set.slot_resolution = 8;
  set.paths = 4000;
  wfpg::kept_guide_options options = wfpg_options(set, places.size());
  options.octree_resolution = 16;
  const variances cosine = measure_cosine(light, places);
  std::vector<double> first;
  for (int run = 0; run < 2; ++run) {
    wfpg_method method(light, options);
    for (std::uint64_t sample = 0; sample < 8; ++sample) method.train(sample);
    std::size_t unguided = 0;
    const variances learnt = method.measure_at(places, unguided);
    CHECK(unguided == 0);
    CHECK(mean_and_median(learnt.half).mean < 0.8 * mean_and_median(cosine.half).mean);
    if (run == 0)
      first = learnt.alone;
    else
      CHECK(learnt.alone == first);
  }
}

}  // namespace
