// Equation 5 on hand-made paths: what the recorder deposits at each vertex, and what it drops.
#include "support/cached_scene.hpp"
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/policies.hpp"

#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/recorded_path.hpp>
#include <wfpg/guides/octree/deposit_paths.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::vec3;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();
const vec3 up(0.0f, 0.0f, 1.0f);

/// Place of a vertex: the centre of the k-th voxel along x. Its normal is up.
WFPG_HD vec3 place(std::uint32_t k) {
  return {static_cast<float>(k) + 0.5f, 0.5f, 0.5f};
}

/// Eight voxels in a row with a recorder. Tests write paths call by call.
template <class Exec>
struct recording {
  cached_scene<Exec> scene;
  wfpg::path_recorder<Exec> recorder;

  recording(std::size_t paths, std::uint32_t max_depth, bool include_emission,
            std::uint32_t fraction_shift = 0)
      : scene(row(), 1000), recorder(scene.exec, {paths, max_depth, include_emission, fraction_shift}) {}

  static wfpg::voxel_fragments<Exec> row() {
    std::vector<voxel_normal> list;
    for (std::uint32_t k = 0; k < 8; ++k) list.push_back({{k, 0, 0}, up, 1.0f});
    return fragments_in_grid<Exec>(list);
  }
  wfpg::path_recorder_view view() const { return recorder.view(); }
  void vertex(std::size_t path, std::uint32_t depth, vec3 position, vec3 toward, vec3 throughput) const {
    const wfpg::path_recorder_view paths = view();
    scene.exec.for_each(
        1, [=] WFPG_HD(std::size_t) { paths.vertex(path, depth, position, toward, throughput); });
  }
  void radiance(std::size_t path, std::uint32_t depth, vec3 rgb) const {
    const wfpg::path_recorder_view paths = view();
    scene.exec.for_each(1, [=] WFPG_HD(std::size_t) { paths.radiance(path, depth, rgb); });
  }
  void emission(std::size_t path, std::uint32_t depth, vec3 rgb) const {
    const wfpg::path_recorder_view paths = view();
    scene.exec.for_each(1, [=] WFPG_HD(std::size_t) { paths.emission(path, depth, rgb); });
  }
  void finish() {
    wfpg::deposit_paths(scene.exec, recorder, scene.view());
    scene.cache.update(scene.exec);
  }
  /// Radiance that leaves voxel k upward. Negative without deposits.
  float leaving(std::uint32_t k, std::uint32_t side = 0) const {
    return scene.radiance(scene.leaf_at(place(k)), side);
  }
  std::uint32_t dropped() const { return recorder.dropped(scene.exec); }
};

/// Records one path that fields learn from. There are 16 fields over the sphere, each of 2 x 2 cells; up is
/// in one of them.
template <class Exec>
struct learning : recording<Exec> {
  static constexpr std::uint32_t fields = 16, cells = 4;

  wfpg::buffer<wfpg::resident_field, Exec> spheres;
  wfpg::detail::value_queue<Exec> queue;

  explicit learning(bool include_emission = true, std::uint32_t max_depth = 4, bool silent_escapes = false)
      : recording<Exec>(1, max_depth, include_emission),
        spheres(this->scene.exec, std::vector<wfpg::resident_field>(fields)),
        queue(this->scene.exec, 100, fields * cells) {
    this->recorder =
        wfpg::path_recorder<Exec>(this->scene.exec, {1, max_depth, include_emission, 0, /*directions=*/true,
                                                     /*waves=*/false, silent_escapes});
  }
  void scatter(std::uint32_t depth, std::uint32_t field, vec3 direction) const {
    const wfpg::path_recorder_view paths = this->view();
    const wfpg::sampled_direction drawn{direction, 1.0f, wfpg::sampling_technique::guide, {}, field};
    this->scene.exec.for_each(1, [=] WFPG_HD(std::size_t) { paths.scatter(0, depth, drawn); });
  }
  void escape(std::uint32_t depth, vec3 throughput) const {
    const wfpg::path_recorder_view paths = this->view();
    this->scene.exec.for_each(1, [=] WFPG_HD(std::size_t) { paths.escape(0, depth, throughput); });
  }
  void finish() {
    this->recorder.close_paths(this->scene.exec);
    const wfpg::learnt_radiance_view learnt{const_view<wfpg::resident_field>(spheres), 2, queue.view()};
    wfpg::deposit_paths(this->scene.exec, this->recorder, this->scene.view(), learnt);
    this->scene.cache.update(this->scene.exec);
    queue.sum(this->scene.exec);
  }
  /// Sum and number of the values that a field has learnt in all cells.
  std::pair<double, std::uint32_t> learnt(std::uint32_t field) const {
    const wfpg::detail::value_queue_view values = queue.view();
    std::pair<double, std::uint32_t> all{0.0, 0};
    for (std::uint32_t cell = 0; cell < cells; ++cell) {
      const std::vector<double> found = evaluate(this->scene.exec, std::size_t(1), [=] WFPG_HD(std::size_t) {
        double sum = 0.0;
        const std::uint32_t n = values.take(field * cells + cell, sum);
        return sum + 1.0e9 * n;
      });
      const double n = std::floor(found[0] / 1.0e9);
      all.first += found[0] - 1.0e9 * n;
      all.second += static_cast<std::uint32_t>(n);
    }
    return all;
  }
};
using values = std::pair<double, std::uint32_t>;

