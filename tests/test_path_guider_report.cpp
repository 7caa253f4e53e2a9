// What a guider reports of itself, and what it allocates from its memory resource.
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::guiding_mode;

namespace {

/// Memory that a guider may keep across samples.
template <class Exec>
std::size_t most_persistent(const octree_guider<Exec>& guider) {
  const std::size_t nodes = guider.guide().octree().node_count(),
                    leaves = guider.guide().octree().leaf_count();
  const bool kept = guider.options().fields == field_lifetime::kept;
  return 28 * nodes + (std::size_t(128) << 10) +
         (kept ? guider.options().kept.budget_bytes + 4 * (nodes + leaves) : 0);
}

WFPG_TEST_CASE("path guider: memory() is what it allocated, by part", "[path_guider]") {
  counting_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  for (field_lifetime lifetime : lifetimes) {
    const box_mesh<Exec> mesh(exec);
    guider_options options = tracing_options(300, guiding_mode::oriented, lifetime);
    options.octree_resolution = 64;
    const std::size_t mesh_bytes = resource.bytes_in_use;
    octree_guider<Exec> guider(exec, mesh.view(), options);
    for (int round = 0; round < 3; ++round) {
      const wfpg::memory_report memory = guider.memory();
      CHECK(memory.persistent() + memory.transient() == resource.bytes_in_use - mesh_bytes);
      std::set<std::string> names;
      for (const wfpg::memory_part& part : memory.parts) names.insert(part.name);
      std::set<std::string> expected{"octree",  "cache",  "lights",  "deposits",      "paths",
                                     "binning", "fields", "scratch", "compared paths"};
      if (lifetime == field_lifetime::kept) expected.insert({"kept fields", "levels"});
      CHECK(names == expected);
      CHECK(memory.persistent() <= most_persistent(guider));
      for (const wfpg::memory_part& part : memory.parts) {
        if (part.name == std::string("paths")) CHECK(part.bytes <= 300 * 3 * 49 + 300 * 4 + 64);
        if (part.name == std::string("kept fields")) CHECK(part.bytes > 0);
      }
      trace_paths(exec, guider, 1, 300, box_caster{});
    }
  }
  CHECK(resource.bytes_in_use == 0);
}

template <class Exec>
std::size_t bytes_of(const octree_guider<Exec>& guider, const std::string& name) {
  for (const wfpg::memory_part& part : guider.memory().parts)
    if (part.name == name) return part.bytes;
  return 0;
}

WFPG_TEST_CASE("path guider: recording memory is bounded by the leaves, not by the paths", "[path_guider]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  for (const std::size_t paths : {std::size_t(300), std::size_t(20000), std::size_t(200000)}) {
    guider_options options = tracing_options(paths);
    options.octree_resolution = 8;
    const octree_guider<Exec> some(exec, mesh.view(), options);
    options.deposits_per_leaf.reset();
    const octree_guider<Exec> all(exec, mesh.view(), options);
    const std::size_t wanted = 16 * some.guide().octree().leaf_count() / 3;  // paths of 3 vertices
    const std::size_t a_path = 3 * 49 + 4;
    INFO(paths << " paths, " << wanted << " wanted");
    CHECK(bytes_of(all, "paths") >= paths * a_path);
    CHECK(bytes_of(some, "paths") >= std::min(paths, wanted) * a_path);
    CHECK(bytes_of(some, "paths") <= std::min(paths, 2 * wanted + 64) * a_path + 64);
    CHECK(bytes_of(some, "deposits") <= bytes_of(all, "deposits"));
  }
}

/// Mean radiance of all surfaces after 12 samples of 4,096 paths.
template <class Exec>
float learned_radiance(std::uint32_t deposits_per_leaf) {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  guider_options options = tracing_options(4096);
  options.octree_resolution = 4;
  options.deposits_per_leaf = unless_zero(deposits_per_leaf);
  options.unguided_samples = 100;
  octree_guider<Exec> guider(exec, mesh.view(), options);
  trace_paths(exec, guider, 12, 4096, box_caster{});
  CHECK(guider.statistics().deposits.total() == 0);
  const wfpg::exitance_cache_view cache = guider.guide().cache();
  return evaluate(exec, [=] WFPG_HD { return cache.radiance(0, 0); });
}

