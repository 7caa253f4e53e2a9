// The facade: options, waves of unusual rays, deposits and drops, memory, statistics, failures.
// test_path_guider_sampling.cpp tests the sampled directions.
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::guiding_mode;
using wfpg::sampled_direction;
using wfpg::sampling_technique;

namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

struct bad_option {
  const char* name;  ///< must be in the message
  std::function<void(guider_options&)> spoil;
};

const std::vector<bad_option>& bad_options() {
  static const std::vector<bad_option> list = {
      {"octree", [](guider_options& o) { o.octree_resolution = 0; }},
      {"octree", [](guider_options& o) { o.octree_resolution = 3; }},
      {"octree", [](guider_options& o) { o.octree_resolution = 1u << 20; }},
      {"rays_per_bin", [](guider_options& o) { o.binning.rays_per_bin = 0; }},
      {"field_resolution",
       [](guider_options& o) { o.fields = field_lifetime::transient, o.field_resolution = 1; }},
      {"field_resolution",
       [](guider_options& o) { o.fields = field_lifetime::transient, o.field_resolution = 129; }},
      {"min_field_resolution",
       [](guider_options& o) { o.fields = field_lifetime::transient, o.min_field_resolution = 0; }},
      {"min_field_resolution",
       [](guider_options& o) { o.fields = field_lifetime::transient, o.min_field_resolution = 500; }},
      {"guide_fraction", [](guider_options& o) { o.guide_fraction = -0.1f; }},
      {"guide_fraction", [](guider_options& o) { o.guide_fraction = 1.5f; }},
      {"guide_fraction", [](guider_options& o) { o.guide_fraction = nan; }},
      {"filter_alpha", [](guider_options& o) { o.field.filter_alpha = -1.0f; }},
      {"filter_alpha", [](guider_options& o) { o.field.filter_alpha = infinity; }},
      {"floor", [](guider_options& o) { o.field.floor = -1.0f; }},
      {"floor", [](guider_options& o) { o.field.floor = nan; }},
      {"kept.resolution", [](guider_options& o) { o.kept.resolution = 1; }},
      {"kept.resolution", [](guider_options& o) { o.kept.resolution = 129; }},
      {"kept.recast", [](guider_options& o) { o.kept.recast = 0; }},
      {"kept.idle_samples", [](guider_options& o) { o.kept.idle_samples = 0; }},
      {"kept.budget_bytes", [](guider_options& o) { o.kept.budget_bytes = ~std::size_t(0); }},
      {"product_resolution", [](guider_options& o) { o.product_resolution = 3; }},
      {"product_resolution", [](guider_options& o) { o.product_resolution = 32; }},
      {"kept.resolution",
       [](guider_options& o) {
         o.product_resolution = 16;
         o.kept.resolution = 24;
       }},
      {"field_resolution at a depth",
       [](guider_options& o) {
         o.fields = field_lifetime::transient;
         o.product_resolution = 8;
         o.min_field_resolution = 12;
       }},
      {"guide_fraction",
       [](guider_options& o) {
         o.product_resolution = 4;
         o.guide_fraction = 1.0f;
       }},
      {"guided_depths", [](guider_options& o) { o.guided_depths = 0; }},
      {"max_depth", [](guider_options& o) { o.max_depth = 0; }},
      {"max_depth", [](guider_options& o) { o.max_depth = 5000; }},
      {"max_paths", [](guider_options& o) { o.max_paths = std::size_t(1) << 40; }},
      {"max_rays", [](guider_options& o) { o.max_rays = std::size_t(1) << 40; }},
      {"max_paths times max_depth", [](guider_options& o) {
         o.max_paths = std::size_t(1) << 31;
         o.max_depth = 1024;
         o.deposit_capacity.reset();
       }}};
  return list;
}

