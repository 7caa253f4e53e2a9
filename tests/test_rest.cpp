// A guide that rests: the gain that decides, and guiders whose paths gain much, little or nothing.
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/wall_paths.hpp"

#include <wfpg/guide_file.hpp>
#include <wfpg/path_guider.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

using namespace wfpg_test;
using wfpg::guiding_gain;

namespace {

using numbers = std::vector<std::uint32_t>;

constexpr std::uint32_t path_count = wall_path::count;

/// Probabilities of unguided and of guided paths. The variance of a pixel is its squared mean times
/// 1 / probability - 1. Unguided ones are noisy enough to be compared at once.
struct chances {
  float unguided, guided;
};
constexpr chances gains_much{0.25f, 0.5f}, gains_surely{0.48f, 0.7347f}, gains_more{0.48f, 0.8926f},
    loses{0.48f, 0.381f};

template <class Exec, class Guide>
void take_sample(const Exec& exec, wfpg::path_guider<Exec, Guide>& guider, std::uint32_t sample, chances p,
                 std::uint32_t paths = path_count, std::uint32_t shift = 0) {
  guider.begin_sample();
  const float probability = guider.guided() ? p.guided : p.unguided;
  exec.for_each(paths, record_wall_paths{guider.recorder(), sample, probability, shift});
  guider.end_sample();
}

/// Numbers of the samples from `first` to `last` that are guided.
template <class Exec, class Guide>
numbers guided_samples(const Exec& exec, wfpg::path_guider<Exec, Guide>& guider, std::uint32_t first,
                       std::uint32_t last, chances p, std::uint32_t paths = path_count) {
  numbers found;
  for (std::uint32_t sample = first; sample <= last; ++sample) {
    take_sample(exec, guider, sample, p, paths);
    if (guider.guided()) found.push_back(sample);
    if (guider.guided() && guider.resting()) found.push_back(0);  // unguided samples are neither
  }
  return found;
}

/// The unit of a path's differences, by other functions than the meter's.
struct scale_of_path {
  wfpg::exitance_cache_view cache;

  WFPG_HD float operator()(std::size_t i) const {
    const wall_path at = wall_path::of(static_cast<std::uint32_t>(i));
    const wfpg::sparse_voxel_octree_view& tree = cache.octree();
    const wfpg::node_id above = tree.ancestor(tree.leaf_at(at.position), tree.depth() - 4);
    return cache.read(above, at.normal) + (cache.read(0, 0u) + cache.read(0, 1u)) / 2.0f;
  }
};

/// The variances by definition, in doubles. `bias`: multiplies squared differences.
guiding_gain brute_force(const std::vector<float>& scales, const numbers& unguided, std::uint32_t earlier,
                         std::uint32_t now, chances p, double bias = 1.0) {
  double of_unguided = 0.0, of_guided = 0.0;
  const double pairs = static_cast<double>(unguided.size() * (unguided.size() - 1)) / 2.0;
  for (std::uint32_t path = 0; path < path_count; ++path) {
    const auto loss = [&](std::uint32_t a, std::uint32_t b, float probability) {
      const double d = std::abs(double(wall_path::radiance(path, a, probability)) -
                                double(wall_path::radiance(path, b, probability))) /
                       double(scales[path]);
      return bias * (d <= 8.0 ? d * d : 16.0 * d - 64.0) / path_count;
    };
    for (const std::uint32_t a : unguided)
      for (const std::uint32_t b : unguided)
        if (a < b) of_unguided += loss(a, b, p.unguided) / pairs;
    of_guided += loss(earlier, now, p.guided);
  }
  guiding_gain result;
  result.unguided_variance = of_unguided / 2.0;
  result.guided_variance = of_guided / 2.0;
  return result;
}

/// The gain that sample 8 measures, and the units of its differences.
struct measured_gain {
  guiding_gain gain;
  std::vector<float> scales;
};
template <class Exec>
measured_gain gain_of_sample_8(const Exec& exec, float least_gain, chances p) {
  wfpg::kept_guide_options options = rest_options();
  options.least_gain = least_gain;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options);
  guided_samples(exec, guider, 1, 7, p);
  measured_gain result{{}, evaluate(exec, std::size_t(path_count), scale_of_path{guider.guide().cache()})};
  const guiding_gain before = guider.statistics().gain;
  take_sample(exec, guider, 8, p);
  result.gain = guider.statistics().gain;  // the mean of both comparisons
  result.gain.guided_variance = 2.0 * result.gain.guided_variance - before.guided_variance;
  result.gain.unguided_variance = 2.0 * result.gain.unguided_variance - before.unguided_variance;
  return result;
}