WFPG_TEST_CASE("path guider: a fraction of the paths gives about the means of all", "[path_guider]") {
  const float all = learned_radiance<Exec>(0), some = learned_radiance<Exec>(32);
  CHECK(all > 0.0f);
  CHECK(some != all);
  CHECK(std::abs(some - all) < 0.1f * all);
}

/// A guider after 32 empty samples. Its octree is so small that it records few paths.
template <class Exec>
struct warmed_up_guider {
  static constexpr std::size_t paths = 2048;

  Exec exec;
  box_mesh<Exec> mesh{exec};
  octree_guider<Exec> guider;

  explicit warmed_up_guider(std::size_t deposit_capacity)
      : guider(exec, mesh.view(), options(deposit_capacity)) {
    REQUIRE(guider.guide().recording().sample_stride == 4);
    for (int sample = 0; sample < 32; ++sample) {
      guider.begin_sample();
      guider.end_sample();
    }
  }

  static guider_options options(std::size_t deposit_capacity) {
    guider_options options = tracing_options(paths);
    options.octree_resolution = 2;
    options.deposits_per_leaf = 256;
    options.deposit_capacity = unless_zero(deposit_capacity);
    return options;
  }
  float radiance() const {
    const wfpg::exitance_cache_view cache = guider.guide().cache();
    return evaluate(exec, [=] WFPG_HD { return cache.radiance(0, 0); });
  }
};

WFPG_TEST_CASE("path guider: after warm-up one sample in four is recorded", "[path_guider]") {
  warmed_up_guider<Exec> warmed_up(0);
  std::uint64_t sample = 33;
  for (int round = 0; round < 4; ++round) {
    int taught = 0;
    for (int turn = 0; turn < 4; ++turn) {
      const float before = warmed_up.radiance();
      trace_paths(warmed_up.exec, warmed_up.guider, {1, warmed_up.paths, 2, sample++}, box_caster{},
                  patch_box());
      taught += warmed_up.radiance() != before ? 1 : 0;
    }
    CHECK(taught == 1);
  }
  CHECK(warmed_up.guider.statistics().dropped_vertices == 0);
  CHECK(warmed_up.guider.statistics().deposits.total() == 0);
}

WFPG_TEST_CASE("path guider: a host's own deposits change the cache after every sample", "[path_guider]") {
  warmed_up_guider<Exec> warmed_up(6 * 4 * 4);
  for (std::uint32_t sample = 33; sample <= 37; ++sample) {
    const float before = warmed_up.radiance();
    warmed_up.guider.begin_sample();
    deposit_on_walls(warmed_up.exec, warmed_up.guider.guide().cache(), 4,
                     [=](std::uint32_t, float, float) { return static_cast<float>(sample); });
    warmed_up.guider.end_sample();
    CHECK(warmed_up.radiance() > before);
  }
}

/// Other bins in each wave, and a third more after the first sample.
std::vector<test_surface> unlike_wave(std::uint32_t sample, std::uint32_t depth) {
  auto surfaces = wall_surfaces(512, 10 * sample + depth);
  for (std::size_t i = 0; sample == 0 && i < 140; ++i) surfaces[i] = surfaces[140];
  return surfaces;
}

