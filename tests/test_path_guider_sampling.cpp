// The directions of a guider. They do not depend on the number of threads, have the mixture's density, and
// are unbiased.
#include "support/guiding.hpp"
#include "support/kinds_of_guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/threads.hpp"

#include <wfpg/path_guider.hpp>

#include <cmath>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::guiding_mode;
using wfpg::sampled_direction;
using wfpg::sampling_technique;

namespace {

struct query_view {
  wfpg::guide_view view;
  stored_surfaces surfaces;
  wfpg::array_view<const vec3> queries;
  wfpg::array_view<float> densities;
  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const test_surface s = surfaces(ray);
    densities[i] = s.active && queries[i] != vec3(0.0f) ? view.pdf(ray, s, queries[i]) : 0.0f;
  }
};

struct stored_queries {
  wfpg::array_view<const vec3> queries;
  WFPG_HD vec3 operator()(std::uint32_t ray) const { return queries[ray]; }
};

/// Equality of floats as in same_draws().
bool nearly(float a, float b) {
  return same_operations_same_bits ? a == b : std::fabs(a - b) <= 1.0e-3f * b;
}
std::size_t excepted(std::size_t rays) {
  return same_operations_same_bits ? 0 : rays / 100;
}

WFPG_TEST_CASE("path guider: queries return the density that sampling has", "[path_guider]") {
  for (const guider_options& options : kinds_of_guiding()) {
    INFO(describe(options));
    guided_box<Exec> box(options);
    box.learn();
    const auto surfaces = mixed_surfaces(700, 5);
    const wfpg::buffer<test_surface, Exec> stored(box.exec, surfaces);
    const auto drawn = box.sample_again(surfaces);
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
    const auto drawn_again = again.to_host(box.exec);
    CHECK(same_draws(drawn_again, drawn));
    const wfpg::guide_view view = box.guider.prepare(wave, box_caster{});
    box.exec.for_each(asked.size(), query_view{view, all, const_view<vec3>(queries), prepared.view()});
    const auto densities = fused.to_host(box.exec), in_two_steps = prepared.to_host(box.exec);
    std::size_t wrong = 0, differing = 0, answered = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      const bool none = asked[i] == vec3(0.0f) || drawn[i].technique == sampling_technique::delta;
      wrong += !nearly(densities[i], none ? 0.0f : drawn_again[i].pdf);
      differing += !nearly(in_two_steps[i], densities[i]);
      answered += !none;
    }
    CHECK(wrong <= excepted(drawn.size()));
    CHECK(differing <= excepted(drawn.size()));
    CHECK(answered > 400);
  }
}

/// The default fraction of guided directions. Smaller for transient fields with few rays.
float default_fraction(const guider_options& options, bool many_rays) {
  if (options.mode == guiding_mode::plain) return 0.5f;
  return many_rays || options.fields == field_lifetime::kept ? 0.7f : 0.5f;
}

/// Densities of a ray's field for a given direction, and for one that it samples.
struct asked_of_field {
  float pdf;
  sampled_direction alone;
  float pdf_of_alone;
};

struct ask_field {
  wfpg::guide_view view;
  std::uint32_t ray;
  vec3 direction;
  WFPG_HD asked_of_field operator()() const {
    const sampled_direction alone = view.sample(ray, {0.3f, 0.8f});
    return {view.pdf(ray, direction), alone, view.pdf(ray, alone.direction)};
  }
};

WFPG_TEST_CASE("path guider: densities are those of the mixture of field and BSDF", "[path_guider]") {
  for (guider_options options : kinds_of_guiding())
    for (float fraction : {0.0f, 0.25f, 1.0f}) {
      INFO(describe(options) << ", fraction " << fraction);
      options.guide_fraction = unless_zero(fraction);
      options.binning.rays_per_bin = 400;
      options.binning.min_level = 1;
      guided_box<Exec> box(options);
      box.learn();
      std::vector<test_surface> surfaces(450, make_surface({0.4f, 0, 0.4f}, {0, 1, 0}, {0, 1, 0}));
      surfaces.resize(460, make_surface({1, 0.1f, 0.1f}, {-1, 0, 0}, {-1, 0, 0}));
      const auto drawn = box.sample_again(surfaces);
      const wave_of_surfaces<Exec> wave(box.exec, surfaces);
      const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
      for (std::uint32_t ray : {0u, 7u, 455u}) {
        const float given = fraction > 0.0f ? fraction : default_fraction(options, ray < 450);
        const float expected_fraction = wfpg::resident_field(vec3(0.0f), given).fraction();  // as stored
        const vec3 d = drawn[ray].direction;
        const float of_bsdf = surfaces[ray].bsdf.pdf(surfaces[ray].outgoing, d);
        const asked_of_field asked = evaluate(box.exec, ask_field{view, ray, d});
        CHECK(drawn[ray].pdf == Approx(expected_fraction * asked.pdf + (1.0f - expected_fraction) * of_bsdf));
        CHECK(asked.alone.pdf == asked.pdf_of_alone);
        CHECK(asked.alone.technique == sampling_technique::guide);
      }
      if (fraction == 1.0f) CHECK(count_guided(drawn) == 460);
    }
}