WFPG_TEST_CASE("rest: a guider measures the variances of its paths", "[rest]") {
  const Exec exec;
  const auto [measured, scales] = gain_of_sample_8(exec, 1.25f, gains_much);
  const guiding_gain expected = brute_force(scales, {1, 2}, 4, 8, gains_much);
  CHECK(measured.paths == path_count);
  CHECK(measured.guided_variance == Approx(expected.guided_variance).epsilon(1.0e-4));
  CHECK(measured.unguided_variance == Approx(expected.unguided_variance).epsilon(1.0e-4));
  // 3 by the probabilities, and less by differences that count linearly.
  CHECK(std::abs(measured.value() - 3.0) < 0.3);
  CHECK(std::abs(measured.unguided_mean / measured.guided_mean - 1.0) < 0.1);
  // The check above would notice 1% of bias.
  const guiding_gain biased = brute_force(scales, {1, 2}, 4, 8, gains_much, 1.01);
  CHECK(measured.guided_variance != Approx(biased.guided_variance).epsilon(1.0e-4));
  CHECK(measured.unguided_variance != Approx(biased.unguided_variance).epsilon(1.0e-4));
}

WFPG_TEST_CASE("rest: a guide that goes on probing compares all pairs of three unguided samples", "[rest]") {
  const Exec exec;
  const auto [measured, scales] = gain_of_sample_8(exec, 8.0f, gains_surely);
  const guiding_gain expected = brute_force(scales, {1, 2, 5}, 4, 8, gains_surely);
  CHECK(measured.guided_variance == Approx(expected.guided_variance).epsilon(1.0e-4));
  CHECK(measured.unguided_variance == Approx(expected.unguided_variance).epsilon(1.0e-4));
}

WFPG_TEST_CASE("rest: large differences of paths count linearly", "[rest]") {
  const Exec exec;
  constexpr chances bright{0.03f, 0.06f};  // radiance of up to 33 times a pixel's mean
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), rest_options());
  guided_samples(exec, guider, 1, 3, bright);
  const std::vector<float> scales =
      evaluate(exec, std::size_t(path_count), scale_of_path{guider.guide().cache()});
  take_sample(exec, guider, 4, bright);
  const guiding_gain measured = guider.statistics().gain;
  const guiding_gain expected = brute_force(scales, {1, 2}, 3, 4, bright);
  std::size_t large = 0;  // paths whose differences may be above 8
  for (std::uint32_t path = 0; path < path_count; ++path)
    large += wall_path::of(path).mean / bright.guided > 8.0f * scales[path];
  CHECK(large > 100);
  CHECK(measured.unguided_variance == Approx(expected.unguided_variance).epsilon(1.0e-4));
  CHECK(measured.guided_variance == Approx(expected.guided_variance).epsilon(1.0e-4));
}

WFPG_TEST_CASE("rest: a host that gives pixels other indices in each sample is not compared", "[rest]") {
  const Exec exec;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), rest_options());
  for (std::uint32_t sample = 1; sample <= 16; ++sample)
    take_sample(exec, guider, sample, loses, path_count, 997);
  CHECK(guider.statistics().gain.paths < 600);
  CHECK(guider.statistics().rested_samples == 0);
}

/// Records paths whose gain is 1. One of 1000 is so bright that it holds most of the variance.
struct record_bright_paths {
  wfpg::path_recorder_view recorder;
  std::uint32_t sample, seed;

  WFPG_HD void operator()(std::size_t i) const {
    const auto path = static_cast<std::uint32_t>(i);
    const wall_path at = wall_path::of(path);
    const vec2 u = wfpg::unit_vec2(wfpg::hash(wfpg::hash(wfpg::hash(3u, seed), sample), path));
    recorder.vertex(i, 0, at.position, at.normal, 1.0f);
    recorder.radiance(i, 0, at.mean * (u.x < 0.001f ? 12.0f : 0.8f + 0.4f * u.y));
  }
};

