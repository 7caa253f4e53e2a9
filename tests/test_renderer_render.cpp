// render(): refused options, reports, checkpoints, and guided pictures compared with path tracing.
#include "app/option_names.hpp"
#include "app/render.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/device_scene.hpp"
#include "support/catch.hpp"
#include "support/guided_depths.hpp"
#include "support/pictures.hpp"
#include "support/policies.hpp"

#include <tbb/global_control.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace render;
using namespace render_test;
using wfpg_test::one_policy;

/// The message of render() for refused options.
std::string refusal(const render_options& options) {
  try {
    render::render(square_of({}), options, {});
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing";
}

/// The mean of a part of a path-traced picture of 32 x 32 pixels. The part has a first and last column and
/// row.
double mean_of_part(const std::string& name, int max_depth, const int (&columns)[2], const int (&rows)[2]) {
  render_options options;
  options.method = sampling_method::pt;
  options.width = options.height = 32;
  options.max_depth = max_depth;
  options.spp = 16;
  const image picture = render::render(make_builtin_scene(name), options, {}).picture;
  std::vector<vec3> part;
  for (int y = rows[0]; y <= rows[1]; ++y)
    for (int x = columns[0]; x <= columns[1]; ++x)
      part.push_back(picture.pixels[static_cast<std::size_t>(32 * y + x)]);
  return mean_of(part);
}

}  // namespace

TEST_CASE("each method has a row and a name", "[renderer]") {
  CHECK(method_names().size() == std::size(all_methods));
  for (const method_properties& row : all_methods) {
    CHECK(&properties_of(row.method) == &row);
    CHECK(name_of(method_names(), row.method) == row.name);
  }
}

TEST_CASE("policies other than TBB refuse methods that need TBB", "[renderer]") {
  const scene square = square_of({});
  render_options options;
  options.method = sampling_method::openpgl_vmm;
  CHECK_THROWS_AS(render_on_seq(square, completed(square, options), {}), std::invalid_argument);
}

TEST_CASE("invalid scenes and options are refused by name", "[renderer]") {
  const one_policy exec;
  scene broken = square_of({});
  broken.triangles[1].y = 4;
  CHECK_THROWS_AS(device_scene<one_policy>(exec, broken), std::invalid_argument);
  broken = square_of({});
  broken.triangle_materials[0] = 1;
  CHECK_THROWS_AS(device_scene<one_policy>(exec, broken), std::invalid_argument);

  render_options options;
  options.method = sampling_method::pt;
  options.spp = 0;
  CHECK(refusal(options).find("spp is 0") != std::string::npos);
  options.spp = 1;
  options.combine = wfpg::sample_combination::discard_first;
  CHECK(refusal(options).find("spp is 1") != std::string::npos);
  options.roulette_depth = 0;
  CHECK(refusal(options).find("roulette_depth is 0") != std::string::npos);
}

TEST_CASE("a rendering reports itself and takes samples or seconds", "[renderer]") {
  render_options options;
  options.method = sampling_method::pt;
  options.width = 16;
  options.height = 8;
  options.spp = 3;
  int calls = 0;
  const auto counted = [&calls](const render_progress& p) { calls += p.fraction <= 1.0; };
  const scene box = make_builtin_scene("cornell-box");
  for (const device where : {device::cpu, device::omp, device::seq}) {
    options.where = where;
    const render_result result = render::render(box, options, counted);
    CHECK(result.report.spp == 3);
    CHECK((result.picture.width == 16 && result.picture.height == 8 && result.picture.pixels.size() == 128));
  }
  CHECK(calls == 9);
  options.seconds = 0.05;
  const render_result timed = render::render(box, options, {});
  CHECK(timed.report.spp >= 1);
  CHECK(timed.report.total_seconds >= 0.05);
}

TEST_CASE("checkpoints are the pictures after fewer samples", "[renderer]") {
  render_options options;
  options.width = options.height = 16;
  options.octree_resolution = 32;
  options.spp = 4;
  const scene box = make_builtin_scene("cornell-box");
  CHECK(render::render(box, options, {}).checkpoints.empty());
  options.checkpoints = checkpoint_times::powers_of_two;
  const render_result result = render::render(box, options, {});
  REQUIRE(result.checkpoints.size() == 3);
  CHECK(result.checkpoints[0].seconds <= result.checkpoints[2].seconds);
  CHECK(result.checkpoints[2].samples == 4);
  CHECK(result.checkpoints[2].picture.pixels == result.picture.pixels);
  options.spp = 2;
  CHECK(render::render(box, options, {}).picture.pixels == result.checkpoints[1].picture.pixels);
  options.spp = 3;
  const render_result odd = render::render(box, options, {});
  REQUIRE(odd.checkpoints.size() == 3);
  CHECK(odd.checkpoints[2].samples == 3);
  CHECK(odd.checkpoints[2].picture.pixels == odd.picture.pixels);
  options.spp = 6;
  options.checkpoints = checkpoint_times::all;
  const render_result all = render::render(box, options, {});
  REQUIRE(all.checkpoints.size() == 6);
  for (int i = 0; i < 6; ++i) CHECK(all.checkpoints[static_cast<std::size_t>(i)].samples == i + 1);
  CHECK(all.checkpoints[2].picture.pixels == odd.picture.pixels);
}