WFPG_TEST_CASE("path guider: options out of range are named", "[path_guider]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  for (const bad_option& bad : bad_options()) {
    guider_options options;
    bad.spoil(options);
    const std::string message = refusal([&] { octree_guider<Exec>(exec, mesh.view(), options); });
    INFO("expected: " << bad.name << ", message: " << message);
    CHECK(message.find(bad.name) != std::string::npos);
  }
  guider_options good = box_options();
  good.guide_fraction = 1.0f;
  good.field_resolution = 128;
  good.min_field_resolution = 2;
  good.octree_resolution = 1;
  CHECK(refusal([&] { octree_guider<Exec>(exec, mesh.view(), good); }).empty());
}

WFPG_TEST_CASE("path guider: waves beyond the capacity and too small outputs are refused", "[path_guider]") {
  for (field_lifetime lifetime : lifetimes) {
    guided_box<Exec> box(lifetime);
    box.learn();
    const wave_of_surfaces<Exec> wave(box.exec, wall_surfaces(100, 1)),
        large(box.exec, wall_surfaces(1025, 1));
    const wfpg::buffer<sampled_direction, Exec> directions(box.exec, 2000);
    const wfpg::buffer<float, Exec> densities(box.exec, 99);
    const auto query = [] WFPG_HD(std::uint32_t) { return vec3(0, 1, 0); };
    CHECK_THROWS_AS(box.guider.sample_directions(large.get(), box_caster{}, directions.view()),
                    std::invalid_argument);
    CHECK_THROWS_AS(box.guider.prepare(large.get(), box_caster{}), std::invalid_argument);
    CHECK_THROWS_AS(box.guider.sample_directions(wave.get(), box_caster{}, directions.view().subview(0, 99)),
                    std::invalid_argument);
    CHECK_THROWS_AS(box.guider.sample_directions(wave.get(), box_caster{}, directions.view(),
                                                 wfpg::density_queries{query, densities.view()}),
                    std::invalid_argument);
    CHECK(box.sample(wall_surfaces(1024, 1)).size() == 1024);
  }
}

WFPG_TEST_CASE("path guider: waves without rays work, even with a capacity of 0", "[path_guider]") {
  for (field_lifetime lifetime : lifetimes) {
    guided_box<Exec> box(lifetime);
    box.learn();
    batch_box_caster::log log;
    CHECK(box.sample({}).empty());
    CHECK(box.sample({}, batch_box_caster{{}, &log}).empty());
    const wave_of_surfaces<Exec> none(box.exec, {});
    CHECK(!guides(box.exec, box.guider.prepare(none.get(), box_caster{}), 0));
    CHECK(log.rays == 0);
    CHECK(box.guider.statistics().depths[0].bins == 0);

    guider_options options = box_options(guiding_mode::oriented, lifetime);
    options.max_rays.reset();
    guided_box<Exec> incapable(options);
    incapable.learn();
    CHECK(incapable.sample({}).empty());
    CHECK_THROWS_AS(incapable.sample(wall_surfaces(1, 1)), std::invalid_argument);
  }
}

/// The direction that a ray's BSDF samples alone, and its density.
struct sample_of_bsdf {
  stored_surfaces surfaces;
  WFPG_HD wfpg::bsdf_sample operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const test_surface s = surfaces(ray);
    const vec3 direction = s.bsdf.sample(s.outgoing, hashed_numbers{1}(ray, 1)).direction;
    return {direction, s.bsdf.pdf(s.outgoing, direction)};
  }
};