/// Gains of the first comparison, their errors, and how many guiders of `seeds` seeds guide all paths at some
/// time in 16 samples. `by_gain`: how many would by their gains alone. Comparisons begin after as many
/// samples as guides wait in little noise.
struct bright_gains {
  std::vector<double> logarithms, errors;
  std::uint32_t guide_all = 0, by_gain = 0;
};
template <class Exec>
bright_gains gains_of_bright_paths(const Exec& exec, std::uint32_t seeds) {
  constexpr std::uint32_t before = wfpg::rest_constants::longest_wait;
  bright_gains result;
  for (std::uint32_t seed = 0; seed < seeds; ++seed) {
    wfpg::kept_guide_options options = rest_options();
    options.unguided_samples = before + 1;
    wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options);
    bool guides_all = false, gains = false;
    for (std::uint32_t sample = 1; sample <= before + 16; ++sample) {
      guider.begin_sample();
      guides_all |= guider.guided() && !guider.probing();
      exec.for_each(path_count, record_bright_paths{guider.recorder(), sample, seed});
      guider.end_sample();
      const guiding_gain gain = guider.statistics().gain;
      gains |= sample >= before + 4 && gain.typical_value() >= 1.25;
      if (sample != before + 4) continue;
      result.logarithms.push_back(std::log(gain.typical_value()));
      result.errors.push_back(gain.typical_error);
    }
    result.guide_all += guides_all;
    result.by_gain += gains;
  }
  return result;
}

WFPG_TEST_CASE("rest: a gain's error is known, and few bright paths let no guide take part", "[rest]") {
  constexpr std::uint32_t seeds = 40;
  const bright_gains found = gains_of_bright_paths(Exec(), seeds);
  double square = 0.0, expected = 0.0;
  for (std::size_t i = 0; i < found.errors.size(); ++i) {
    square += found.logarithms[i] * found.logarithms[i] / seeds;
    expected += found.errors[i] * found.errors[i] / seeds;
  }
  // Of 40 seeds the standard deviation is known to 11%.
  INFO("deviation " << std::sqrt(square) << ", error " << std::sqrt(expected));
  CHECK(square > 0.02);
  CHECK(std::abs(std::sqrt(square / expected) - 1.0) < 0.3);
  INFO(found.guide_all << " guide all paths, " << found.by_gain << " by their gains alone");
  CHECK(found.by_gain > seeds / 4);
  CHECK(found.guide_all <= seeds / 10);
}

WFPG_TEST_CASE("rest: in little noise a guide waits for 28 samples, and less where samples have more paths",
               "[rest]") {
  const Exec exec;
  constexpr chances calm{0.6f, 0.8571f};  // a gain of 4
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), rest_options());
  CHECK(guided_samples(exec, guider, 1, 40, calm) == numbers{31, 32, 33, 34, 35, 36, 37, 38, 39, 40});
  CHECK(guider.statistics().rested_samples == 26);
  CHECK(guider.statistics().guided_samples == 13);

  wfpg::kept_guide_options large = rest_options();
  large.max_paths = std::size_t(1) << 19;
  wfpg::path_guider<Exec> of_many(exec, box_mesh<Exec>(exec).view(), large);
  CHECK(guided_samples(exec, of_many, 1, 8, calm, 1u << 19) == numbers{7, 8});
}

WFPG_TEST_CASE("rest: two unguided samples show the unguided part of a gain, one shows none", "[rest]") {
  const Exec exec;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), rest_options());
  take_sample(exec, guider, 1, gains_much);
  const wfpg::exitance_cache_view cache = guider.guide().cache();
  wfpg::path_recorder<Exec> recorder(exec, {path_count, 2});
  wfpg::gain_meter<Exec> meter(exec, path_count);
  const auto keep = [&](std::uint32_t number) {
    recorder.begin_sample(exec, 0, true);
    exec.for_each(path_count, record_wall_paths{recorder.view(), number + 1, gains_much.unguided, 0});
    recorder.close_paths(exec);
    const guiding_gain found = meter.keep_unguided(exec, recorder, {}, cache, number);
    recorder.clear(exec);
    return found;
  };
  CHECK(keep(0).paths == 0);
  const guiding_gain found = keep(1);
  const std::vector<float> scales = evaluate(exec, std::size_t(path_count), scale_of_path{cache});
  CHECK(found.paths == path_count);
  CHECK(found.unguided_variance ==
        Approx(brute_force(scales, {1, 2}, 1, 2, gains_much).unguided_variance).epsilon(1.0e-4));
  CHECK(found.unguided_variance !=
        Approx(brute_force(scales, {1, 2}, 1, 2, gains_much, 1.01).unguided_variance).epsilon(1.0e-4));
  CHECK(found.guided_variance == 0.0);
  // By the probability 3, times the spread of means over their units.
  CHECK(found.noise() > 2.5);
  CHECK(found.noise() < 4.0);
}

