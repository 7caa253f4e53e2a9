// What directions a guider draws: the same in both of its forms and on any number of threads, with densities
// that are the mixture's, and without bias.
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/path_guider.hpp>

#include <tbb/global_control.h>

#include <cmath>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::guider_options;
using wfpg::guiding_mode;
using wfpg::sampled_direction;
using wfpg::sampling_technique;

namespace {

constexpr guiding_mode modes[] = {guiding_mode::oriented, guiding_mode::plain};

/// A renderer's kernel of the prepared form.
struct sample_view {
  wfpg::guide_view view;
  stored_surfaces surfaces;
  hashed_numbers random;
  wfpg::array_view<sampled_direction> directions;
  void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const test_surface s = surfaces(ray);
    directions[i] = {};
    if (s.active) directions[i] = view.sample(ray, s, random(ray, 0).x, random(ray, 1));
  }
};

struct query_view {
  wfpg::guide_view view;
  stored_surfaces surfaces;
  wfpg::array_view<const vec3> queries;
  wfpg::array_view<float> densities;
  void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const test_surface s = surfaces(ray);
    densities[i] = s.active && queries[i] != vec3(0.0f) ? view.pdf(ray, s, queries[i]) : 0.0f;
  }
};

struct stored_queries {
  wfpg::array_view<const vec3> queries;
  vec3 operator()(std::uint32_t ray) const { return queries[ray]; }
};

template <class Exec, class Caster>
std::vector<sampled_direction> sample_prepared(guided_box<Exec>& box,
                                               const wfpg::buffer<test_surface, Exec>& surfaces,
                                               const Caster& caster, std::uint32_t depth) {
  const stored_surfaces stored{const_view<test_surface>(surfaces)};
  const wfpg::guide_view view =
      box.guider.prepare(wfpg::wave{depth, surfaces.size(), stored, hashed_numbers{}}, caster);
  const wfpg::buffer<sampled_direction, Exec> directions(box.exec, surfaces.size());
  box.exec.for_each(surfaces.size(), sample_view{view, stored, hashed_numbers{}, directions.view()});
  return directions.to_host(box.exec);
}

int count_guided(const std::vector<sampled_direction>& drawn) {
  int n = 0;
  for (const sampled_direction& d : drawn) n += d.technique == sampling_technique::guide;
  return n;
}

WFPG_TEST_CASE("path guider: both forms draw the same directions from the same numbers, bit for bit",
               "[path_guider]") {
  for (guiding_mode mode : modes) {
    guider_options options = box_options(mode);
    options.rays_per_bin = 8;  // bins with more and with fewer rays than these
    guided_box<Exec> box(options);
    box.learn();
    const auto surfaces = mixed_surfaces(700, 4);
    const wfpg::buffer<test_surface, Exec> stored(box.exec, surfaces);
    for (std::uint32_t depth : {0u, 1u, 7u}) {
      const auto fused = box.sample(surfaces, box_caster{}, 1, depth);
      CHECK(count_guided(fused) > 150);
      CHECK(same_bits(sample_prepared(box, stored, box_caster{}, depth), fused));
      batch_box_caster::log log;
      CHECK(same_bits(sample_prepared(box, stored, batch_box_caster{{}, &log}, depth), fused));
      CHECK(same_bits(box.sample(surfaces, batch_box_caster{{}, &log}, 1, depth), fused));
    }
  }
}

WFPG_TEST_CASE("path guider: both forms agree where nothing guides yet", "[path_guider]") {
  guider_options options = box_options();
  options.unguided_samples = 1;
  guided_box<Exec> box(options);
  box.guider.begin_sample();
  CHECK(!box.guider.guided());
  const auto surfaces = mixed_surfaces(200, 4);
  const wfpg::buffer<test_surface, Exec> stored(box.exec, surfaces);
  const auto fused = box.sample(surfaces);
  CHECK(count_guided(fused) == 0);
  CHECK(same_bits(sample_prepared(box, stored, box_caster{}, 0), fused));
  box.guider.end_sample();
  box.guider.begin_sample();
  CHECK(box.guider.guided());
  CHECK(count_guided(box.sample(surfaces)) > 20);
}