/// Writes a path of vertices at places 0, 1, ... with these throughputs.
template <class Exec>
void write_vertices(const recording<Exec>& r, std::size_t path, const std::vector<vec3>& throughputs) {
  for (std::uint32_t depth = 0; depth < throughputs.size(); ++depth)
    r.vertex(path, depth, place(depth), up, throughputs[depth]);
}

WFPG_TEST_CASE("radiance at a vertex is the later radiance over the throughput", "[path_recorder]") {
  recording<Exec> r(1, 4, true);
  write_vertices(r, 0, {vec3(1.0f), vec3(0.5f), vec3(0.25f)});
  r.radiance(0, 0, vec3(1.0f));
  r.radiance(0, 1, vec3(2.0f));
  r.radiance(0, 2, vec3(3.0f));
  r.radiance(0, 2, vec3(1.0f));
  r.finish();
  CHECK(r.leaving(2) == Approx(4.0f / 0.25f));
  CHECK(r.leaving(1) == Approx(6.0f / 0.5f));
  CHECK(r.leaving(0) == Approx(7.0f));
  CHECK(r.leaving(3) < 0.0f);
  CHECK(r.leaving(0, 1) < 0.0f);
  CHECK(r.dropped() == 0);
}

WFPG_TEST_CASE("colours are divided per channel and reduced to luminance", "[path_recorder]") {
  recording<Exec> r(1, 3, true);
  write_vertices(r, 0, {vec3(1.0f), {0.5f, 0.25f, 0.125f}, {0.5f, 0.0f, 0.125f}});
  r.radiance(0, 1, {1.0f, 2.0f, 3.0f});
  r.radiance(0, 2, {0.5f, 0.0f, 0.25f});
  r.finish();
  CHECK(r.leaving(2) == Approx(wfpg::luminance({1.0f, 0.0f, 2.0f})));  // a zero channel gives none
  CHECK(r.leaving(1) == Approx(wfpg::luminance({1.5f / 0.5f, 2.0f / 0.25f, 3.25f / 0.125f})));
  CHECK(r.leaving(0) == Approx(wfpg::luminance({1.5f, 2.0f, 3.25f})));
  CHECK(r.scene.cache.dropped(r.scene.exec).total() == 0);
}

WFPG_TEST_CASE("emission leaves the emitter if it is included", "[path_recorder]") {
  for (const bool included : {true, false}) {
    recording<Exec> r(1, 4, included);
    write_vertices(r, 0, {vec3(1.0f), vec3(0.5f), vec3(0.25f)});
    r.emission(0, 2, vec3(8.0f));
    r.finish();
    INFO("included " << included);
    CHECK(r.leaving(2) == Approx(included ? 32.0f : 0.0f));
    CHECK(r.leaving(1) == Approx(16.0f));
    CHECK(r.leaving(0) == Approx(8.0f));
    CHECK(r.dropped() == 0);
  }
}

WFPG_TEST_CASE("an emitter that the camera sees is recorded", "[path_recorder]") {
  for (const bool included : {true, false}) {
    recording<Exec> r(1, 4, included);
    write_vertices(r, 0, {vec3(1.0f)});
    r.emission(0, 0, vec3(5.0f));
    r.finish();
    CHECK(r.leaving(0) == Approx(included ? 5.0f : 0.0f));
    CHECK(r.dropped() == 0);
  }
}