template <class Exec, class Options>
numbers guided_of_40(const Exec& exec, const Options& options, chances p, std::uint32_t* rested = nullptr) {
  using guide = wfpg::octree_guide_for<Exec, Options>;
  wfpg::path_guider<Exec, guide> guider(exec, box_mesh<Exec>(exec).view(), options);
  take_sample(exec, guider, 1, p);
  CHECK(!guider.guided());
  const numbers found = guided_samples(exec, guider, 2, 40, p);
  if (rested) *rested = guider.statistics().rested_samples;
  CHECK(guider.statistics().guided_samples + guider.statistics().rested_samples == 39);
  return found;
}

WFPG_TEST_CASE("rest: a guide that gains nothing guides only what is compared", "[rest]") {
  const Exec exec;
  std::uint32_t rested = 0;
  CHECK(guided_of_40(exec, rest_options(), loses, &rested) == numbers{3, 4, 8, 16, 32});
  CHECK(rested == 33);
  wfpg::transient_guide_options transient;
  static_cast<wfpg::octree_guide_options&>(transient) = rest_options();
  CHECK(guided_of_40(exec, transient, loses) == numbers{3, 4, 8, 16, 32});
}

WFPG_TEST_CASE("rest: a guide that gains, one that must not rest, and one of few paths guide all samples",
               "[rest]") {
  const Exec exec;
  CHECK(guided_of_40(exec, rest_options(), gains_much).size() == 38);  // not sample 2, which is compared
  wfpg::kept_guide_options never = rest_options(), few = rest_options();
  never.least_gain = 0.0f;
  CHECK(guided_of_40(exec, never, loses).size() == 39);
  few.max_paths = 1000;
  CHECK(guided_of_40(exec, few, loses).size() == 39);
}

WFPG_TEST_CASE("rest: a gain below the option's lets a guide rest once it is settled", "[rest]") {
  const Exec exec;
  wfpg::kept_guide_options options = rest_options();
  options.least_gain = 8.0f;  // 3 is more than the 2.75 of sample 4, and less than the 4.5 of sample 8
  CHECK(guided_of_40(exec, options, gains_surely) == numbers{3, 4, 6, 7, 8, 16, 32});
}

WFPG_TEST_CASE("rest: unset, least_gain follows the triangles on CPUs, also of a guide that is loaded",
               "[rest]") {
  const Exec exec;
  wfpg::kept_guide_options options = rest_options();
  options.least_gain.reset();
  // A gain of 2: more than 1.75, less than 2.26 for 12 triangles.
  constexpr chances gains_two{0.48f, 0.6487f};
  const box_mesh<Exec> mesh(exec);
  const auto rests_after = [&](wfpg::path_guider<Exec>& guider, std::uint32_t first) {
    guided_samples(exec, guider, first, 17, gains_two);
    return guider.resting();
  };
  const bool on_cpu = Exec::warps_per_block == 1;
  wfpg::path_guider<Exec> of_mesh(exec, mesh.view(), options), begun(exec, mesh.view(), options);
  CHECK(rests_after(of_mesh, 1) == on_cpu);
  guided_samples(exec, begun, 1, 4, gains_two);
  std::ostringstream out;
  wfpg::save_guide(begun, out);
  std::istringstream in(out.str());
  wfpg::path_guider<Exec> loaded = wfpg::load_guide(exec, in, options);
  CHECK(rests_after(loaded, 5) == on_cpu);
  wfpg::path_guider<Exec> unknown(exec, wfpg::voxelize(exec, mesh.view(), options.octree_resolution),
                                  options);
  CHECK(!rests_after(unknown, 1));
}