/// The probability that a direction of a ray's field hits the patch, by a midpoint rule over the patch.
struct patch_probability {
  wfpg::guide_view view;
  stored_surfaces surfaces;
  WFPG_HD double operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const vec3 from = surfaces(ray).position;
    constexpr int n = 30;
    const double step = (double(patch_high) - double(patch_low)) / n;
    double sum = 0.0;
    for (int k = 0; k < n * n; ++k) {
      const double x = double(patch_low) + (k % n + 0.5) * step, z = double(patch_low) + (k / n + 0.5) * step;
      const vec3 to = vec3(float(x), 1.0f, float(z)) - from;
      const double square = double(glm::dot(to, to));
      sum += double(view.pdf(ray, glm::normalize(to))) * std::abs(double(to.y)) / std::pow(square, 1.5);
    }
    return sum * step * step;
  }
};

/// Mean of a ray's probability over samples after warm-up, and over seeds. Kept cells change slowly.
template <class Exec>
std::vector<double> mean_patch_probability(guider_options options, const std::vector<test_surface>& surfaces,
                                           std::uint32_t rays) {
  std::vector<double> mean(rays, 0.0);
  for (options.seed = 1; options.seed <= 6; ++options.seed) {
    guided_box<Exec> box(options);
    box.learn();
    const wave_of_surfaces<Exec> wave(box.exec, surfaces);
    for (int sample = 0; sample < 16; ++sample) {
      const wfpg::guide_view view = box.guider.prepare(wave.get(), box_caster{});
      const auto found = evaluate(box.exec, rays, patch_probability{view, wave.get().surfaces});
      for (std::uint32_t i = 0; sample >= 4 && i < rays; ++i) mean[i] += found[i] / (12.0 * 6.0);
      box.guider.end_sample();
      box.guider.begin_sample();
    }
  }
  return mean;
}

WFPG_TEST_CASE("path guider: transient fields are cast anew in each sample", "[path_guider]") {
  guided_box<Exec> box(field_lifetime::transient);
  box.learn();
  const auto surfaces = wall_surfaces(600, 7);
  const auto drawn = box.sample(surfaces);
  CHECK(same_draws(box.sample(surfaces), drawn));
  box.guider.end_sample();
  box.guider.begin_sample();
  CHECK(!same_draws(box.sample(surfaces), drawn));
}

WFPG_TEST_CASE("path guider: kept fields find the patch as transient fields do", "[path_guider]") {
  const vec3 places[] = {{0.2f, 0, 0.3f}, {0.6f, 0, 0.7f}, {0.0f, 0.3f, 0.6f}, {0.4f, 0.2f, 0.0f}};
  const vec3 normals[] = {{0, 1, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  std::vector<test_surface> surfaces;
  for (int i = 0; i < 400; ++i)
    surfaces.push_back(make_surface(places[i % 4], normals[i % 4], normals[i % 4]));
  for (guiding_mode mode : modes) {
    const auto kept = mean_patch_probability<Exec>(box_options(mode), surfaces, 4);
    const auto transient =
        mean_patch_probability<Exec>(box_options(mode, field_lifetime::transient), surfaces, 4);
    for (std::size_t i = 0; i < 4; ++i) {
      INFO("place " << i << ", " << kept[i] << " kept, " << transient[i] << " transient");
      CHECK(kept[i] > 0.03);  // at most 0.003 of uniform directions
      CHECK(kept[i] == Approx(transient[i]).epsilon(0.25));
    }
  }
}

struct estimate {
  double z = 0.0;         ///< deviation from the exact value, in standard errors
  double variance = 0.0;  ///< of one sample, around the exact value of its point
};

/// The patch's irradiance at points on the floor, estimated with guided samples.
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
    for (const guider_options& options : kinds_of_guiding()) {
      guided_box<Exec> box(options);
      box.learn();
      const estimate guided = estimate_irradiance(box, kind);
      INFO(describe(options) << ", z " << guided.z << ", variance " << guided.variance << " guided, "
                             << bsdf.variance << " not");
      CHECK(std::abs(guided.z) < 4.0);
      CHECK(guided.variance < 0.5 * bsdf.variance);
    }
  }
}

/// A mean over paths, and its standard error.
struct mean_radiance {
  double mean = 0.0, error = 0.0;
};