WFPG_TEST_CASE("the last vertex scatters the environment's radiance", "[path_recorder]") {
  for (const bool included : {true, false}) {
    recording<Exec> r(2, 2, included);
    write_vertices(r, 0, {vec3(1.0f), vec3(0.5f)});
    r.emission(0, 2, vec3(3.0f));  // the path's length, and the recorder's capacity
    r.emission(1, 0, vec3(7.0f));  // a camera ray into the environment hits nothing
    r.finish();
    CHECK(r.leaving(1) == Approx(6.0f));
    CHECK(r.leaving(0) == Approx(3.0f));
    r.vertex(1, 0, place(5), up, vec3(1.0f));
    r.emission(1, 1, vec3(4.0f));  // after one vertex
    r.finish();
    CHECK(r.leaving(5) == Approx(4.0f));
    CHECK(r.dropped() == 0);
  }
}

WFPG_TEST_CASE("calls out of range are dropped and counted", "[path_recorder]") {
  recording<Exec> r(2, 2, true);
  const auto view = r.view();
  CHECK(view.paths() == 2);
  CHECK(view.max_depth() == 2);
  write_vertices(r, 0, {vec3(1.0f), vec3(1.0f)});
  r.vertex(2, 0, place(4), up, vec3(1.0f));  // no such path
  r.vertex(~std::size_t(0), 0, place(4), up, vec3(1.0f));
  r.vertex(0, 2, place(4), up, vec3(1.0f));  // too deep
  r.vertex(0, 0xffffffffu, place(4), up, vec3(1.0f));
  r.vertex(0, 1, place(4), up, vec3(1.0f));  // recorded already
  CHECK(r.dropped() == 5);
  r.radiance(2, 0, vec3(100.0f));
  r.radiance(0, 2, vec3(100.0f));
  r.radiance(1, 0, vec3(100.0f));  // a vertex that was not recorded
  r.emission(5, 0, vec3(100.0f));
  CHECK(r.dropped() == 9);
  r.emission(1, 1, vec3(100.0f));  // a path without vertices has nothing to learn from
  CHECK(r.dropped() == 9);
  r.radiance(0, 1, vec3(2.0f));
  r.finish();
  CHECK(r.leaving(0) == 2.0f);
  CHECK(r.leaving(1) == 2.0f);
  CHECK(r.leaving(4) < 0.0f);

  recording<Exec> nothing(0, 0, true);
  nothing.vertex(0, 0, place(0), up, vec3(1.0f));
  nothing.emission(0, 0, vec3(1.0f));
  nothing.finish();
  CHECK(nothing.dropped() == 2);
}

WFPG_TEST_CASE("a deposit and a clear both forget the paths", "[path_recorder]") {
  recording<Exec> r(1, 3, true);
  write_vertices(r, 0, {vec3(1.0f), vec3(1.0f)});
  r.radiance(0, 1, vec3(4.0f));
  r.finish();
  write_vertices(r, 0, {vec3(1.0f)});  // the same vertex again, of the next path
  r.radiance(0, 0, vec3(2.0f));
  r.finish();
  CHECK(r.leaving(0) == 3.0f);
  CHECK(r.leaving(1) == 4.0f);
  write_vertices(r, 0, {vec3(1.0f)});
  r.radiance(0, 0, vec3(100.0f));
  r.recorder.clear(r.scene.exec);
  r.finish();
  CHECK(r.leaving(0) == 3.0f);
  CHECK(r.dropped() == 0);
}

TEST_CASE("one run of each group is recorded, another in each sample", "[path_recorder]") {
  constexpr std::size_t paths = 5000;
  constexpr std::uint32_t run = wfpg::recorded_runs::run, samples = 400;
  for (const std::uint32_t shift : {0u, 1u, 3u}) {
    std::vector<std::uint32_t> times(paths, 0);
    for (std::uint32_t sample = 0; sample < samples; ++sample) {
      const wfpg::recorded_runs runs{shift, static_cast<std::uint32_t>(wfpg::hash(7, sample))};
      std::vector<bool> taken(runs.size(paths), false);
      std::size_t wrong = 0;
      for (std::size_t path = 0; path < paths; ++path) {
        std::uint32_t place;
        if (!runs.find(path, place)) continue;
        ++times[path];
        wrong += place >= taken.size() || taken[place] || place / run != path / run >> shift;
        if (place < taken.size()) taken[place] = true;
      }
      CHECK(wrong == 0);
    }
    const double fraction = 1.0 / (1 << shift), mean = samples * fraction;
    const double deviation = std::sqrt(mean * (1.0 - fraction));
    INFO("one of " << (1 << shift));
    for (std::size_t path = 0; path < paths; path += run) {
      const auto count = std::count(times.begin() + std::ptrdiff_t(path),
                                    times.begin() + std::ptrdiff_t(std::min(path + run, paths)), times[path]);
      CHECK(std::size_t(count) == std::min<std::size_t>(run, paths - path));
      CHECK(std::abs(times[path] - mean) <= 5.0 * deviation);
    }
  }
}