WFPG_TEST_CASE("rest: directions of samples that rest are the BSDF's, and nothing is recorded", "[rest]") {
  const Exec exec;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), rest_options());
  guided_samples(exec, guider, 1, 4, loses);
  guider.begin_sample();
  REQUIRE(guider.resting());
  std::vector<test_surface> surfaces;
  for (std::uint32_t path = 0; path < 500; ++path)
    surfaces.push_back(
        make_surface(wall_path::of(path).position, wall_path::of(path).normal, wall_path::of(path).normal));
  const wave_of_surfaces<Exec> wave(exec, surfaces);
  const wfpg::buffer<wfpg::sampled_direction, Exec> drawn(exec, surfaces.size());
  guider.sample_directions(wave.get(), box_caster(), drawn.view());
  for (const wfpg::sampled_direction& d : drawn.to_host(exec)) {
    CHECK(d.technique == wfpg::sampling_technique::bsdf);
    CHECK(d.field == wfpg::no_field);
  }
  const wfpg::guide_view view = guider.prepare(wave.get(), box_caster());
  CHECK(count_guided(exec, view, surfaces.size()) == 0);
  CHECK(guider.recorder().recorded() == 0);
  guider.end_sample();
}

struct find_lights {
  wfpg::light_guide_view lights;
  std::uint32_t group;
  WFPG_HD float operator()() const {
    const wall_path at = wall_path::of(0);
    return lights.probability(lights.find(at.position, at.normal), group);
  }
};

struct deposit_lights {
  wfpg::light_guide_view lights;
  WFPG_HD void operator()(std::size_t i) const {
    const auto path = static_cast<std::uint32_t>(i);
    const wall_path at = wall_path::of(path);
    const wfpg::light_choice choice =
        lights.choose(lights.find(at.position, at.normal), wfpg::unit_vec2(wfpg::hash(5u, path)).x);
    lights.deposit(path, choice.key, choice.group == 1 ? 5.0f : 0.0f);
  }
};

/// A guider with two lights, after samples 1 to `last`.
template <class Exec>
wfpg::path_guider<Exec> guider_of_lights(const Exec& exec, float least_gain, std::uint32_t last, chances p,
                                         std::vector<float> weights = {1.0f, 1.0f}) {
  wfpg::kept_guide_options options = rest_options();
  options.least_gain = least_gain;
  options.lights.weights = std::move(weights);
  options.lights.resolution = 4;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options);
  guided_samples(exec, guider, 1, last, p);
  return guider;
}

WFPG_TEST_CASE("rest: choices of lights learn while the guide rests, where they may be what gains",
               "[rest]") {
  const Exec exec;
  wfpg::path_guider<Exec> guider = guider_of_lights(exec, 8.0f, 8, gains_surely);
  const float before = evaluate(exec, find_lights{guider.lights(), 1});
  for (int sample = 9; sample < 12; ++sample) {
    guider.begin_sample();
    REQUIRE(guider.resting());
    exec.for_each(path_count, deposit_lights{guider.lights()});
    guider.end_sample();
  }
  CHECK(before == Approx(0.5f));
  CHECK(evaluate(exec, find_lights{guider.lights(), 1}) > 0.7f);
}

WFPG_TEST_CASE("rest: choices of lights learn while a guide waits, and are by weight in very little noise",
               "[rest]") {
  const Exec exec;
  for (const bool is_noisy : {true, false}) {
    wfpg::path_guider<Exec> guider =
        guider_of_lights(exec, 1.25f, 2, is_noisy ? chances{0.6f, 0.5f} : chances{0.95f, 0.9f}, {1.0f, 3.0f});
    for (int sample = 3; sample < 6; ++sample) {
      guider.begin_sample();
      REQUIRE(guider.resting());
      exec.for_each(path_count, deposit_lights{guider.lights()});
      guider.end_sample();
    }
    const float second = evaluate(exec, find_lights{guider.lights(), 1});
    CHECK((is_noisy ? second > 0.9f : second == 0.75f));
  }
}

