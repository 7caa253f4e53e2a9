// The facade of light from both ends: what it finds, compared with sums over all vertices and beams; counts,
// radii, memory and errors. Light paths here are random points and beams, without a scene.
#include "support/failing_resource.hpp"
#include "support/policies.hpp"
#include "support/random_light_paths.hpp"
#include "support/sample_means.hpp"

#include <wfpg/light/bidirectional.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

using namespace wfpg_test;

namespace {

using namespace bidirectional_test;

WFPG_TEST_CASE("an iteration finds what its light paths have left", "[bidirectional]") {
  const Exec exec;
  light_of<Exec> light(exec, all_techniques());
  for (const std::uint32_t iteration : {1u, 2u, 5u}) {
    INFO("iteration " << iteration);
    light.begin_iteration(iteration, 1.0f);
    const random_paths paths{iteration};
    follow(exec, light, paths);
    light.build();
    check(found_by(exec, light), expected(paths, light.statistics(), light.options().segment_beams));
  }
}

TEST_CASE("merges with some of the dense photons have the mean of merges with all", "[bidirectional]") {
  const one_policy exec;
  bidirectional_options options = all_techniques();
  options.radius_alpha = 1.0f;
  light_of<one_policy> all(exec, options);
  options.dense_photons = 7;
  light_of<one_policy> some(exec, options);
  const random_paths paths{3};
  const auto find = [&](light_of<one_policy>& light, std::uint32_t iteration) {
    light.begin_iteration(iteration, 1.0f);
    follow(exec, light, paths);
    light.build();
    sums whole;
    for (const sums& s : found_by(exec, light)) {
      whole.on_surface += s.on_surface;
      whole.in_medium += s.in_medium;
      whole.points_along += s.points_along;
    }
    return whole;
  };
  const sums exact = find(all, 1);
  wfpg::testing::sample_mean on_surface, in_medium;
  for (std::uint32_t iteration = 1; iteration <= 500; ++iteration) {
    const sums found = find(some, iteration);
    on_surface.add(double(found.on_surface) / double(exact.on_surface));
    in_medium.add(double(found.in_medium) / double(exact.in_medium));
    CHECK(found.points_along == exact.points_along);
  }
  CHECK(has_mean(on_surface, 1.0));
  CHECK(has_mean(in_medium, 1.0));
  const bidirectional_statistics kept = some.statistics(), before = all.statistics();
  CHECK(kept.surface_photons < before.surface_photons);
  CHECK(kept.beam_point_photons == before.beam_point_photons);
}

WFPG_TEST_CASE("nothing is merged before maps are built", "[bidirectional]") {
  const Exec exec;
  light_of<Exec> light(exec, all_techniques());
  CHECK(are_empty(found_by(exec, light)));
  follow(exec, light, {1});
  CHECK(are_empty(found_by(exec, light)));
  light.build();
  CHECK_FALSE(are_empty(found_by(exec, light)));
  light.begin_iteration(2, 1.0f);
  const std::vector<sums> found = found_by(exec, light);
  CHECK(are_empty(found));
  for (const sums& s : found) CHECK(s.chain == 0.0f);
}

WFPG_TEST_CASE("paths have no places before places are found for them", "[bidirectional]") {
  const Exec exec;
  light_of<Exec> light(exec, all_techniques());
  const auto places = [&] {
    const wfpg::buffer<std::uint32_t, Exec> found(exec, light_paths);
    exec.for_each(light_paths, ask_for_places{light.light_recorder(), found.view()});
    std::uint32_t sum = 0;
    for (const std::uint32_t one : found.to_host(exec)) sum += one;
    return sum;
  };
  CHECK(places() == 0);
  follow(exec, light, {1});
  CHECK(places() > 0);  // those of the last depth
  light.begin_iteration(2, 1.0f);
  CHECK(places() == 0);
}

WFPG_TEST_CASE("beams of the last segment are stored with the maps", "[bidirectional]") {
  const Exec exec;
  light_of<Exec> light(exec, all_techniques());
  const random_paths paths{4};
  const wfpg::buffer<std::uint32_t, Exec> keeps(exec, light_paths);
  exec.for_each(light_paths, trace{paths, 0, light.light_recorder(), keeps.view()});
  light.build();
  std::uint32_t beams = 0;
  for (std::size_t path = 0; path < beam_paths; ++path) {
    const std::uint32_t left = paths.beams(path, 0), most = light.options().segment_beams;
    beams += left < most ? left : most;
  }
  CHECK(light.statistics().beams == beams);
  CHECK(light.statistics().beam_pieces >= beams);
}

WFPG_TEST_CASE("radii too small for floats keep scales finite", "[bidirectional]") {
  const Exec exec;
  light_of<Exec> light(exec, all_techniques());
  light.begin_iteration(1, 1e-30f);
  follow(exec, light, {1});
  light.build();
  const wfpg::path_techniques& t = light.techniques();
  for (const float volume : {t.surface_points, t.volume_points, t.beam_points, t.beams}) {
    CHECK(volume > 0.0f);
    CHECK(std::isfinite(1.0f / volume));
  }
  CHECK(are_empty(found_by(exec, light)));
}

WFPG_TEST_CASE("photons, beams and what had no memory are counted", "[bidirectional]") {
  const Exec exec;
  std::uint32_t vertices = 0, inside = 0, along = 0, beams = 0, beyond = 0;
  const random_paths paths{3};
  const auto most = bidirectional_options().segment_beams;
  for (std::size_t path = 0; path < light_paths; ++path)
    for (std::uint32_t depth = 0; depth < depths; ++depth) {
      vertices += paths.keeps(path, depth) ? 1 : 0;
      const bool is_inside = paths.keeps(path, depth) && paths.at(path, depth).inside;
      inside += is_inside ? 1 : 0;
      along += is_inside && path < beam_point_paths ? 1 : 0;
      if (path >= beam_paths) continue;
      const std::uint32_t left = paths.beams(path, depth);
      beams += left < most ? left : most;
      beyond += left < most ? 0 : left - most;
    }
  REQUIRE(beyond > 0);

  bidirectional_options options = all_techniques();
  light_of<Exec> light(exec, options);
  follow(exec, light, paths);
  light.build();
  const bidirectional_statistics s = light.statistics();
  CHECK(s.vertices == vertices);
  CHECK(s.dropped_vertices == 0);
  CHECK(s.beams == beams);
  CHECK(s.dropped_beams == 0);
  CHECK(s.surplus_beams == beyond);
  CHECK(s.surface_photons == vertices - inside);
  CHECK(s.volume_photons == inside);
  CHECK(s.beam_point_photons == along);
  CHECK(along < inside);
  CHECK(s.beam_pieces >= beams);

  const std::size_t room = 100;
  options.budget_bytes = room * (sizeof(vertex) + 2 * sizeof(std::uint32_t));
  light_of<Exec> small(exec, options);
  follow(exec, small, paths);
  small.build();
  const bidirectional_statistics few = small.statistics();
  CHECK(few.vertices == room);
  CHECK(few.dropped_vertices == vertices - room);
  CHECK(few.beams + few.dropped_beams == beams);
  CHECK(few.surplus_beams == beyond);
  CHECK(few.beams == options.budget_bytes / (sizeof(beam) + 2 * sizeof(std::uint32_t)));
  CHECK(few.surface_photons + few.volume_photons == room);
  CHECK(small.memory().vertices < light.memory().vertices);
  CHECK(small.memory().total() == small.memory().vertices + small.memory().beams + small.memory().maps);

  small.begin_iteration(2, 1.0f);
  const bidirectional_statistics none = small.statistics();
  CHECK(none.vertices + none.dropped_vertices + none.beams + none.dropped_beams + none.surplus_beams == 0);
  CHECK(none.surface_photons + none.volume_photons + none.beam_pieces == 0);
}

TEST_CASE("counts of techniques follow from radii and numbers of paths", "[bidirectional]") {
  const one_policy exec;
  bidirectional_options options = all_techniques();
  options.radius_alpha = 0.5f;
  light_of<one_policy> light(exec, options);
  for (const std::uint32_t iteration : {1u, 16u}) {
    const float size = 3.0f;
    light.begin_iteration(iteration, size);
    const bidirectional_statistics s = light.statistics();
    const double shrunk = std::log(double(iteration)) * -0.5;  // of the area, the volume, the length
    CHECK(double(s.radii.surface) == Approx(0.15 * 3.0 * std::exp(shrunk / 2.0)));
    CHECK(double(s.radii.volume) == Approx(0.1 * 3.0 * std::exp(shrunk / 3.0)));
    CHECK(double(s.radii.beam_points) == Approx(0.1 * 3.0 * std::exp(shrunk / 2.0)));
    CHECK(double(s.radii.beams) == Approx(0.1 * 3.0 * std::exp(shrunk)));
    const wfpg::path_techniques& t = light.techniques();
    const double pi = 3.14159265358979, n = light_paths;
    CHECK(t.light_hits == 1.0f);
    CHECK(t.next_event == 1.0f);
    CHECK(t.connections == 1.0f);
    CHECK(double(t.splats) == n);
    CHECK(double(t.surface_points) == Approx(n * pi * std::pow(double(s.radii.surface), 2.0)));
    CHECK(double(t.volume_points) == Approx(n * pi * 4.0 / 3.0 * std::pow(double(s.radii.volume), 3.0)));
    CHECK(double(t.beam_points) ==
          Approx(beam_point_paths * pi * std::pow(double(s.radii.beam_points), 2.0)));
    CHECK(double(t.beams) == Approx(beam_paths * 2.0 * double(s.radii.beams)));
  }
  CHECK(bidirectional_options().count_beam_paths() == 0);
  CHECK(bidirectional_options().count_beam_point_paths() == 0);
  options.beam_paths.reset();
  options.beam_point_paths.reset();
  CHECK(options.count_beam_paths() == (light_paths + 63) / 64);
  CHECK(options.count_beam_point_paths() == light_paths);
  options.paths = std::size_t(1) << 24;
  CHECK(options.count_beam_paths() == 512);
  CHECK(options.count_beam_point_paths() == 16384);
  options.beam_paths = options.beam_point_paths = std::size_t(1) << 30;
  CHECK(options.count_beam_paths() == options.paths);
  CHECK(options.count_beam_point_paths() == options.paths);
}

WFPG_TEST_CASE("techniques that are off find nothing, count nothing and take no memory", "[bidirectional]") {
  const Exec exec;
  bidirectional_options options = all_techniques();
  options.light_hits = options.next_event = options.connections = options.splats = false;
  options.surface_points = options.volume_points = options.beam_points = options.beams = false;
  light_of<Exec> light(exec, options);
  follow(exec, light, {1});
  light.build();
  CHECK(are_empty(found_by(exec, light)));
  CHECK(light.memory().maps == 0);
  CHECK(light.memory().vertices < 64);
  CHECK(light.memory().beams < 64);
  CHECK_FALSE(light.light_recorder().stores_vertices());
  const wfpg::path_techniques& t = light.techniques();
  CHECK(t.light_hits + t.next_event + t.connections + t.splats == 0.0f);
  CHECK(t.surface_points + t.volume_points + t.beam_points + t.beams == 0.0f);

  options.beam_points = true;
  light_of<Exec> one(exec, options);
  follow(exec, one, {1});
  one.build();
  const std::vector<sums> found = found_by(exec, one);
  float along = 0.0f, others = 0.0f;
  for (const sums& s : found) {
    along += s.points_along;
    others += s.on_surface + s.in_medium + s.beams_along;
  }
  CHECK(along > 0.0f);
  CHECK(others == 0.0f);
}

WFPG_TEST_CASE("vertices are stored for splats alone where splats are made of them", "[bidirectional]") {
  const Exec exec;
  bidirectional_options options = all_techniques();
  options.connections = options.surface_points = options.volume_points = options.beam_points = false;
  for (const bool splats : {false, true})
    for (const bool stored : {false, true}) {
      options.splats = splats;
      options.stored_splats = stored;
      light_of<Exec> light(exec, options);
      follow(exec, light, {1});
      const bool are_stored = splats && stored;
      CHECK(light.light_recorder().stores_vertices() == are_stored);
      CHECK((light.statistics().vertices > 0) == are_stored);
    }
}

TEST_CASE("options and iterations out of range are refused by their names", "[bidirectional]") {
  using light = light_of<one_policy>;
  const one_policy exec;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refuses = [&](const char* name, const auto& change) {
    bidirectional_options options = all_techniques();
    change(options);
    CHECK_THROWS_WITH(light(exec, options), WFPG_TEST_CONTAINS(name));
    CHECK_THROWS_AS(light(exec, options), std::invalid_argument);
  };
  refuses("bidirectional_options.paths", [](bidirectional_options& o) { o.paths = 0; });
  refuses("bidirectional_options.paths", [](bidirectional_options& o) { o.paths = 0xffffffffu; });
  refuses("max_vertices", [](bidirectional_options& o) { o.max_vertices = 0; });
  refuses("max_beams", [](bidirectional_options& o) { o.max_beams = 0; });
  refuses("segment_beams", [](bidirectional_options& o) { o.segment_beams = 0; });
  refuses("bidirectional_options.beam_paths", [](bidirectional_options& o) { o.beam_paths = 0; });
  refuses("beam_point_paths", [](bidirectional_options& o) { o.beam_point_paths = 0; });
  refuses("dense_photons", [](bidirectional_options& o) { o.dense_photons = 0; });
  refuses("bidirectional_options.budget_bytes", [](bidirectional_options& o) { o.budget_bytes = 7; });
  for (const float wrong : {0.0f, -1.0f, 1.1f, nan}) {
    refuses("surface_radius", [&](bidirectional_options& o) { o.surface_radius = wrong; });
    refuses("volume_radius", [&](bidirectional_options& o) { o.volume_radius = wrong; });
    refuses("radius_alpha", [&](bidirectional_options& o) { o.radius_alpha = wrong; });
  }
  light made(exec, all_techniques());
  CHECK_THROWS_WITH(made.begin_iteration(0, 1.0f), WFPG_TEST_CONTAINS("iteration"));
  for (const float wrong : {0.0f, -1.0f, nan, 2e9f})
    CHECK_THROWS_WITH(made.begin_iteration(1, wrong), WFPG_TEST_CONTAINS("scene_radius"));
  bidirectional_options no_merges = all_techniques();
  no_merges.surface_points = no_merges.volume_points = no_merges.beam_points = no_merges.beams = false;
  CHECK_NOTHROW(light(exec, no_merges).begin_iteration(1, 1e14f));
  using without_beams = wfpg::bidirectional<one_policy, vertex, photon>;
  CHECK_THROWS_WITH(without_beams(exec, all_techniques()),
                    WFPG_TEST_CONTAINS("bidirectional_options.beams is true"));
}

WFPG_TEST_CASE("each allocation of an iteration may fail, and the next iteration goes on",
               "[bidirectional]") {
  failing_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const std::size_t failures = fail_at_each(resource, [&] {
    light_of<Exec> light(exec, all_techniques());
    follow(exec, light, {1});
    light.build();
  });
  CHECK(failures > 30);
  CHECK(resource.live() == 0);

  resource.fail_at(0);
  light_of<Exec> light(exec, all_techniques());
  follow(exec, light, {1});
  resource.fail_at(3);
  CHECK_THROWS_AS(light.build(), wfpg::out_of_memory);
  CHECK(are_empty(found_by(Exec(), light)));
  resource.fail_at(0);
  light.begin_iteration(2, 1.0f);
  follow(exec, light, {2});
  light.build();
  check(found_by(Exec(), light), expected({2}, light.statistics(), light.options().segment_beams));
}

}  // namespace