TEST_CASE("a rarer part lies in the whole one, and path() is the inverse of find()", "[path_recorder]") {
  constexpr std::size_t paths = 20000;
  for (const std::uint32_t shift : {0u, 2u})
    for (const std::uint32_t rarer : {1u, 3u}) {
      const wfpg::recorded_runs whole{shift, 77u}, part{shift, 77u, rarer};
      CHECK(part.log2_divisor() == shift + rarer);
      std::size_t count = 0, wrong = 0;
      for (std::size_t path = 0; path < paths; ++path) {
        std::uint32_t place, in_whole;
        const bool takes_part = part.find(path, place);
        wrong += part.includes(static_cast<std::uint32_t>(path)) != takes_part;
        if (!takes_part) continue;
        ++count;
        wrong += !whole.find(path, in_whole) || part.path(place) != path || place >= part.size(paths);
        wrong += whole.path(in_whole) != path;
      }
      CHECK(wrong == 0);
      CHECK(part.includes(wfpg::no_path));
      const double expected = double(paths) / double(1u << (shift + rarer));
      CHECK(std::abs(double(count) - expected) <= double(wfpg::recorded_runs::run << (shift + rarer)));
    }
}

WFPG_TEST_CASE("a fraction of the paths is deposited, and the rest counts as not dropped",
               "[path_recorder]") {
  constexpr std::size_t paths = 300;
  recording<Exec> all(paths, 2, true), r(paths, 2, true, 2);
  CHECK(r.recorder.recorded() == 3 * 32);
  CHECK(r.recorder.bytes() < all.recorder.bytes() / 3);
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    r.scene.cache.clear(r.scene.exec);
    r.recorder.begin_sample(r.scene.exec, seed);
    const wfpg::path_recorder_view view = r.view();
    r.scene.exec.for_each(paths, [=] WFPG_HD(std::size_t path) {
      view.vertex(path, 0, place(0), up, vec3(1.0f));
      view.vertex(path, 1, place(1), up, vec3(0.5f));
      view.radiance(path, 0, vec3(static_cast<float>(path)));
      view.emission(path, 1, vec3(static_cast<float>(path)));
    });
    r.finish();
    double sum = 0.0, count = 0.0;
    for (std::size_t path = 0; path < paths; ++path) {
      std::uint32_t recorded;
      if (!wfpg::recorded_runs{2, seed}.find(path, recorded)) continue;
      sum += static_cast<double>(path);
      count += 1.0;
    }
    CHECK(count > 0.0);
    CHECK(r.leaving(0) == Approx(2.0 * sum / count));
    CHECK(r.leaving(1) == Approx(2.0 * sum / count));
    CHECK(r.dropped() == 0);
    r.vertex(paths, 0, place(0), up, vec3(1.0f));  // no such path
    CHECK(r.dropped() == 1);
    r.recorder = wfpg::path_recorder<Exec>(r.scene.exec, {paths, 2, true, 2});
  }
}

WFPG_TEST_CASE("a sample may record no paths, and none counts as dropped", "[path_recorder]") {
  constexpr std::size_t paths = 300;
  recording<Exec> r(paths, 1, true, 2);
  const auto record_all = [&] {
    const wfpg::path_recorder_view view = r.view();
    r.scene.exec.for_each(paths, [=] WFPG_HD(std::size_t path) {
      view.vertex(path, 0, place(0), up, vec3(1.0f));
      view.radiance(path, 0, vec3(3.0f));
    });
  };
  const std::size_t most = r.recorder.recorded(), bytes = r.recorder.bytes();
  record_all();
  r.recorder.begin_sample(r.scene.exec, 7, false);  // also forgets paths that were not deposited
  CHECK(r.recorder.recorded() == 0);
  CHECK(r.recorder.bytes() == bytes);
  record_all();
  r.finish();
  CHECK(r.leaving(0) < 0.0f);  // no data
  CHECK(r.dropped() == 0);
  r.vertex(paths, 0, place(0), up, vec3(1.0f));  // no such path
  CHECK(r.dropped() == 1);

  r.recorder.begin_sample(r.scene.exec, 8);
  CHECK(r.recorder.recorded() == most);
  record_all();
  r.finish();
  CHECK(r.leaving(0) == 3.0f);
  CHECK(r.dropped() == 1);
}