WFPG_TEST_CASE("rest: choices of lights are by weight where nothing is gained, but for compared samples",
               "[rest]") {
  const Exec exec;
  wfpg::path_guider<Exec> guider = guider_of_lights(exec, 1.25f, 3, loses, {1.0f, 3.0f});
  for (std::uint32_t sample = 4; sample <= 9; ++sample) {
    guider.begin_sample();
    const float probability = guider.guided() ? loses.guided : loses.unguided;
    exec.for_each(path_count, record_wall_paths{guider.recorder(), sample, probability, 0});
    exec.for_each(path_count, deposit_lights{guider.lights()});
    const float second = evaluate(exec, find_lights{guider.lights(), 1});
    if (guider.resting()) CHECK(second == 0.75f);
    if (sample == 8) CHECK(second > 0.9f);
    CHECK(guider.resting() == (sample > 4 && sample != 8));
    CHECK(evaluate(exec, find_lights{guider.lights(), 0}) == Approx(1.0f - second));
    guider.end_sample();
  }
}

WFPG_TEST_CASE("rest: a sample that is ended again is not compared with itself", "[rest]") {
  const Exec exec;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), rest_options());
  guided_samples(exec, guider, 1, 4, loses);
  const guiding_gain measured = guider.statistics().gain;
  guider.end_sample();
  CHECK(guider.statistics().gain.guided_variance == measured.guided_variance);
  CHECK(guider.statistics().gain.paths == measured.paths);
  guider.begin_sample();
  CHECK(guider.resting());
}

/// A host of `paths` paths. They are recorded in part where `deposits_per_leaf` is set.
template <class Exec>
guiding_gain gain_of_many(const Exec& exec, std::uint32_t paths,
                          std::optional<std::uint32_t> deposits_per_leaf) {
  wfpg::kept_guide_options options = rest_options();
  options.max_paths = paths;
  options.deposits_per_leaf = deposits_per_leaf;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), options);
  for (std::uint32_t sample = 1; sample <= 4; ++sample) take_sample(exec, guider, sample, gains_much, paths);
  return guider.statistics().gain;
}

WFPG_TEST_CASE("rest: paths that are recorded or measured in part are the same ones in each sample",
               "[rest]") {
  const Exec exec;
  const guiding_gain recorded = gain_of_many(exec, 60000, 1),
                     measured = gain_of_many(exec, 150000, std::nullopt);
  CHECK(recorded.paths > 3000);
  CHECK(recorded.paths < 20000);
  CHECK(measured.paths > 9000);
  CHECK(measured.paths <= 16384);
  CHECK(std::abs(recorded.value() - 3.0) < 0.5);
  CHECK(std::abs(measured.value() - 3.0) < 0.3);
}

WFPG_TEST_CASE("rest: a guide wakes up where light, geometry or the camera moved", "[rest]") {
  const Exec exec;
  using guider_type = wfpg::path_guider<Exec>;
  for (const auto move :
       {+[](guider_type& g) { g.forget_light(); }, +[](guider_type& g) { g.invalidate_all(); },
        +[](guider_type& g) { g.compare_anew(); },
        +[](guider_type& g) {
          g.invalidate({vec3(0.4f), vec3(0.6f)});
        }}) {
    guider_type guider(exec, box_mesh<Exec>(exec).view(), rest_options());
    guided_samples(exec, guider, 1, 10, loses);
    move(guider);
    for (const std::uint32_t sample : {11u, 12u}) {  // the new unguided samples
      take_sample(exec, guider, sample, gains_much);
      CHECK(!guider.guided());
      CHECK(!guider.resting());
    }
    CHECK(guided_samples(exec, guider, 13, 40, gains_much).size() == 28);

    guider_type waiting(exec, box_mesh<Exec>(exec).view(), rest_options());
    guided_samples(exec, waiting, 1, 10, {0.6f, 0.5f});
    REQUIRE(waiting.resting());
    move(waiting);
    for (const std::uint32_t sample : {11u, 12u}) {
      take_sample(exec, waiting, sample, gains_much);
      CHECK(!waiting.resting());
    }
    CHECK(guided_samples(exec, waiting, 13, 40, gains_much).size() == 28);
  }
}

template <class Exec>
std::string saved(const wfpg::path_guider<Exec>& guider) {
  std::ostringstream out;
  wfpg::save_guide(guider, out);
  return out.str();
}