WFPG_TEST_CASE("path guider: queries are answered with the density that sampling has", "[path_guider]") {
  for (guiding_mode mode : modes) {
    guided_box<Exec> box(box_options(mode));
    box.learn();
    const auto surfaces = mixed_surfaces(700, 5);
    const wfpg::buffer<test_surface, Exec> stored(box.exec, surfaces);
    const auto drawn = box.sample(surfaces);
    std::vector<vec3> asked;
    for (const sampled_direction& d : drawn) asked.push_back(asked.size() % 10 ? d.direction : vec3(0.0f));
    const wfpg::buffer<vec3, Exec> queries(box.exec, asked);
    const wfpg::buffer<float, Exec> fused(box.exec, asked.size()), prepared(box.exec, asked.size());
    const wfpg::buffer<sampled_direction, Exec> again(box.exec, asked.size());
    const stored_surfaces all{const_view<test_surface>(stored)};
    const wfpg::wave wave{0, asked.size(), all, hashed_numbers{}};
    box.guider.sample_directions(
        wave, box_caster{}, again.view(),
        wfpg::density_queries{stored_queries{const_view<vec3>(queries)}, fused.view()});
    CHECK(same_bits(again.to_host(box.exec), drawn));
    const wfpg::guide_view view = box.guider.prepare(wave, box_caster{});
    box.exec.for_each(asked.size(), query_view{view, all, const_view<vec3>(queries), prepared.view()});
    CHECK(fused.to_host(box.exec) == prepared.to_host(box.exec));

    const auto densities = fused.to_host(box.exec);
    int wrong = 0, answered = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      const bool none = asked[i] == vec3(0.0f) || drawn[i].technique == sampling_technique::delta;
      wrong += densities[i] != (none ? 0.0f : drawn[i].pdf);
      answered += !none;
    }
    CHECK(wrong == 0);
    CHECK(answered > 400);
  }
}

WFPG_TEST_CASE("path guider: densities are the mixture's of field and BSDF", "[path_guider]") {
  for (guiding_mode mode : modes)
    for (float fraction : {0.0f, 0.25f, 1.0f}) {
      guider_options options = box_options(mode);
      options.guide_fraction = fraction;
      options.rays_per_bin = 400;
      options.min_bin_level = 1;
      guided_box<Exec> box(options);
      box.learn();
      std::vector<test_surface> surfaces(450, make_surface({0.4f, 0, 0.4f}, {0, 1, 0}, {0, 1, 0}));
      surfaces.resize(460, make_surface({1, 0.1f, 0.1f}, {-1, 0, 0}, {-1, 0, 0}));
      const auto drawn = box.sample(surfaces);
      const wave_of_surfaces<Exec> wave(box.exec, surfaces);
      const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
      for (std::uint32_t ray : {0u, 7u, 455u}) {
        const bool many = ray < 450 || mode == guiding_mode::plain;
        const float by_mode = mode == guiding_mode::plain || !many ? 0.5f : 0.7f;
        const float share = fraction > 0.0f ? fraction : by_mode;
        const vec3 d = drawn[ray].direction;
        const float of_bsdf = surfaces[ray].bsdf.pdf(surfaces[ray].outgoing, d);
        CHECK(drawn[ray].pdf == Approx(share * view.pdf(ray, d) + (1.0f - share) * of_bsdf));
        const sampled_direction alone = view.sample(ray, {0.3f, 0.8f});
        CHECK(alone.pdf == view.pdf(ray, alone.direction));
        CHECK(alone.technique == sampling_technique::guide);
      }
      if (fraction == 1.0f) CHECK(count_guided(drawn) == 460);
    }
}

struct estimate {
  double z = 0.0;         ///< deviation from the exact value, in standard errors
  double variance = 0.0;  ///< of one sample, around the exact value of its point
};

/// The patch's irradiance at points of the floor, by guided samples.
template <class Exec>
estimate estimate_irradiance(guided_box<Exec>& box, bsdf_kind kind) {
  const vec3 points[] = {{0.5f, 0, 0.5f}, {0.1f, 0, 0.2f}, {0.8f, 0, 0.8f}, {0.95f, 0, 0.3f}};
  double exact[4], sum = 0.0, squares = 0.0, n = 0.0;
  for (int i = 0; i < 4; ++i) exact[i] = floor_irradiance(points[i]);
  std::vector<test_surface> surfaces;
  for (int i = 0; i < 1024; ++i) surfaces.push_back(make_surface(points[i % 4], {0, 1, 0}, {0, 1, 0}, kind));
  for (std::uint64_t sample = 0; sample < 12; ++sample) {
    box.guider.begin_sample();
    const auto drawn = box.sample(surfaces, box_caster{}, 1000 + sample);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      wfpg::ray ray;
      ray.origin = surfaces[i].position;
      ray.direction = drawn[i].direction;
      const vec3 hit = ray.origin + box_caster()(ray).distance * ray.direction;
      const double cosine = std::fmax(double(ray.direction.y), 0.0);
      const double error = emitted(hit) * cosine / double(drawn[i].pdf) - exact[i % 4];
      sum += error;
      squares += error * error;
      n += 1.0;
    }
    box.guider.end_sample();
  }
  return {sum / std::sqrt(squares), squares / n};
}

