// The facade of light from both ends: what it finds, compared with sums over all vertices and beams; counts,
// radii, memory and errors. Light paths here are random points and beams, without a scene.
#include "support/failing_resource.hpp"
#include "support/policies.hpp"

#include <wfpg/light/bidirectional.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

using namespace wfpg_test;
using wfpg::array_view;
using wfpg::bidirectional_options;
using wfpg::bidirectional_statistics;
using wfpg::path_beam;
using wfpg::photon_merge;
using wfpg::vec3;

/// Types in kernels need names, for CUDA compilers.
namespace bidirectional_test {

struct vertex {
  vec3 at;
  float flux;
  bool inside;
  WFPG_HD vec3 position() const { return at; }
  WFPG_HD bool in_medium() const { return inside; }
};
struct photon {
  float flux;
  photon() = default;
  WFPG_HD explicit photon(const vertex& v) : flux(v.flux) {}
};
struct beam {
  path_beam beam;
  float flux;
};

/// Light paths without a scene. All that they do follows from hashes.
struct random_paths {
  std::uint64_t seed;

  WFPG_HD std::uint64_t draw(std::size_t path, std::uint32_t depth, std::uint32_t use) const {
    return wfpg::hash(wfpg::hash(wfpg::hash(seed, path), depth), use);
  }
  /// In [0, 1).
  WFPG_HD float fraction(std::size_t path, std::uint32_t depth, std::uint32_t use) const {
    return static_cast<float>(draw(path, depth, use) >> 40) * 0x1p-24f;
  }
  WFPG_HD vec3 point(std::size_t path, std::uint32_t depth, std::uint32_t use) const {
    return {fraction(path, depth, use), fraction(path, depth, use + 1), fraction(path, depth, use + 2)};
  }
  WFPG_HD bool keeps(std::size_t path, std::uint32_t depth) const { return draw(path, depth, 0) % 3 != 0; }
  WFPG_HD vertex at(std::size_t path, std::uint32_t depth) const {
    return {point(path, depth, 1), 0.5f + fraction(path, depth, 4), draw(path, depth, 5) % 2 == 0};
  }
  /// Of a segment, 0 to 10.
  WFPG_HD std::uint32_t beams(std::size_t path, std::uint32_t depth) const {
    return static_cast<std::uint32_t>(draw(path, depth, 6) % 11);
  }
  WFPG_HD beam beam_of(std::size_t path, std::uint32_t depth, std::uint32_t k) const {
    const std::uint32_t use = 7 + 8 * k;
    const float begin = 0.1f * fraction(path, depth, use + 6);
    return {{point(path, depth, use), glm::normalize(point(path, depth, use + 3) - 0.5f), begin,
             begin + 0.1f + 0.3f * fraction(path, depth, use + 7)},
            0.5f + fraction(path, depth, use + 5)};
  }
};

using recorder = wfpg::light_recorder_view<vertex, beam>;
using gatherer = wfpg::light_gather_view<vertex, photon, beam>;

struct trace {
  random_paths paths;
  std::uint32_t depth;
  recorder record;
  array_view<std::uint32_t> keeps;
  WFPG_HD void operator()(std::size_t path) const {
    keeps[path] = paths.keeps(path, depth) ? 1 : 0;
    for (std::uint32_t k = 0; record.leaves_beams(path) && k < paths.beams(path, depth); ++k)
      record.add_beam(path, paths.beam_of(path, depth, k));
  }
};

struct store {
  random_paths paths;
  std::uint32_t depth;
  recorder record;
  WFPG_HD void operator()(std::size_t path) const {
    if (record.has_place(path)) record.write(path, paths.at(path, depth));
  }
};

/// What is found at a point and along a camera beam: fluxes times scales, and where.
struct sums {
  float on_surface = 0.0f, in_medium = 0.0f, points_along = 0.0f, beams_along = 0.0f;
  float chain = 0.0f;  ///< fluxes of one light path's vertices
};

/// Depends on all that a merge tells. `stored`: the flux that it has in its store.
WFPG_HD inline float term(float flux, const photon_merge& at, float stored) {
  return stored * flux * at.scale * (1.0f + at.t_camera + 2.0f * at.t_light) * at.sine;
}

struct look {
  gatherer gather;
  array_view<const vec3> points;
  array_view<const path_beam> cameras;
  array_view<sums> found;
  WFPG_HD void operator()(std::size_t i) const {
    sums s;
    const auto add_point = [&](float& sum, const photon& light, const photon_merge& at) {
      sum += term(light.flux, at, gather.vertices()[at.index].flux);
    };
    gather.merge_on_surface(
        points[i], [&](const photon& light, const photon_merge& at) { add_point(s.on_surface, light, at); });
    gather.merge_in_medium(
        points[i], [&](const photon& light, const photon_merge& at) { add_point(s.in_medium, light, at); });
    gather.merge_points_along(cameras[i], [&](const photon& light, const photon_merge& at) {
      add_point(s.points_along, light, at);
    });
    gather.merge_beams_along(cameras[i], [&](const beam& light, const photon_merge& at) {
      s.beams_along += term(light.flux, at, gather.beams()[at.index].flux);
    });
    const auto& vertices = gather.vertices();
    if (vertices.paths() > 0)
      for (std::uint32_t k = vertices.last(i); k != vertices.none; k = vertices.previous(k))
        s.chain += vertices[k].flux;
    found[i] = s;
  }
};

}  // namespace bidirectional_test