WFPG_TEST_CASE("rest: a guide that is saved and loaded goes on as it would have", "[rest]") {
  const Exec exec;
  constexpr chances waits{0.6f, 0.5f};
  for (const auto& [until, p] : std::vector<std::pair<std::uint32_t, chances>>{{1, loses},
                                                                               {3, loses},
                                                                               {6, loses},
                                                                               {8, loses},
                                                                               {20, loses},
                                                                               {2, waits},
                                                                               {28, waits},
                                                                               {30, waits}}) {
    wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), rest_options());
    guided_samples(exec, guider, 1, until, p);
    const std::string bytes = saved(guider);
    std::istringstream in(bytes);
    wfpg::path_guider<Exec> loaded = wfpg::load_guide(exec, in, rest_options());
    CHECK(saved(loaded) == bytes);
    CHECK(loaded.guided() == guider.guided());
    CHECK(loaded.resting() == guider.resting());
    CHECK(guided_samples(exec, loaded, until + 1, 40, p) == guided_samples(exec, guider, until + 1, 40, p));
    CHECK(saved(loaded) == saved(guider));
  }
}

WFPG_TEST_CASE("rest: a guide that is loaded with other options never rests", "[rest]") {
  const Exec exec;
  wfpg::path_guider<Exec> guider(exec, box_mesh<Exec>(exec).view(), rest_options());
  guided_samples(exec, guider, 1, 10, loses);
  const std::string bytes = saved(guider);
  for (const auto change : {+[](wfpg::kept_guide_options& o) { o.seed = 1; },
                            +[](wfpg::kept_guide_options& o) { o.unguided_samples = 0; },
                            +[](wfpg::kept_guide_options& o) { o.least_gain = 0.0f; }}) {
    wfpg::kept_guide_options options = rest_options();
    change(options);
    std::istringstream in(bytes);
    wfpg::path_guider<Exec> loaded = wfpg::load_guide(exec, in, options);
    CHECK(guided_samples(exec, loaded, 11, 40, loses).size() == 30);
  }
  wfpg::kept_guide_options late = rest_options();
  late.unguided_samples = 3;
  wfpg::path_guider<Exec> begun(exec, box_mesh<Exec>(exec).view(), late);
  take_sample(exec, begun, 1, loses);
  std::istringstream in(saved(begun));
  wfpg::path_guider<Exec> loaded = wfpg::load_guide(exec, in, late);
  guided_samples(exec, loaded, 2, 3, loses);
  CHECK(guided_samples(exec, loaded, 4, 20, loses) == numbers{5, 6, 10, 18});
}

/// A host of many paths, of which few are guided while the guide probes.
template <class Exec>
struct probing_host {
  static constexpr std::uint32_t paths = 70000;

  Exec exec;
  wfpg::path_guider<Exec> guider{exec, box_mesh<Exec>(exec).view(), [] {
                                   wfpg::kept_guide_options options = rest_options();
                                   options.max_paths = paths;
                                   options.deposits_per_leaf.reset();
                                   options.least_gain = 3.3f;  // more than gains_surely has
                                   return options;
                                 }()};

  void take(std::uint32_t first, std::uint32_t last, chances p) {
    for (std::uint32_t sample = first; sample <= last; ++sample) take_sample(exec, guider, sample, p, paths);
  }
  /// Number of `n` rays with a field. `tells_paths`: surfaces have the indices of their paths.
  std::size_t guided_rays(std::uint32_t n, bool tells_paths) {
    std::vector<test_surface> surfaces;
    for (std::uint32_t path = 0; path < n; ++path) {
      const wall_path at = wall_path::of(path);
      surfaces.push_back(make_surface(at.position, at.normal, at.normal));
      if (tells_paths) surfaces.back().path = path;
    }
    const wave_of_surfaces<Exec> wave(exec, surfaces);
    return count_guided(exec, guider.prepare(wave.get(), box_caster()), n);
  }
};