/// Allocations after the first of 8 samples: with fused and prepared calls, and with inline and batch
/// casters.
template <class Exec>
std::size_t late_allocations(const guider_options& options, int form) {
  counting_resource resource;
  const Exec exec = Exec().with_resource(&resource);
  const box_mesh<Exec> mesh(exec);
  batch_box_caster::log log;
  octree_guider<Exec> guider(exec, mesh.view(), options);
  const Exec uncounted;
  const wfpg::buffer<wfpg::sampled_direction, Exec> directions(uncounted, 512);
  std::size_t after_first = 0;
  for (std::uint32_t sample = 0; sample < 8; ++sample) {
    guider.begin_sample();
    for (std::uint32_t depth = 0; depth < 2; ++depth) {
      const wave_of_surfaces<Exec> surfaces(uncounted, unlike_wave(sample, depth), depth, sample);
      const auto rays = surfaces.get();
      const batch_box_caster batch{{}, &log};
      if (form == 0) guider.sample_directions(rays, box_caster{}, directions.view());
      if (form == 1) guider.sample_directions(rays, batch, directions.view());
      if (form == 2) guider.prepare(rays, box_caster{});
      if (form == 3) guider.prepare(rays, batch);
    }
    deposit_on_walls(uncounted, guider.guide().cache(), 40, [](std::uint32_t, float, float) { return 1.0f; });
    guider.end_sample();
    if (sample == 0) after_first = resource.allocations;
  }
  return resource.allocations - after_first;
}

WFPG_TEST_CASE("path guider: nothing is allocated after the first guided sample", "[path_guider]") {
  for (field_lifetime lifetime : lifetimes)
    for (int form = 0; form < 4; ++form)
      for (std::size_t budget : {std::size_t(3) << 16, std::size_t(3) << 20}) {
        guider_options options = box_options(guiding_mode::oriented, lifetime);
        options.max_rays = 512;
        options.binning.rays_per_bin = 3;
        options.kept.budget_bytes = budget;
        INFO(name_of(lifetime) << ", form " << form << ", budget " << budget);
        CHECK(late_allocations<Exec>(options, form) == 0);
      }
}

WFPG_TEST_CASE("path guider: statistics count bins, rays and cones by depth", "[path_guider]") {
  guided_box<Exec> box(field_lifetime::transient);
  CHECK(box.guider.statistics().samples == 0);
  CHECK(box.guider.statistics().build.skipped() == 0);
  box.learn();
  const auto surfaces = wall_surfaces(600, 7);
  for (std::uint32_t depth : {0u, 0u, 1u, 30u}) box.sample(surfaces, box_caster{}, 1, depth);
  CHECK(box.guider.guide().field_resolution(0) == 16);
  CHECK(box.guider.guide().field_resolution(1) == 8);
  CHECK(box.guider.guide().field_resolution(100) == 8);

  const auto statistics = box.guider.statistics();
  CHECK(statistics.samples == 1);
  CHECK(statistics.guided_samples == 1);
  REQUIRE(statistics.depths.size() == box.guider.options().max_depth);
  const auto& first = statistics.depths[0];
  CHECK(first.rays == 1200);
  CHECK(first.unbinned == 0);
  CHECK(first.bins > 20);
  CHECK(first.bins < 1200);
  CHECK(first.cones == first.bins * 256);
  CHECK(statistics.depths[1].rays == 600);
  CHECK(statistics.depths[1].bins * 2 == first.bins);
  CHECK(statistics.depths[1].cones == statistics.depths[1].bins * 64);
  CHECK(statistics.depths[2].rays == 0);
  CHECK(statistics.depths.back().rays == 600);  // larger depths share the last entry
  double seconds = 0.0;
  for (const wfpg::stage_time& stage : statistics.seconds) {
    CHECK(stage.seconds >= 0.0);
    seconds += stage.seconds;
  }
  CHECK(statistics.seconds.size() == 5);
  CHECK(seconds > 0.0);
}