TEST_CASE("later samples have more weight only if they are better", "[renderer]") {
  render_options options;
  CHECK(combination_of(options) == wfpg::sample_combination::inverse_variance);
  options.least_gain = 0.0f;  // nothing is measured
  CHECK(combination_of(options) == wfpg::sample_combination::pt_linear);
  options.least_gain.reset();
  options.octree = octree_source::samples;  // nor here
  CHECK(combination_of(options) == wfpg::sample_combination::pt_linear);
  options.method = sampling_method::pt;
  CHECK(combination_of(options) == wfpg::sample_combination::constant);
  options.combine = wfpg::sample_combination::quadratic;
  CHECK(combination_of(options) == wfpg::sample_combination::quadratic);
}

TEST_CASE("a guided rendering finds the furnace's radiance", "[renderer][guided]") {
  const scene furnace = make_builtin_scene("furnace");
  render_options options;
  options.width = options.height = 40;
  options.max_depth = 4;
  options.spp = 20;
  options.octree_resolution = 32;
  options.field_resolution = 16;
  options.kept.resolution = 16;
  for (const fields lifetime : {fields::kept, fields::transient})
    for (const bool nee : {false, true})
      for (const guiding mode : {guiding::oriented, guiding::plain}) {
        INFO("nee " << nee << ", mode " << static_cast<int>(mode) << ", fields "
                    << static_cast<int>(lifetime));
        options.lifetime = lifetime;
        options.nee = nee;
        options.mode = mode;
        const render_result result = render::render(furnace, options, {});
        CHECK(mean_of(result.picture.pixels) == Approx(furnace_radiance(4)).epsilon(0.005));
      }
}

TEST_CASE("a guided rendering is equal on any device and number of threads", "[renderer][guided]") {
  const scene scene = make_builtin_scene("cornell-enclosed");
  render_options options;
  options.width = options.height = 24;
  options.spp = 3;
  options.octree_resolution = 32;
  options.sarsa.step = 1;
  options.records.octree_resolution = 32;
  options.records.emitter_rays = 1 << 12;
  const std::pair<sampling_method, fields> kinds[] = {{sampling_method::wfpg, fields::kept},
                                                      {sampling_method::wfpg, fields::transient},
                                                      {sampling_method::sarsa, fields::kept},
                                                      {sampling_method::records, fields::kept}};
  for (const auto& [method, lifetime] : kinds) {
    options.method = method;
    options.lifetime = lifetime;
    options.where = device::seq;
    const std::vector<vec3> serial = render::render(scene, options, {}).picture.pixels;
    CHECK(same_bits(serial, render::render(scene, options, {}).picture.pixels));
    for (const int threads : {1, 3}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
      options.where = device::cpu;
      CHECK(same_bits(serial, render::render(scene, options, {}).picture.pixels));
      const int before = omp_get_max_threads();
      omp_set_num_threads(threads);
      options.where = device::omp;
      CHECK(same_bits(serial, render::render(scene, options, {}).picture.pixels));
      omp_set_num_threads(before);
    }
  }
}

TEST_CASE("a rendering with irradiance records reports them, and all samples have equal weight",
          "[renderer][guided]") {
  render_options options;
  options.width = options.height = 16;
  options.spp = 2;
  options.method = sampling_method::records;
  options.records.octree_resolution = 32;
  options.records.emitter_rays = 1 << 12;
  CHECK(combination_of(options) == wfpg::sample_combination::constant);
  const scene enclosed = make_builtin_scene("cornell-enclosed");
  const render_report report = render::render(enclosed, options, {}).report;
  CHECK(report.records.builds == 1);
  CHECK(report.records.records > 100);
  CHECK(report.records.lights > 0);
  CHECK(report.records.directly_lit > 100);  // through glass
  CHECK(report.records.rays > 2 * options.records.emitter_rays);
  CHECK(report.records.cones == std::uint64_t(report.records.records) * 128 * 4);
  CHECK(report.persistent_bytes > 64 * std::size_t(report.records.records));
  CHECK(report.used_bytes == report.persistent_bytes);
  options.method = sampling_method::pt;
  CHECK(render::render(enclosed, options, {}).report.records.builds == 0);
}