WFPG_TEST_CASE("the cache drops radiance that is not finite", "[path_recorder]") {
  recording<Exec> r(5, 2, true);
  for (std::size_t path = 0; path < 5; ++path) write_vertices(r, path, {vec3(1.0f), vec3(0.5f)});
  r.radiance(0, 1, {nan, 0.0f, 0.0f});
  r.radiance(1, 1, {0.0f, infinity, 0.0f});
  r.radiance(2, 1, vec3(-1.0f));
  r.radiance(3, 1, vec3(1.0f));
  r.finish();
  CHECK(r.scene.cache.dropped(r.scene.exec).invalid == 6);
  CHECK(r.leaving(1) == 1.0f);  // the mean of 2 and 0
  CHECK(r.leaving(0) == 0.5f);
}

/// Writes a path of the given length. Every vertex scatters one unit.
struct write_path {
  wfpg::path_recorder_view paths;
  std::uint32_t length;
  WFPG_HD void operator()(std::size_t path) const {
    const vec3 upward(0.0f, 0.0f, 1.0f);
    float throughput = 1.0f;
    for (std::uint32_t depth = 0; depth < length; ++depth) {
      paths.vertex(path, depth, place(depth), path % 2 ? -upward : upward, vec3(throughput));
      paths.radiance(path, depth, vec3(1.0f));
      throughput *= 0.5f;
    }
  }
};

WFPG_TEST_CASE("kernels record paths in parallel", "[path_recorder]") {
  const std::uint32_t length = 4;
  recording<Exec> r(200, length, true);
  r.scene.exec.for_each(200, write_path{r.view(), length});
  r.finish();
  for (std::uint32_t depth = 0; depth < length; ++depth)
    for (std::uint32_t side = 0; side < 2; ++side)
      CHECK(r.leaving(depth, side) == Approx(float(length - depth) * float(1u << depth)));
  CHECK(r.scene.cache.dropped(r.scene.exec).total() == 0);
  CHECK(r.recorder.bytes() <= 200 * length * 40 + 200 * 4 + 64);
}

WFPG_TEST_CASE("fields learn what leaves the next vertex, and nothing beyond the path", "[path_recorder]") {
  learning<Exec> r;
  write_vertices(r, 0, {vec3(1.0f), vec3(0.5f)});
  r.scatter(1, 3, up);
  r.vertex(0, 2, place(2), up, vec3(0.25f));
  r.scatter(2, 5, -up);  // the path ends there
  r.radiance(0, 2, vec3(1.0f));
  r.radiance(0, 1, vec3(8.0f));
  r.finish();
  CHECK(r.learnt(3) == values{4.0, 1});
  CHECK(r.learnt(5) == values{0.0, 0});  // no call reports what arrives from there
  CHECK(r.learnt(0) == values{0.0, 0});  // vertex 0 had no field
  CHECK(r.leaving(1) == Approx(18.0f));
  CHECK(r.dropped() == 0);
}

/// Two vertices of which the first one's light is told as the path's sum so far, twice, and the second one's
/// emission by itself.
template <class Light>
struct write_totals {
  wfpg::path_recorder_view paths;
  WFPG_HD void operator()(std::size_t path) const {
    paths.vertex(path, 0, place(0), vec3(0.0f, 0.0f, 1.0f), Light(1.0f));
    paths.total(path, 0, Light(2.0f));
    paths.total(path, 0, Light(5.0f));
    paths.vertex(path, 1, place(1), vec3(0.0f, 0.0f, 1.0f), Light(0.5f));
    paths.emission(path, 1, Light(1.0f));
    paths.total(path, 1, Light(7.0f));
    paths.total(path, 1, Light(6.5f));  // rounding: less than before is nothing new
    paths.radiance(path, 1, Light(0.25f));
  }
};