WFPG_TEST_CASE("path guider: guided estimates have no bias and less variance", "[path_guider]") {
  guider_options unguided = box_options();
  unguided.unguided_samples = 1000;
  for (bsdf_kind kind : {bsdf_kind::lambert, bsdf_kind::glass}) {
    guided_box<Exec> reference(unguided);
    const estimate bsdf = estimate_irradiance(reference, kind);
    CHECK(std::abs(bsdf.z) < 4.0);
    for (guiding_mode mode : modes) {
      guided_box<Exec> box(box_options(mode));
      box.learn();
      const estimate guided = estimate_irradiance(box, kind);
      INFO("z " << guided.z << ", variance " << guided.variance << " guided, " << bsdf.variance << " not");
      CHECK(std::abs(guided.z) < 4.0);
      CHECK(guided.variance < 0.5 * bsdf.variance);
    }
  }
}

WFPG_TEST_CASE("path guider: paths that learn as they go agree with unguided ones", "[path_guider]") {
  constexpr std::size_t paths = 256;
  constexpr std::uint32_t samples = 24;
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  double mean[3], error[3];
  for (int run = 0; run < 3; ++run) {
    guider_options options = tracing_options(paths, modes[run % 2]);
    if (run == 2) options.unguided_samples = samples;
    wfpg::path_guider<Exec> guider(exec, mesh.view(), options);
    double sum = 0.0, squares = 0.0;
    for (float radiance : trace_paths(exec, guider, samples, paths, box_caster{})) {
      sum += double(radiance);
      squares += double(radiance) * double(radiance);
    }
    const double n = double(paths) * samples;
    mean[run] = sum / n;
    error[run] = std::sqrt((squares / n - mean[run] * mean[run]) / n);
    CHECK(guider.statistics().guided_samples == (run == 2 ? 0 : samples - 1));
    CHECK(guider.statistics().deposits.total() == 0);
  }
  for (int run = 0; run < 2; ++run) {
    INFO(mean[run] << " +- " << error[run] << " guided, " << mean[2] << " +- " << error[2] << " not");
    CHECK(std::abs(mean[run] - mean[2]) < 4.0 * std::hypot(error[run], error[2]));
    CHECK(error[run] < error[2]);
  }
}

/// What a guider does over samples and depths, from a seed.
template <class Exec>
std::vector<float> picture(std::uint64_t seed, bool batch = false) {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  guider_options options = tracing_options(800);
  options.octree_resolution = 4;  // many deposits in one voxel, whose order threads change
  options.seed = seed;
  wfpg::path_guider<Exec> guider(exec, mesh.view(), options);
  batch_box_caster::log log;
  return batch ? trace_paths(exec, guider, 3, 800, batch_box_caster{{}, &log})
               : trace_paths(exec, guider, 3, 800, box_caster{});
}

WFPG_TEST_CASE("path guider: one seed gives the same bits on any number of threads", "[path_guider]") {
  const std::vector<float> first = picture<Exec>(1);
  CHECK(picture<Exec>(1) == first);
  CHECK(picture<Exec>(1, true) == first);
  CHECK(picture<Exec>(2) != first);
  for (std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(static_cast<int>(threads));
    INFO(threads << " TBB threads");
    CHECK(arena.execute([] { return picture<Exec>(1); }) == first);
  }
#if !defined(WFPG_TEST_ONLY_TBB)
  const int before = omp_get_max_threads();
  for (int threads : {1, 2, 5}) {
    omp_set_num_threads(threads);
    INFO(threads << " OpenMP threads");
    CHECK(picture<Exec>(1) == first);
  }
  omp_set_num_threads(before);
#endif
}

}  // namespace

#if !defined(WFPG_TEST_ONLY_TBB)
TEST_CASE("path guider: policies of one warp width give the same bits", "[path_guider]") {
  const std::vector<float> serial = picture<wfpg::exec::seq>(1);
  CHECK(picture<wfpg::exec::omp>(1) == serial);
  CHECK(picture<wfpg::exec::tbb>(1) == serial);
  CHECK(picture<wfpg::exec::basic_omp<8>>(1) == picture<wfpg::exec::basic_seq<8>>(1));
  CHECK(picture<wfpg::exec::basic_tbb<8>>(1) == picture<wfpg::exec::basic_seq<8>>(1));
}

TEST_CASE("path guider: guiders of several policies live side by side", "[path_guider]") {
  guided_box<wfpg::exec::seq> serial;
  guided_box<wfpg::exec::omp> openmp;
  guided_box<wfpg::exec::tbb> threads;
  guided_box<wfpg::exec::tbb> another(box_options(guiding_mode::plain));
  serial.learn();
  another.learn();
  openmp.learn();
  threads.learn();
  const auto surfaces = mixed_surfaces(400, 6);
  const auto expected = serial.sample(surfaces);
  const auto plain = another.sample(surfaces);
  CHECK(same_bits(openmp.sample(surfaces), expected));
  CHECK(same_bits(threads.sample(surfaces), expected));
  CHECK(same_bits(serial.sample(surfaces), expected));
  CHECK(!same_bits(plain, expected));
}
#endif