template <class Exec>
mean_radiance trace_mean(guider_options options, bool guided) {
  constexpr std::size_t paths = 256;
  constexpr std::uint32_t samples = 24;
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  if (!guided) options.unguided_samples = samples;
  // Of so few paths one of the BSDF's alone may decide the error, the more so where fractions are learnt.
  options.guide_fraction = options.mode == guiding_mode::plain ? 0.5f : 0.7f;
  octree_guider<Exec> guider(exec, mesh.view(), options);
  double sum = 0.0, squares = 0.0;
  for (float radiance : trace_paths(exec, guider, samples, paths, box_caster{})) {
    sum += double(radiance);
    squares += double(radiance) * double(radiance);
  }
  CHECK(guider.statistics().guided_samples == (guided ? samples - 1 : 0));
  CHECK(guider.statistics().deposits.total() == 0);
  const double n = double(paths) * samples, mean = sum / n;
  return {mean, std::sqrt((squares / n - mean * mean) / n)};
}

WFPG_TEST_CASE("path guider: paths that learn on the way have the mean of unguided ones", "[path_guider]") {
  const mean_radiance unguided = trace_mean<Exec>(tracing_options(256), false);
  for (guiding_mode mode : modes)
    for (field_lifetime lifetime : lifetimes) {
      const mean_radiance guided = trace_mean<Exec>(tracing_options(256, mode, lifetime), true);
      INFO(describe(tracing_options(1, mode, lifetime))
           << ": " << guided.mean << " +- " << guided.error << " guided, " << unguided.mean << " +- "
           << unguided.error << " not");
      CHECK(std::abs(guided.mean - unguided.mean) < 4.0 * std::hypot(guided.error, unguided.error));
      // Plain transient fields gain little where so few rays share a bin.
      CHECK(guided.error < (mode == guiding_mode::plain ? 1.2 : 1.0) * unguided.error);
    }
}

/// Results of a guider over samples and depths, for a seed.
template <class Exec>
std::vector<float> picture(std::uint64_t seed, field_lifetime lifetime, bool batch = false) {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  guider_options options = tracing_options(800, guiding_mode::oriented, lifetime);
  options.octree_resolution = 4;  // many deposits per voxel, whose order depends on threads
  options.seed = seed;
  octree_guider<Exec> guider(exec, mesh.view(), options);
  batch_box_caster::log log;
  return batch ? trace_paths(exec, guider, 4, 800, batch_box_caster{{}, &log})
               : trace_paths(exec, guider, 4, 800, box_caster{});
}

WFPG_TEST_CASE("path guider: one seed gives the same bits on any number of threads", "[path_guider]") {
  for (field_lifetime lifetime : lifetimes) {
    INFO(name_of(lifetime));
    const std::vector<float> first = picture<Exec>(1, lifetime);
    CHECK(picture<Exec>(1, lifetime) == first);
    const std::vector<float> by_batches = picture<Exec>(1, lifetime, true);
    std::size_t differing = 0;
    for (std::size_t i = 0; i < first.size(); ++i) differing += !nearly(by_batches[i], first[i]);
    CHECK(differing <= excepted(first.size()));
    CHECK(picture<Exec>(2, lifetime) != first);
    with_threads([&](const std::string& threads) {
      INFO(threads);
      CHECK(picture<Exec>(1, lifetime) == first);
    });
  }
}

}  // namespace

#if defined(WFPG_TEST_SEVERAL_POLICIES)
TEST_CASE("path guider: policies of one warp width give the same bits", "[path_guider]") {
  for (field_lifetime lifetime : lifetimes) {
    INFO(name_of(lifetime));
    check_equal_on_backends([&] { return picture<one_policy>(1, lifetime); });
    check_equal_on_backends([&] { return picture<basic_chosen<8>>(1, lifetime); });
  }
}

TEST_CASE("path guider: guiders of several policies work side by side", "[path_guider]") {
  for (field_lifetime lifetime : lifetimes) {
    guided_box<wfpg::exec::seq> serial(lifetime);
    guided_box<wfpg::exec::omp> openmp(lifetime);
    guided_box<wfpg::exec::tbb> threads(lifetime);
    guided_box<wfpg::exec::tbb> another(box_options(guiding_mode::plain, lifetime));
    serial.learn();
    another.learn();
    openmp.learn();
    threads.learn();
    const auto surfaces = mixed_surfaces(400, 6);
    const auto expected = serial.sample_again(surfaces);
    const auto plain = another.sample_again(surfaces);
    CHECK(same_bits(openmp.sample_again(surfaces), expected));
    CHECK(same_bits(threads.sample_again(surfaces), expected));
    CHECK(same_bits(serial.sample(surfaces), expected));
    CHECK(!same_bits(plain, expected));
  }
}
#endif