template <class Light, class Exec>
void check_totals() {
  recording<Exec> r(1, 4, true);
  r.scene.exec.for_each(1, write_totals<Light>{r.view()});
  r.finish();
  CHECK(r.leaving(1) == Approx((1.0f + 1.0f + 0.25f) / 0.5f));
  CHECK(r.leaving(0) == Approx(5.0f + 1.0f + 1.0f + 0.25f));
  CHECK(r.dropped() == 0);
}

WFPG_TEST_CASE("a path's total gives a vertex what is new, as colours or as numbers", "[path_recorder]") {
  check_totals<vec3, Exec>();
  check_totals<float, Exec>();
  learning<Exec> r;
  write_vertices(r, 0, {vec3(1.0f)});
  const wfpg::path_recorder_view paths = r.view();
  r.scene.exec.for_each(1, [=] WFPG_HD(std::size_t) {
    paths.scatter(0, 0, vec3(0.0f, 0.0f, 1.0f), 2);
    paths.escape(0, 1, 0.5f);
    paths.emission(0, 1, 3.0f);
  });
  CHECK(r.dropped() == 0);
  r.finish();
  CHECK(r.learnt(2) == values{6.0, 1});
}

WFPG_TEST_CASE("fields learn the environment, dark or not", "[path_recorder]") {
  learning<Exec> r;
  write_vertices(r, 0, {vec3(1.0f)});
  r.scatter(0, 2, up);
  r.escape(1, vec3(0.5f));
  r.emission(0, 1, vec3(3.0f));
  r.finish();
  CHECK(r.learnt(2) == values{6.0, 1});
  CHECK(r.leaving(0) == Approx(3.0f));
  write_vertices(r, 0, {vec3(1.0f)});
  r.scatter(0, 2, up);
  r.escape(1, vec3(0.5f));
  r.finish();
  CHECK(r.learnt(2) == values{0.0, 1});
  CHECK(r.dropped() == 0);
}

WFPG_TEST_CASE("silent escapes: a direction of which nothing is heard found no light", "[path_recorder]") {
  for (const bool silent : {false, true}) {
    INFO("silent " << silent);
    learning<Exec> r(true, 3, silent);
    const values dark{0.0, silent ? 1u : 0u}, nothing{0.0, 0};
    write_vertices(r, 0, {vec3(1.0f), vec3(0.5f)});
    r.radiance(0, 1, vec3(2.0f));
    r.scatter(1, 2, up);
    r.finish();
    CHECK(r.learnt(2) == dark);
    CHECK(r.leaving(1) == Approx(4.0f));
    CHECK(r.leaving(0) == Approx(2.0f));
    r.finish();  // nothing was recorded since
    CHECK(r.learnt(2) == nothing);
    write_vertices(r, 0, {vec3(1.0f)});  // the host ends it before it scatters
    r.finish();
    CHECK(r.learnt(2) == nothing);
    write_vertices(r, 0, {vec3(1.0f), vec3(0.5f), vec3(0.25f)});
    r.scatter(2, 2, up);  // beyond the last depth
    r.finish();
    CHECK(r.learnt(2) == nothing);
    write_vertices(r, 0, {vec3(1.0f)});
    r.scatter(0, 2, up);
    r.escape(1, vec3(0.5f));
    r.emission(0, 1, vec3(3.0f));
    r.finish();
    CHECK(r.learnt(2) == values{6.0, 1});
    CHECK(r.dropped() == 0);
    CHECK(r.scene.cache.dropped(r.scene.exec).total() == 0);
  }
}

WFPG_TEST_CASE("silent escapes: light from beyond the last vertex is heard", "[path_recorder]") {
  for (const bool by_total : {false, true}) {
    INFO("by total() " << by_total);
    learning<Exec> r(true, 4, true);
    const auto brings = [&](float light) {
      const wfpg::path_recorder_view paths = r.view();
      r.scene.exec.for_each(1, [=] WFPG_HD(std::size_t) {
        if (by_total)
          paths.total(0, 1, light);
        else if (light > 0.0f)
          paths.emission(0, 1, light);
      });
    };
    write_vertices(r, 0, {vec3(1.0f)});
    r.scatter(0, 2, up);
    brings(3.0f);  // an emitter without a vertex, or the environment
    r.finish();
    CHECK(r.learnt(2) == values{0.0, 0});
    CHECK(r.leaving(0) == Approx(3.0f));
    write_vertices(r, 0, {vec3(1.0f)});
    r.scatter(0, 2, up);
    brings(0.0f);
    r.finish();
    CHECK(r.learnt(2) == values{0.0, 1});
    write_vertices(r, 0, {vec3(1.0f)});
    r.scatter(0, 1, up);
    brings(3.0f);  // a medium, and then a surface whose direction finds nothing
    r.vertex(0, 2, place(2), up, vec3(0.5f));
    r.scatter(2, 2, up);
    r.finish();
    CHECK(r.learnt(1) == values{0.0, 0});
    CHECK(r.learnt(2) == values{0.0, 1});
    CHECK(r.dropped() == 0);
  }
}