WFPG_TEST_CASE("path guider: statistics count allocated and refreshed fields, and slots", "[path_guider]") {
  guided_box<Exec> box;
  box.learn();
  const auto surfaces = wall_surfaces(600, 7);
  box.sample_again(surfaces);
  const auto first = box.guider.statistics();
  CHECK(first.kept.allocated > 20);
  CHECK(first.kept.live == first.kept.allocated);
  CHECK(first.kept.capacity == (std::size_t(4) << 20) / first.kept.bytes_a_slot);
  CHECK(first.depths[0].bins == first.kept.allocated);
  CHECK(first.depths[0].cones == first.kept.allocated * 256);
  CHECK(first.depths[0].rays + first.depths[0].unbinned == 4 * 600);
  CHECK(first.depths[0].rays > 3 * 600);
  CHECK(first.kept.refreshed == 0);
  CHECK(first.kept.refused == 0);
  box.guider.begin_sample();
  for (std::uint32_t depth : {1u, 0u, 30u}) box.sample(surfaces, box_caster{}, 1, depth);
  const auto second = box.guider.statistics();
  CHECK(second.guided_samples == 2);
  CHECK(second.depths[1].bins == first.kept.allocated);
  CHECK(second.depths[1].cones == first.kept.allocated * 256 / box.guider.options().kept.recast);
  CHECK(second.depths[1].rays == 600);
  CHECK(second.depths[0].cones == first.depths[0].cones);
  CHECK(second.depths.back().rays == 600);
  CHECK(second.kept.refreshed == first.kept.allocated);
  CHECK(second.kept.allocated == first.kept.allocated);
  CHECK(second.kept.freed == 0);

  guided_box<Exec> transient(field_lifetime::transient);
  transient.learn();
  transient.sample(surfaces);
  CHECK(transient.guider.statistics().kept.capacity == 0);
  CHECK(transient.guider.statistics().kept.allocated == 0);
}

WFPG_TEST_CASE("path guider: kept fields report their node and orientation", "[path_guider]") {
  guided_box<Exec> box;
  box.learn();
  box.sample_again(wall_surfaces(600, 7));
  const std::vector<std::uint32_t> keys = box.guider.guide().field_keys(box.exec);
  const auto kept = box.guider.statistics().kept;
  CHECK(keys.size() == kept.capacity);
  std::uint32_t live = 0;
  for (const std::uint32_t key : keys) {
    if (key == 0xffffffffu) continue;
    ++live;
    CHECK(key / wfpg::orientations < box.guider.guide().octree().node_count());
    CHECK(std::count(keys.begin(), keys.end(), key) == 1);
  }
  CHECK(live == kept.live);
  CHECK(guided_box<Exec>(field_lifetime::transient).guider.guide().field_keys(box.exec).empty());
}

WFPG_TEST_CASE("path guider: a build report counts the skipped triangles", "[path_guider]") {
  const Exec exec;
  auto positions = box_positions();
  auto triangles = box_triangles();
  positions.push_back(vec3(std::nanf("")));
  triangles.push_back({0, 1, 8});
  triangles.push_back({0, 1, 99});
  triangles.push_back({2, 2, 3});
  const wfpg::buffer<vec3, Exec> p(exec, positions);
  const wfpg::buffer<wfpg::uvec3, Exec> t(exec, triangles);
  const octree_guider<Exec> guider(exec, {const_view<vec3>(p), const_view<wfpg::uvec3>(t)}, box_options());
  const auto build = guider.statistics().build;
  CHECK(build.non_finite == 1);
  CHECK(build.out_of_range == 1);
  CHECK(build.degenerate == 1);
}

/// Waits until the clock has advanced by that many seconds.
void wait(double seconds) {
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() < seconds) {
  }
}

TEST_CASE("a nested stage's time does not count for the outer stage", "[path_guider]") {
  namespace stage = wfpg::stage;
  wfpg::stage_clock clock;
  const auto begin = std::chrono::steady_clock::now();
  {
    const auto outer = clock.time(stage::fields);
    wait(0.01);
    {
      const auto inner = clock.time(stage::bin);
      wait(0.02);
    }
    wait(0.01);
  }
  const std::chrono::duration<double> all = std::chrono::steady_clock::now() - begin;
  wait(0.01);
  const auto times = clock.report();
  CHECK(times[0].seconds >= 0.02);
  CHECK(times[1].seconds >= 0.02);
  CHECK(times[0].seconds + times[1].seconds <= all.count());
  CHECK(times[2].seconds == 0.0);
}

}  // namespace