namespace {

using namespace bidirectional_test;

constexpr std::size_t light_paths = 600, beam_paths = 40, queries = 200;
constexpr std::uint32_t depths = 4;

template <class Exec>
using light_of = wfpg::bidirectional<Exec, vertex, photon, beam>;

/// All techniques, radii large enough for some merges a query.
bidirectional_options all_techniques() {
  bidirectional_options options;
  options.paths = light_paths;
  options.max_vertices = depths;
  options.max_beams = 64;
  options.volume_points = options.beam_points = options.beams = true;
  options.surface_radius = 0.15f;
  options.volume_radius = 0.1f;
  options.beam_paths = beam_paths;
  return options;
}

template <class Exec>
void follow(const Exec& exec, light_of<Exec>& light, const random_paths& paths) {
  const wfpg::buffer<std::uint32_t, Exec> keeps(exec, light.options().paths);
  for (std::uint32_t depth = 0; depth < depths; ++depth) {
    exec.for_each(keeps.size(), trace{paths, depth, light.light_recorder(), keeps.view()});
    light.reserve(keeps.view());
    exec.for_each(keeps.size(), store{paths, depth, light.light_recorder()});
  }
}

/// Where camera paths look.
struct asked {
  std::vector<vec3> points;
  std::vector<path_beam> cameras;

