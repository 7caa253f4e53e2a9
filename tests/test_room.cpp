// wfpg-room: its integrals against closed forms, and what its methods learn.
#include "exact_cells.hpp"
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
  const variances cosine = measure(even_light(), places, [&](std::size_t i, vec3 direction) {
    return glm::dot(direction, normal_of(places[i].wall)) / wfpg::pi;
  });
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

TEST_CASE("room: finer exact cells have less variance, and roots of mean squares the least", "[room]") {
  const std::vector<wall_point> places = make_places(3);
  arrangement a = make_arrangement(2);
  set_share(a, places);
  settings set;
  double before = 1e30;
  for (const std::uint32_t resolution : {6u, 12u, 24u}) {
    set.resolution = resolution;
    const mean_and_median means(measure_exact(cell_target::mean, set, a.light, places).at_places.alone);
    const mean_and_median roots(
        measure_exact(cell_target::root_of_mean_square, set, a.light, places).at_places.alone);
    CHECK(means.mean < 0.7 * before);
    CHECK(roots.mean < 0.7 * means.mean);
    before = means.mean;
  }
}

TEST_CASE("room: kept fields learn the light, alike in each run", "[room]") {
  const std::vector<wall_point> places = make_places(12);
  wall_light light = even_light();
  light.disks.push_back({point_on(1, {0.3f, 0.4f}), 0.1f, 200.0f});
  wfpg::kept_guide_options options;
  options.octree_resolution = 16;
  options.kept.resolution = 8;
  options.max_paths = 4000;
  options.max_depth = 2;
  options.least_gain = 0.0f;
  const variances cosine = measure(light, places, [&](std::size_t i, vec3 direction) {
    return glm::dot(direction, normal_of(places[i].wall)) / wfpg::pi;
  });
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