TEST_CASE("only the first sample of a guided rendering is path tracing's", "[renderer][guided]") {
  const scene scene = make_builtin_scene("thin-wall");
  render_options options;
  options.width = options.height = 16;
  options.octree_resolution = 32;
  const auto render_with = [&](sampling_method method, int spp) {
    options.method = method;
    options.spp = spp;
    return render::render(scene, options, {});
  };
  const std::vector<vec3> unguided = render_with(sampling_method::pt, 3).picture.pixels;
  const std::vector<vec3> first = render_with(sampling_method::pt, 1).picture.pixels;
  for (const fields lifetime : {fields::transient, fields::kept}) {
    options.lifetime = lifetime;
    CHECK(same_bits(render_with(sampling_method::wfpg, 1).picture.pixels, first));
    CHECK_FALSE(same_bits(render_with(sampling_method::wfpg, 3).picture.pixels, unguided));
  }
  const render_result guided = render_with(sampling_method::wfpg, 3);
  CHECK(guided.report.octree.resolution == 32);
  CHECK(guided.report.octree.nodes > guided.report.octree.leaves);
  CHECK(guided.report.bins.at(0).count >= 1.0);
  CHECK(guided.report.cones_per_segment > 0.0);
  CHECK(guided.report.used_bytes > 0);
  CHECK(guided.report.persistent_bytes ==
        guided.report.used_bytes + (guided.report.slots.capacity - guided.report.slots.live) *
                                       (guided.report.slots.live_bytes / guided.report.slots.live));
  CHECK(guided.report.slots.capacity > guided.report.slots.live);
  CHECK(guided.report.slots.live > 0);
  CHECK(guided.report.slots.refreshed > 0.0);
}

TEST_CASE("with next-event estimation the guide does not sample a path's last direction",
          "[renderer][guided]") {
  for (const sampling_method method : {sampling_method::wfpg, sampling_method::wfpg_product,
                                       sampling_method::sarsa, sampling_method::records})
    wfpg_test::check_depths_are_guided(method);
}

TEST_CASE("left of the wall of cornell-wall all light is indirect", "[renderer][builtin]") {
  CHECK(mean_of_part("cornell-wall", 2, {2, 13}, {4, 23}) == 0.0);
  CHECK(mean_of_part("cornell-wall", 8, {2, 13}, {4, 23}) > 0.0);
  CHECK(mean_of_part("cornell-wall", 2, {18, 29}, {4, 23}) > 0.1);
}

TEST_CASE("light reaches the floor of caustic-pool only through the water", "[renderer][builtin]") {
  CHECK(mean_of_part("caustic-pool", 2, {0, 31}, {20, 31}) == 0.0);
  CHECK(mean_of_part("caustic-pool", 3, {0, 31}, {20, 31}) > 0.02);
}

TEST_CASE("roulette ends no path before its depth, and keeps the mean", "[renderer]") {
  scene dark = make_builtin_scene("furnace");
  dark.materials[0].base_color = vec3(0.05f);
  render_options options;
  options.method = sampling_method::pt;
  options.width = options.height = 64;
  options.spp = 16;
  for (const bool nee : {false, true})
    for (const int depth : {1, 2, 5, 8}) {
      INFO("roulette from vertex " << depth << ", nee " << nee);
      options.nee = nee;
      options.roulette_depth = depth;
      const render_result result = render::render(dark, options, {});
      CHECK(mean_of(result.picture.pixels) == Approx(1.0 / 0.95).epsilon(0.005));
      // One path in forty survives roulette.
      const double segments = static_cast<double>(result.report.segments) / (64.0 * 64.0 * 16.0);
      CHECK(segments >= std::min(depth + 1, 8));
      CHECK(segments <= std::min(depth + 1.05, 8.0));
    }
}

TEST_CASE("hits of lights count on emitting sides and for skies that emit", "[renderer]") {
  render_options options;
  options.method = sampling_method::pt;
  options.width = options.height = 8;
  options.spp = 2;
  const auto hits_of = [&options](const scene& seen) {
    const render_report report = render::render(seen, options, {}).report;
    return std::make_pair(report.light_hits_per_path, static_cast<double>(report.segments) / (64.0 * 2.0));
  };
  const auto [hits, segments] = hits_of(make_builtin_scene("furnace"));
  CHECK((hits == segments && hits > 3.0));
  material lamp;
  lamp.base_color = vec3(0.0f);
  lamp.emission = vec3(1.0f);
  scene s = square_of(lamp);
  s.view.vertical_fov = 0.01f;
  CHECK(hits_of(s).first == 1.0);
  s.view.position.z = -2.0f;
  s.view.forward = {0.0f, 0.0f, 1.0f};
  CHECK(hits_of(s).first == 0.0);
  s.view.forward = {0.0f, 0.0f, -1.0f};
  CHECK(hits_of(s) == std::make_pair(0.0, 1.0));
  s.environment = {0.0f, 0.25f, 0.0f};
  CHECK(hits_of(s).first == 1.0);
  s.environment = vec3(0.0f);
  s.sky = {1, 1, {vec3(0.5f)}};
  CHECK(hits_of(s).first == 1.0);
}