WFPG_TEST_CASE("path guider: rays outside every voxel are counted and sampled by their BSDF",
               "[path_guider]") {
  for (field_lifetime lifetime : lifetimes) {
    guided_box<Exec> box(lifetime);
    box.learn();
    auto surfaces = wall_surfaces(200, 1);
    const vec3 outside[] = {{5, 5, 5}, {-2, 0.5f, 0.5f}, {nan, 0, 0}, {infinity, 0, 0}, {0.5f, 0.5f, 0.5f}};
    for (std::size_t i = 0; i < 5; ++i) surfaces[40 * i].position = outside[i];
    const auto drawn = box.sample_again(surfaces);
    const wave_of_surfaces<Exec> wave(box.exec, surfaces);
    const auto before = box.guider.statistics().depths[0];
    const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
    const auto alone = evaluate(box.exec, surfaces.size(), sample_of_bsdf{wave.get().surfaces});
    for (std::size_t i = 0; i < 5; ++i) {
      const sampled_direction& d = drawn[40 * i];
      CHECK(d.technique == sampling_technique::bsdf);
      CHECK(alike(d.direction, alone[40 * i].direction));
      CHECK(alike(d.pdf, alone[40 * i].pdf));
      CHECK(!guides(box.exec, view, std::uint32_t(40 * i)));
      CHECK(guides(box.exec, view, std::uint32_t(40 * i + 1)));
    }
    CHECK(!guides(box.exec, view, 200));
    const auto after = box.guider.statistics().depths[0];
    CHECK(after.unbinned - before.unbinned == 5);
    CHECK(after.rays - before.rays == 195);
  }
}

WFPG_TEST_CASE("path guider: inactive rays get no direction and change no other ray", "[path_guider]") {
  for (field_lifetime lifetime : lifetimes) {
    guided_box<Exec> box(lifetime);
    box.learn();
    const auto surfaces = mixed_surfaces(800, 2);
    box.sample_again(surfaces);
    const auto before = box.guider.statistics().depths[0];
    const auto drawn = box.sample(surfaces);
    int wrong = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      const sampled_direction& d = drawn[i];
      const bool none = d.technique == sampling_technique::none;
      if (none) wrong += d.pdf != 0.0f || d.direction != vec3(0.0f);
      if (!none) wrong += !(d.pdf > 0.0f) || std::abs(glm::length(d.direction) - 1.0f) > 1e-5f;
      if (!surfaces[i].active) wrong += !none;
      if (surfaces[i].active && surfaces[i].bsdf.kind == bsdf_kind::mirror)
        wrong += d.technique != sampling_technique::delta || d.pdf != 0.75f;
      if (surfaces[i].active && surfaces[i].bsdf.kind == bsdf_kind::lambert) wrong += none;
    }
    CHECK(wrong == 0);
    const auto after = box.guider.statistics().depths[0];
    CHECK(after.rays - before.rays == 600);  // neither inactive rays nor mirrors
    CHECK(after.unbinned == before.unbinned);

    std::vector<test_surface> all_inactive(50, test_surface{});
    for (test_surface& s : all_inactive) s.active = false;
    for (const sampled_direction& d : box.sample(all_inactive))
      CHECK(d.technique == sampling_technique::none);
  }
}

WFPG_TEST_CASE("path guider: an empty mesh guides nothing and works", "[path_guider]") {
  const Exec exec;
  for (field_lifetime lifetime : lifetimes) {
    const guider_options options = tracing_options(64, guiding_mode::oriented, lifetime);
    octree_guider<Exec> guider(exec, wfpg::triangle_mesh_view{}, options);
    CHECK(!guider.guided());
    const auto picture = trace_paths(exec, guider, 3, 64, box_caster{});
    CHECK(std::all_of(picture.begin(), picture.end(), [](float x) { return std::isfinite(x); }));
    CHECK(std::accumulate(picture.begin(), picture.end(), 0.0) > 0.0);
    const wave_of_surfaces<Exec> wave(exec, wall_surfaces(64, 1));
    guider.begin_sample();
    CHECK(!guider.guided());
    CHECK(!guides(exec, guider.prepare(wave.get(), box_caster{}), 0));
    guider.invalidate_all();
    guider.forget_light();
    const auto statistics = guider.statistics();
    CHECK(statistics.guided_samples == 0);
    CHECK(statistics.deposits.outside > 0);
    CHECK(statistics.kept.allocated == 0);
    CHECK(guider.guide().octree().leaf_count() == 0);
    const bool kept = lifetime == field_lifetime::kept;
    CHECK(guider.memory().persistent() < 4096 + (kept ? options.kept.budget_bytes : 0));
  }
}