/// A recorded path as numbers, and the z of the direction after its vertex 1.
struct path_in_numbers {
  std::uint32_t vertices, surfaces;
  float z;
};

WFPG_TEST_CASE("the cache gets no deposit for the environment", "[path_recorder]") {
  for (const bool included : {true, false}) {
    learning<Exec> r(included);
    write_vertices(r, 0, {vec3(1.0f), vec3(0.5f), vec3(0.25f)});  // three surfaces
    r.radiance(0, 2, vec3(0.25f));
    r.finish();
    CHECK(r.leaving(2) == Approx(1.0f));
    CHECK(r.leaving(1) == Approx(0.5f));

    write_vertices(r, 0, {vec3(1.0f), vec3(0.5f)});  // two surfaces; the third vertex is the environment
    r.scatter(1, 2, {0.6f, 0.0f, -0.8f});
    r.escape(2, vec3(0.25f));
    r.emission(0, 2, vec3(5.0f));
    const wfpg::path_recorder_view paths = r.view();
    const path_in_numbers path = evaluate(r.scene.exec, [=] WFPG_HD() {
      const wfpg::recorded_path recorded(paths, 0);
      vec3 direction(0.0f);
      const bool has_direction = recorded.has_direction(1, direction);
      return path_in_numbers{recorded.vertices(), recorded.surfaces(), has_direction ? direction.z : 0.0f};
    });
    CHECK(path.vertices == 3);
    CHECK(path.surfaces == 2);
    CHECK(path.z == Approx(-0.8f).epsilon(1e-3));
    r.finish();
    INFO("included " << included);
    CHECK(r.leaving(2) == Approx(1.0f));  // where the third surface was
    CHECK(r.leaving(1) == Approx((0.5f + 5.0f / 0.5f) / 2.0f));
    CHECK(r.leaving(0) == Approx((0.25f + 5.0f) / 2.0f));
    CHECK(r.scene.cache.dropped(r.scene.exec).total() == 0);
    CHECK(r.dropped() == 0);
  }
}

WFPG_TEST_CASE("fields learn no emission if it is left out", "[path_recorder]") {
  learning<Exec> r(false);
  write_vertices(r, 0, {vec3(1.0f)});
  r.scatter(0, 1, up);
  r.vertex(0, 1, place(1), up, vec3(0.5f));
  r.emission(0, 1, vec3(7.0f));
  r.scatter(1, 2, up);
  r.escape(2, vec3(0.25f));
  r.emission(0, 2, vec3(5.0f));
  r.finish();
  CHECK(r.learnt(1) == values{10.0, 1});  // from the environment, scattered by vertex 1
  CHECK(r.learnt(2) == values{0.0, 1});
  CHECK(r.leaving(0) == Approx(12.0f));
}

WFPG_TEST_CASE("a direction teaches nothing where its end is not known", "[path_recorder]") {
  learning<Exec> r;
  write_vertices(r, 0, {vec3(1.0f)});
  r.scatter(0, 2, -up);
  r.emission(0, 1, vec3(3.0f));  // an emitter without a vertex
  r.finish();
  CHECK(r.learnt(2) == values{0.0, 0});
  CHECK(r.leaving(0) == Approx(3.0f));
  write_vertices(r, 0, {vec3(1.0f)});
  r.scatter(0, 2, up);  // into a medium, where the path ends
  const wfpg::path_recorder_view paths = r.view();
  r.scene.exec.for_each(1, [=] WFPG_HD(std::size_t) { paths.total(0, 1, 3.0f); });
  r.finish();
  CHECK(r.learnt(2) == values{0.0, 0});
  CHECK(r.leaving(0) == Approx(3.0f));
  write_vertices(r, 0, {vec3(1.0f)});
  r.scatter(0, 2, up);  // through a medium into the environment
  r.escape(2, vec3(0.5f));
  r.emission(0, 2, vec3(3.0f));
  r.finish();
  CHECK(r.learnt(2) == values{0.0, 0});
  CHECK(r.leaving(0) == Approx(3.0f));
  CHECK(r.dropped() == 0);
}