  asked() {
    random_numbers random(17);
    for (std::size_t i = 0; i < queries; ++i) {
      points.push_back(random.point(0.0f, 1.0f));
      cameras.push_back({random.point(0.0f, 1.0f), random.direction(), 0.05f, 0.6f});
    }
  }
};

template <class Exec>
std::vector<sums> found_by(const Exec& exec, light_of<Exec>& light) {
  const asked where;
  const wfpg::buffer<vec3, Exec> points(exec, where.points);
  const wfpg::buffer<path_beam, Exec> cameras(exec, where.cameras);
  const wfpg::buffer<sums, Exec> found(exec, queries);
  exec.for_each(queries, look{light.gather(), points.view(), cameras.view(), found.view()});
  return found.to_host(exec);
}

/// What a test of each vertex and beam finds.
std::vector<sums> expected(const random_paths& paths, const bidirectional_statistics& s,
                           std::uint32_t segment_beams) {
  const asked where;
  std::vector<sums> all(queries);
  for (std::size_t i = 0; i < queries; ++i) {
    const auto count = static_cast<float>(light_paths);
    const auto add = [&](float& sum, float flux, const wfpg::merge_geometry& at, float number) {
      if (at.kernel > 0.0f)
        sum += term(flux, {at.kernel / (number * at.sine), at.t_camera, at.t_light, at.sine, 0}, flux);
    };
    for (std::size_t path = 0; path < light_paths; ++path)
      for (std::uint32_t depth = 0; depth < depths; ++depth) {
        using wfpg::merge_kernel;
        if (paths.keeps(path, depth)) {
          const vertex v = paths.at(path, depth);
          const auto constant = merge_kernel::constant, smooth = merge_kernel::epanechnikov;
          const vec3 p = where.points[i];
          if (v.inside) {
            add(all[i].in_medium, v.flux, wfpg::point_merge<3>(constant, p, v.at, s.radii.volume), count);
            add(all[i].points_along, v.flux,
                wfpg::beam_point_merge(smooth, where.cameras[i], v.at, s.radii.beam_points), count);
          } else {
            add(all[i].on_surface, v.flux, wfpg::point_merge<2>(constant, p, v.at, s.radii.surface), count);
          }
          if (path == i) all[i].chain += v.flux;
        }
        for (std::uint32_t k = 0; path < beam_paths && k < paths.beams(path, depth) && k < segment_beams;
             ++k) {
          const beam b = paths.beam_of(path, depth, k);
          add(all[i].beams_along, b.flux,
              wfpg::beam_beam_merge(merge_kernel::epanechnikov, where.cameras[i], b.beam, s.radii.beams),
              static_cast<float>(beam_paths));
        }
      }
  }
  return all;
}

/// The sum of one member over queries, and whether each agrees. Distances at the radius round either way: a
/// query may differ by a photon.
void check_member(const std::vector<sums>& found, const std::vector<sums>& exact, float sums::*member) {
  double sum = 0.0, whole = 0.0;
  std::size_t differ = 0, merged = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    sum += double(found[i].*member);
    whole += double(exact[i].*member);
    differ += std::abs(found[i].*member - exact[i].*member) > 1e-4f * std::abs(exact[i].*member) ? 1 : 0;
    merged += exact[i].*member != 0.0f ? 1 : 0;
  }
  CHECK(merged > found.size() / 4);
  CHECK(differ <= 1);
  CHECK(sum == Approx(whole).epsilon(1e-3));
}

void check(const std::vector<sums>& found, const std::vector<sums>& exact) {
  for (const auto member :
       {&sums::on_surface, &sums::in_medium, &sums::points_along, &sums::beams_along, &sums::chain})
    check_member(found, exact, member);
}

bool are_empty(const std::vector<sums>& found) {
  for (const sums& s : found)
    if (s.on_surface != 0.0f || s.in_medium != 0.0f || s.points_along != 0.0f || s.beams_along != 0.0f)
      return false;
  return true;
}

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

struct ask_for_places {
  recorder record;
  array_view<std::uint32_t> found;
  WFPG_HD void operator()(std::size_t path) const { found[path] = record.has_place(path) ? 1 : 0; }
};

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
  std::uint32_t vertices = 0, inside = 0, beams = 0, beyond = 0;
  const random_paths paths{3};
  const auto most = bidirectional_options().segment_beams;
  for (std::size_t path = 0; path < light_paths; ++path)
    for (std::uint32_t depth = 0; depth < depths; ++depth) {
      vertices += paths.keeps(path, depth) ? 1 : 0;
      inside += paths.keeps(path, depth) && paths.at(path, depth).inside ? 1 : 0;
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
  CHECK(s.beam_point_photons == inside);
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
    CHECK(double(t.beam_points) == Approx(n * pi * std::pow(double(s.radii.beam_points), 2.0)));
    CHECK(double(t.beams) == Approx(beam_paths * 2.0 * double(s.radii.beams)));
  }
  CHECK(bidirectional_options().count_beam_paths() == 0);
  options.beam_paths.reset();
  CHECK(options.count_beam_paths() == (light_paths + 63) / 64);
  options.paths = std::size_t(1) << 24;
  CHECK(options.count_beam_paths() == 8192);
  options.beam_paths = std::size_t(1) << 30;
  CHECK(options.count_beam_paths() == options.paths);
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