template <class Exec>
int count_toward_patch(field_lifetime lifetime) {
  const Exec exec;
  std::vector<wfpg::surface_fragment> hits;
  for (const test_surface& s : wall_surfaces(3000, 5)) hits.push_back({s.position, s.normal, 1.0f});
  const wfpg::buffer<wfpg::surface_fragment, Exec> device(exec, hits);
  guider_options options = box_options(guiding_mode::oriented, lifetime);
  options.octree_resolution = 8;
  octree_guider<Exec> guider(exec,
                             wfpg::fragments_from_samples(exec, const_view<wfpg::surface_fragment>(device), 8,
                                                          {vec3(0.0f), vec3(1.0f)}),
                             options);
  deposit_on_walls(exec, guider.guide().cache(), 40,
                   [](std::uint32_t f, float u, float v) { return emitted(face_point(f, u, v)); });
  guider.end_sample();
  guider.begin_sample();
  const std::vector<test_surface> surfaces(500, make_surface({0.5f, 0, 0.5f}, {0, 1, 0}, {0, 1, 0}));
  const wave_of_surfaces<Exec> wave(exec, surfaces);
  const wfpg::buffer<sampled_direction, Exec> directions(exec, surfaces.size());
  guider.sample_directions(wave.get(), box_caster{}, directions.view());
  const vec3 to_patch = glm::normalize(vec3(0.3f, 1.0f, 0.3f));
  int toward = 0;
  for (const sampled_direction& d : directions.to_host(exec))
    toward += glm::dot(d.direction, to_patch) > 0.9f;
  return toward;
}

WFPG_TEST_CASE("path guider: an octree from hit points and bounds guides", "[path_guider]") {
  for (field_lifetime lifetime : lifetimes)
    CHECK(count_toward_patch<Exec>(lifetime) > 200);  // about 60 of cosine-distributed directions
}

/// Records one path with invalid values.
struct record_nonsense {
  wfpg::path_recorder_view recorder;
  stored_surfaces surfaces;
  WFPG_HD void operator()(std::size_t path) const {
    const test_surface s = surfaces(static_cast<std::uint32_t>(path));
    const vec3 up(0, 1, 0), one(1.0f);
    if (path < 4) {
      const float bad[] = {nan, infinity, -infinity, -1.0f};
      recorder.vertex(path, 0, s.position, s.outgoing, one);
      recorder.radiance(path, 0, vec3(bad[path]));
    }
    if (path == 4) recorder.vertex(path, 0, vec3(nan), up, one);
    if (path == 5) recorder.vertex(path, 0, s.position, up, vec3(nan));
    if (path == 6) recorder.vertex(path, 0, vec3(9.0f), up, one);
    if (path == 7) recorder.vertex(path, 0, s.position, vec3(nan), one);
  }
};

WFPG_TEST_CASE("path guider: values that are not finite are dropped and counted", "[path_guider]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  for (field_lifetime lifetime : lifetimes) {
    octree_guider<Exec> guider(exec, mesh.view(), tracing_options(64, guiding_mode::oriented, lifetime));
    trace_paths(exec, guider, 1, 64, box_caster{});
    guider.begin_sample();
    const wave_of_surfaces<Exec> surfaces(exec, wall_surfaces(64, 9));
    exec.for_each(8, record_nonsense{guider.recorder(), surfaces.get().surfaces});
    const auto before = guider.statistics();
    guider.end_sample();
    const auto after = guider.statistics();
    CHECK(after.deposits.invalid - before.deposits.invalid == 6);
    CHECK(after.dropped_vertices == 1);
    CHECK(after.deposits.outside - before.deposits.outside == 1);
    CHECK(after.deposits.overflow == 0);
    for (float radiance : trace_paths(exec, guider, 1, 64, box_caster{})) CHECK(std::isfinite(radiance));
  }
}