WFPG_TEST_CASE("depths that are left out teach nothing and lose nothing else", "[path_recorder]") {
  learning<Exec> r(true, 6);
  r.vertex(0, 0, place(0), up, vec3(1.0f));
  r.scatter(0, 1, up);
  r.emission(0, 2, vec3(2.0f));  // light of the medium, at its second vertex
  r.vertex(0, 3, place(3), up, vec3(0.5f));
  r.radiance(0, 3, vec3(1.0f));
  r.scatter(3, 2, up);
  r.vertex(0, 4, place(4), up, vec3(0.25f));
  r.radiance(0, 4, vec3(0.5f));
  r.scatter(4, 3, up);
  const wfpg::path_recorder_view paths = r.view();
  const auto gaps = evaluate(r.scene.exec, 5, [=] WFPG_HD(std::size_t depth) {
    return wfpg::recorded_path(paths, 0).is_gap(static_cast<std::uint32_t>(depth));
  });
  CHECK(std::vector<bool>(gaps.begin(), gaps.end()) == std::vector<bool>{false, true, true, false, false});
  r.finish();
  CHECK(r.leaving(0) == Approx(3.5f));
  CHECK(r.leaving(3) == Approx(1.5f / 0.5f));
  CHECK(r.leaving(4) == Approx(0.5f / 0.25f));
  CHECK(r.leaving(1) < 0.0f);
  CHECK(r.learnt(1) == values{0.0, 0});  // the medium lies between
  CHECK(r.learnt(2) == values{2.0, 1});
  CHECK(r.learnt(3) == values{0.0, 0});  // no more is heard of the path
  CHECK(r.dropped() == 0);
  CHECK(r.recorder.gaps(r.scene.exec) == 1);
  CHECK(r.scene.cache.dropped(r.scene.exec).total() == 0);

  r.vertex(0, 2, place(2), up, vec3(0.5f));  // the branch of a split path
  r.radiance(0, 2, vec3(1.0f));
  r.vertex(0, 2, place(5), up, vec3(0.5f));  // recorded already
  r.finish();
  CHECK(r.leaving(2) == Approx(2.0f));
  CHECK(r.leaving(5) < 0.0f);
  CHECK(r.dropped() == 1);
  CHECK(r.recorder.gaps(r.scene.exec) == 2);
}

WFPG_TEST_CASE("directions out of order are dropped and counted", "[path_recorder]") {
  learning<Exec> r(true, 2);
  r.scatter(0, 1, up);  // no vertex yet
  CHECK(r.dropped() == 1);
  write_vertices(r, 0, {vec3(1.0f), vec3(0.5f)});
  r.scatter(0, 1, up);  // not the last
  CHECK(r.dropped() == 2);
  r.scatter(1, 1, {nan, 0.0f, 0.0f});
  CHECK(r.dropped() == 3);
  r.escape(1, vec3(1.0f));  // there is a surface
  CHECK(r.dropped() == 4);
  r.escape(2, vec3(1.0f));  // beyond the recorded length: legal, but not learnt from
  r.emission(0, 2, vec3(1.0f));
  r.scatter(1, wfpg::no_field, up);
  CHECK(r.dropped() == 4);
  r.finish();
  CHECK(r.learnt(1) == values{0.0, 0});
  CHECK(r.leaving(1) == Approx(2.0f));
}

WFPG_TEST_CASE("a recorder without learning fields ignores directions and escapes", "[path_recorder]") {
  const recording<Exec> r(1, 3, true);
  const wfpg::path_recorder_view paths = r.view();
  r.vertex(0, 0, place(0), up, vec3(1.0f));
  r.scene.exec.for_each(1, [=] WFPG_HD(std::size_t) {
    paths.scatter(0, 0, {up, 1.0f, wfpg::sampling_technique::guide, {}, 0});
    paths.escape(0, 1, vec3(0.5f));
    paths.scatter(9, 9, {up, 1.0f, wfpg::sampling_technique::guide, {}, 0});
  });
  CHECK(r.dropped() == 0);
}

}  // namespace