WFPG_TEST_CASE("rest: until it is known whether guiding pays, few paths are recorded and guided", "[rest]") {
  probing_host<Exec> host;
  constexpr std::uint32_t n = 8000;
  host.take(1, 1, gains_surely);
  host.guider.begin_sample();
  CHECK(host.guided_rays(n, true) == 0);
  host.exec.for_each(host.paths, record_wall_paths{host.guider.recorder(), 2, gains_surely.unguided, 0});
  host.guider.end_sample();
  host.guider.begin_sample();
  CHECK(host.guider.guided());
  CHECK(host.guider.probing());
  const std::size_t recorded = host.guider.recorder().recorded();
  CHECK(recorded >= 4096);
  CHECK(recorded < host.paths / 8);
  std::size_t among = 0;
  for (std::uint32_t path = 0; path < n; ++path) {
    std::uint32_t place;
    const bool is_recorded = host.guider.recorder().has_place(path, place);
    among += is_recorded ? 1 : 0;
    CHECK(host.guider.guided_paths().includes(path) == is_recorded);
  }
  host.guided_rays(n, true);  // of two fields that are asked for at once, one may have to wait
  CHECK(host.guided_rays(n, true) == among);
  CHECK(host.guided_rays(n, false) == n);  // where the host does not tell paths
  host.exec.for_each(host.paths, record_wall_paths{host.guider.recorder(), 3, gains_surely.guided, 0});
  host.guider.end_sample();

  host.take(4, 9, gains_surely);
  host.take(10, 15, gains_more);
  CHECK(host.guider.probing());
  host.take(16, 16, gains_more);
  CHECK(host.guider.probing());  // until the next sample begins
  CHECK(host.guider.guided_paths().log2_divisor() > 0);
  host.guider.begin_sample();
  CHECK(!host.guider.probing());
  CHECK(host.guider.guided_paths() == wfpg::recorded_runs{});
  CHECK(host.guided_rays(n, true) == n);
  CHECK(host.guider.recorder().recorded() == host.paths);
}

WFPG_TEST_CASE("rest: a guide that probes, or did, is saved and goes on with the same bits", "[rest]") {
  for (const std::uint32_t until : {2u, 4u, 5u, 9u, 17u}) {
    probing_host<Exec> host;
    const auto go_on = [&](wfpg::path_guider<Exec>& guider, std::uint32_t from, std::uint32_t to) {
      std::swap(host.guider, guider);
      for (std::uint32_t sample = from; sample <= to; ++sample) {
        host.guider.begin_sample();
        host.guided_rays(4000, true);
        const chances p = sample < 10 ? gains_surely : gains_more;
        host.exec.for_each(host.paths, record_wall_paths{host.guider.recorder(), sample,
                                                         host.guider.guided() ? p.guided : p.unguided, 0});
        host.guider.end_sample();
      }
      std::swap(host.guider, guider);
    };
    wfpg::path_guider<Exec> guider = std::move(host.guider);
    host.guider = wfpg::path_guider<Exec>(host.exec, box_mesh<Exec>(host.exec).view(), guider.options());
    go_on(guider, 1, until);
    const std::string bytes = saved(guider);
    std::istringstream in(bytes);
    wfpg::path_guider<Exec> loaded = wfpg::load_guide(host.exec, in, guider.options());
    CHECK(saved(loaded) == bytes);
    go_on(guider, until + 1, 20);
    go_on(loaded, until + 1, 20);
    CHECK(guider.sample_weight() == loaded.sample_weight());
    CHECK(saved(loaded) == saved(guider));
  }
}

WFPG_TEST_CASE("rest: a sample weighs as much as the gain that was measured before it", "[rest]") {
  probing_host<Exec> host;
  for (std::uint32_t sample = 1; sample <= 20; ++sample) {
    host.take(sample, sample, sample < 10 ? gains_surely : gains_more);
    const float weight = host.guider.sample_weight();
    if (host.guider.probing() || !host.guider.guided()) CHECK(weight == 1.0f);
    // By the probabilities guided variances are 1/3 and 2/9, and their mean 5/18, of the unguided one.
    if (sample > 16) CHECK(std::abs(weight - 3.6f) < 0.6f);
  }
  probing_host<Exec> resting;
  for (std::uint32_t sample = 1; sample <= 20; ++sample) {
    resting.take(sample, sample, loses);
    CHECK(resting.guider.sample_weight() == 1.0f);
  }
  CHECK(resting.guider.resting());
}

TEST_CASE("rest: a least gain below 1 that is not 0 is refused", "[rest]") {
  const host_policy exec;
  wfpg::kept_guide_options options = rest_options();
  for (const float bad : {-1.0f, 0.99f, 2.0e6f, std::numeric_limits<float>::quiet_NaN()}) {
    options.least_gain = bad;
    const box_mesh<host_policy> mesh(exec);
    CHECK(refusal([&] { wfpg::path_guider<host_policy>(exec, mesh.view(), options); }).find("least_gain") !=
          std::string::npos);
  }
}

}  // namespace