WFPG_TEST_CASE("path guider: vertices out of range are dropped and counted", "[path_guider]") {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  octree_guider<Exec> guider(exec, mesh.view(), tracing_options(4));
  guider.begin_sample();
  const auto recorder = guider.recorder();
  exec.for_each(1, [=] WFPG_HD(std::size_t) {
    const vec3 nowhere(0.0f), up(0, 1, 0), one(1.0f);
    recorder.vertex(4, 0, nowhere, up, one);  // no such path
    recorder.vertex(0, 3, nowhere, up, one);  // no such depth
    recorder.radiance(0, 0, one);             // no such vertex
    recorder.emission(7, 0, one);
  });
  CHECK(guider.statistics().dropped_vertices == 4);
  CHECK(guider.statistics().path_gaps == 0);
  exec.for_each(1, [=] WFPG_HD(std::size_t) {
    const vec3 up(0, 1, 0), one(1.0f);
    recorder.vertex(0, 1, {0.5f, 0.0f, 0.5f}, up, one);  // depth 0 is left out
    recorder.vertex(0, 0, {0.5f, 0.0f, 0.5f}, up, one);  // out of order
  });
  CHECK(guider.statistics().dropped_vertices == 5);
  CHECK(guider.statistics().path_gaps == 1);
  guider.end_sample();
}

WFPG_TEST_CASE("path guider: an exception in a caster leaves the guider usable", "[path_guider]") {
  guider_options options = box_options(guiding_mode::oriented, field_lifetime::transient);
  options.caster_buffer_bytes = 1;  // one bin per call
  guided_box<Exec> box(options), other(options);
  box.learn();
  other.learn();
  const auto surfaces = mixed_surfaces(500, 3);
  const auto expected = other.sample(surfaces);
  std::vector<std::size_t> in_use;
  for (std::size_t call : {3, 3, 0, 1, 3}) {
    const wave_of_surfaces<Exec> wave(box.exec, surfaces);
    batch_box_caster::log failing;
    failing.throw_at = call;
    CHECK_THROWS_AS(box.sample(surfaces, batch_box_caster{{}, &failing}), std::runtime_error);
    failing.calls = 0;
    CHECK_THROWS_AS(box.guider.prepare(wave.get(), batch_box_caster{{}, &failing}), std::runtime_error);
    in_use.push_back(box.guider.memory().transient());
  }
  CHECK(in_use.back() == in_use[1]);  // nothing leaks
  batch_box_caster::log log;
  CHECK(same_bits(box.sample(surfaces, batch_box_caster{{}, &log}), expected));
  CHECK(same_bits(box.sample(surfaces), expected));
  box.guider.end_sample();
  box.guider.begin_sample();
  CHECK(box.sample(surfaces).size() == surfaces.size());
}

WFPG_TEST_CASE("path guider: after a caster throws, the next wave builds the kept fields", "[path_guider]") {
  guider_options options = box_options();
  options.caster_buffer_bytes = 1;  // one field per call
  guided_box<Exec> box(options), other(options);
  box.learn();
  other.learn();
  const auto surfaces = mixed_surfaces(500, 3);
  const wave_of_surfaces<Exec> wave(box.exec, surfaces);
  std::vector<std::size_t> in_use;
  for (std::size_t call : {3, 0, 1, 3}) {
    batch_box_caster::log failing, log;
    failing.throw_at = call;
    CHECK_THROWS_AS(box.sample(surfaces, batch_box_caster{{}, &failing}), std::runtime_error);
    failing.calls = 0;
    CHECK_THROWS_AS(box.guider.prepare(wave.get(), batch_box_caster{{}, &failing}), std::runtime_error);
    in_use.push_back(box.guider.memory().transient());
    other.sample_again(surfaces);  // counts as many rays
    other.sample(surfaces);
    const auto expected = other.sample_again(surfaces);
    CHECK(same_bits(box.sample_again(surfaces, batch_box_caster{{}, &log}), expected));
    CHECK(same_bits(box.sample_again(surfaces), expected));
    other.sample(surfaces);
    for (guided_box<Exec>* each : {&box, &other}) {
      each->guider.end_sample();
      each->guider.begin_sample();
    }
  }
  CHECK(in_use.back() == in_use[2]);  // nothing leaks
}

WFPG_TEST_CASE("path guider: rays without a field sample their BSDF, and statistics count them",
               "[path_guider]") {
  for (const bool no_budget : {true, false}) {
    guider_options options = box_options();
    if (no_budget) options.kept.budget_bytes = 100;
    if (!no_budget) options.kept.max_wave_cones = 0;
    guided_box<Exec> box(options);
    box.learn();
    const auto surfaces = wall_surfaces(300, 3);
    const auto drawn = box.sample_again(surfaces);
    const auto densities = bsdf_densities(box.exec, surfaces, drawn);
    int wrong = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      wrong += drawn[i].technique != sampling_technique::bsdf;
      wrong += !alike(drawn[i].pdf, densities[i]);
    }
    CHECK(wrong == 0);
    const auto statistics = box.guider.statistics();
    CHECK(statistics.depths[0].rays == 0);
    CHECK(statistics.depths[0].unbinned == 4 * 300);
    CHECK(statistics.depths[0].cones == 0);
    CHECK(statistics.kept.refused > 0);
    CHECK(statistics.kept.live == 0);
    CHECK((statistics.kept.capacity == 0) == no_budget);
  }
}

/// The number of cones that a sample of one wave casts.
template <class Exec>
std::size_t cones_of_sample(guided_box<Exec>& box, const std::vector<test_surface>& surfaces) {
  batch_box_caster::log log;
  box.guider.begin_sample();
  box.sample_again(surfaces, batch_box_caster{{}, &log});
  return log.rays;
}

struct pdf_of_first_ray {
  wfpg::guide_view view;
  vec3 direction;
  WFPG_HD float operator()() const { return view.pdf(0, direction); }
};

WFPG_TEST_CASE("path guider: fields near moved geometry are cast again, near moved light not",
               "[path_guider]") {
  guided_box<Exec> box;
  box.learn();
  const std::vector<test_surface> surfaces(300, make_surface({0.5f, 0, 0.5f}, {0, 1, 0}, {0, 1, 0}));
  const vec3 to_patch = glm::normalize(vec3(0.3f, 1.0f, 0.3f));
  const wave_of_surfaces<Exec> wave(box.exec, surfaces);
  const auto toward_patch = [&] {
    return evaluate(box.exec, pdf_of_first_ray{box.guider.prepare(wave.get(), box_caster{}), to_patch});
  };
  const std::uint64_t refreshed = 256 / box.guider.options().kept.recast;
  CHECK(cones_of_sample(box, surfaces) == 256);
  CHECK(cones_of_sample(box, surfaces) == refreshed);
  box.guider.invalidate({{0.4f, -3.0f, 0.4f}, {0.6f, -2.8f, 0.6f}});
  CHECK(cones_of_sample(box, surfaces) == refreshed);
  box.guider.invalidate({{0.4f, 0.4f, 0.4f}, {0.6f, 0.6f, 0.6f}});
  CHECK(cones_of_sample(box, surfaces) == 256);
  box.guider.invalidate_all();
  CHECK(cones_of_sample(box, surfaces) == 256);
  CHECK(toward_patch() > 1.0f);
  box.guider.forget_light();
  CHECK(cones_of_sample(box, surfaces) == refreshed);
  CHECK(toward_patch() == Approx(0.5f / wfpg::pi));  // no light: uniform over the hemisphere
}

}  // namespace
