// The statistics kit: correct samplers pass, and each broken one is found and named.
#include "support/catch.hpp"
#include "support/fields.hpp"
#include "support/policies.hpp"
#include "support/reports.hpp"
#include "support/scenes.hpp"
#include "support/statistics.hpp"

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::directional_field;

namespace {

constexpr std::size_t samples = 200000;
constexpr std::uint32_t cells = 16;

/// A field's sampler with open steps, so that tests can break each of them.
class open_sampler {
 public:
  open_sampler()
      : built_(exec_, field_values(field_kind::noise, cells, 5), cells, 0.2f), field_(built_.grid()) {}

  const directional_field& field() const { return field_; }
  float pdf(vec3 d) const { return field_.pdf(d); }

  /// Directions of `where(uv)` for points uv of the field's square, with densities of `pdf`.
  std::vector<drawn_direction> draw(const std::function<vec2(vec2)>& where,
                                    const std::function<float(vec3)>& pdf, std::size_t n = samples) const {
    std::vector<drawn_direction> drawn;
    for (std::uint32_t i = 0; i < n; ++i) {
      const vec3 d = field_.direction(where(field_.grid().sample(hashed_numbers{3}(i, 0))));
      drawn.push_back({d, pdf(d)});
    }
    return drawn;
  }

 private:
  host_policy exec_;
  built_field<host_policy> built_;
  directional_field field_;
};

vec2 as_it_is(vec2 uv) {
  return uv;
}

/// Tiles of a renderer with normal noise, from sums of twelve uniform numbers.
tile_means rendered(double mean, std::uint64_t seed, int renderings = 24) {
  random_numbers random(seed);
  tile_means result(256);
  for (int rendering = 0; rendering < renderings; ++rendering) {
    std::vector<double> tiles;
    for (std::size_t tile = 0; tile < result.size(); ++tile) {
      double normal = -6.0;
      for (int i = 0; i < 12; ++i) normal += double(random.unit());
      tiles.push_back(mean + 0.1 * normal);
    }
    result.add(tiles);
  }
  return result;
}

}  // namespace

TEST_CASE("statistics: a correct sampler passes", "[statistics]") {
  const open_sampler sampler;
  const auto pdf = [&](vec3 d) { return sampler.pdf(d); };
  const sampler_report report = check_sampler(sampler.draw(as_it_is, pdf), each(pdf));
  INFO(report.message);
  CHECK(report);
  CHECK(report.frequencies.degrees > 100.0);
}

TEST_CASE("statistics: correct samplers are rejected with the chosen significance", "[statistics]") {
  int rejected = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    std::vector<drawn_direction> drawn;
    random_numbers random(seed);
    for (int i = 0; i < 4000; ++i) drawn.push_back({random.direction(), 0.25f / wfpg::pi});
    sampler_check_options options;
    options.significance = 0.05;
    rejected += !check_sampler(drawn, each([](vec3) { return 0.25f / wfpg::pi; }), options);
  }
  CHECK(rejected <= 12);  // 5 expected; 13 or more with 0.1%
}

TEST_CASE("statistics: a density wrong by 2% is found", "[statistics]") {
  const open_sampler sampler;
  const auto larger = [&](vec3 d) { return 1.02f * sampler.pdf(d); };
  check_names(check_sampler(sampler.draw(as_it_is, larger), each(larger)), {"energy", "integrates to 1.02"});

  // The sum is right: 2% too much above, too little below.
  double above = 0.0;
  for (std::uint32_t i = 0; i < cells * cells; ++i) {
    const vec2 uv = (vec2(float(i % cells), float(i / cells)) + 0.5f) / float(cells);
    const auto cell = double(sampler.field().grid().weight(i % cells, i / cells));
    if (sampler.field().direction(uv).z > 0.0f) above += cell / double(sampler.field().grid().total());
  }
  const auto tilted = [&](vec3 d) {
    const double factor = d.z > 0.0f ? 1.02 : (1.0 - 1.02 * above) / (1.0 - above);
    return float(factor) * sampler.pdf(d);
  };
  check_names(check_sampler(sampler.draw(as_it_is, tilted, 5 * samples), each(tilted)),
              {"frequencies", "observed", "expected", "p = "});
}

TEST_CASE("statistics: a cell shifted by one is found", "[statistics]") {
  const open_sampler sampler;
  const auto shifted = [](vec2 uv) { return vec2(glm::fract(uv.x + 1.0f / float(cells)), uv.y); };
  const auto pdf = [&](vec3 d) { return sampler.pdf(d); };
  check_names(check_sampler(sampler.draw(shifted, pdf), each(pdf)),
              {"frequencies", "observed", "expected", "z in [", "phi in [", "p = "});

  // With the density of the sampled cell too.
  std::vector<drawn_direction> drawn = sampler.draw(as_it_is, pdf);
  const std::vector<drawn_direction> moved = sampler.draw(shifted, pdf);
  for (std::size_t i = 0; i < drawn.size(); ++i) drawn[i].direction = moved[i].direction;
  check_names(check_sampler(drawn, each(pdf)), {"query", "was drawn with density", "pdf() says"});
}

TEST_CASE("statistics: a missing Jacobian is found", "[statistics]") {
  const open_sampler sampler;
  const auto of_the_square = [&](vec3 d) { return 4.0f * wfpg::pi * sampler.pdf(d); };
  check_names(check_sampler(sampler.draw(as_it_is, of_the_square), each(of_the_square)), {"energy", "12.57"});

  // Uniform in theta and phi, but reported as uniform over the sphere. The density integrates to one.
  std::vector<drawn_direction> drawn;
  const auto even = [](vec3) { return 0.25f / wfpg::pi; };
  for (std::uint32_t i = 0; i < samples; ++i) {
    const vec2 u = hashed_numbers{9}(i, 0);
    const float theta = wfpg::pi * u.x, phi = 2.0f * wfpg::pi * u.y;
    drawn.push_back(
        {{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)}, even({})});
  }
  check_names(check_sampler(drawn, each(even)), {"frequencies", "observed", "expected"});
}

TEST_CASE("statistics: a row that is never reached is found", "[statistics]") {
  const open_sampler sampler;
  const auto without_row = [](vec2 uv) {
    const bool missed = std::uint32_t(uv.y * float(cells)) == 7;
    return missed ? uv + vec2(0.0f, 1.0f / float(cells)) : uv;
  };
  const auto pdf = [&](vec3 d) { return sampler.pdf(d); };
  check_names(check_sampler(sampler.draw(without_row, pdf), each(pdf)),
              {"frequencies", "observed", "expected"});
}

TEST_CASE("statistics: tiles of two renderers differ if one is biased", "[statistics]") {
  const tile_means truth = rendered(1.0, 1);
  INFO(check_unbiased(truth, rendered(1.0, 2)).message);
  CHECK(check_unbiased(truth, rendered(1.0, 2)));
  check_names(check_unbiased(truth, rendered(1.2, 3)), {"standard errors apart"});
  // Too small for a single tile, whose mean has a standard error of 2%.
  check_names(check_unbiased(truth, rendered(1.02, 4)), {"tiles together"});
  // Too small for the sum of squares too.
  check_names(check_unbiased(truth, rendered(1.007, 4)), {"the picture", "standard errors apart"});
}

TEST_CASE("statistics: a tile that is not finite is biased", "[statistics]") {
  const tile_means truth = rendered(1.0, 1);
  for (const double bad : {std::nan(""), double(INFINITY), -double(INFINITY)}) {
    tile_means tested = rendered(1.0, 2);
    std::vector<double> tiles(tested.size(), 1.0);
    tiles[3] = bad;
    tested.add(tiles);
    check_names(check_unbiased(truth, tested), {"tile 3"});
  }
}

TEST_CASE("statistics: a failed check is repeated with more samples, and a bias fails again",
          "[statistics]") {
  std::vector<int> factors;
  const auto truth = [&](int factor) {
    factors.push_back(factor);
    return rendered(1.0, static_cast<std::uint64_t>(factor), 24 * factor);
  };
  const auto tested = [](double once, double anew) {
    return [=](int factor) { return rendered(factor == 1 ? once : anew, 7, 24 * factor); };
  };
  CHECK(check_renderers_unbiased(truth, tested(1.0, 1.2)));
  CHECK(factors == std::vector<int>{1});
  CHECK(check_renderers_unbiased(truth, tested(1.2, 1.0)));
  CHECK(factors == std::vector<int>{1, 1, 4});
  check_names(check_renderers_unbiased(truth, tested(1.2, 1.2)), {"standard errors apart"});
  // Too small for the first check, but not for the second.
  CHECK(check_renderers_unbiased(truth, tested(1.004, 1.004)));
  check_names(check_renderers_unbiased(truth, tested(1.2, 1.004)), {"the picture"});
  check_names(check_renderers_unbiased(truth, tested(1.2, 1.01)), {"tiles together"});
}

TEST_CASE("statistics: a bias in a picture's mean is found with the stated probability", "[statistics]") {
  // A bias of found_bias(), of either sign, is found in 99% of pairs. Without bias 0.4% are reported.
  int found = 0, by_chance = 0;
  constexpr int pairs = 200;
  for (int i = 0; i < pairs; ++i) {
    const auto seed = static_cast<std::uint64_t>(10 * i + 100);
    const tile_means truth = rendered(1.0, seed), tested = rendered(1.0, seed + 1);
    const double bias = (i % 2 == 0 ? 1.0 : -1.0) * found_bias(truth, tested);
    const std::vector<double> dark(tested.size(), 0.0);
    found += !check_unbiased(truth, tested.scaled_beyond(dark, 1.0 + bias));
    const double difference = std::fabs(tested.picture_mean() - truth.picture_mean());
    by_chance += difference >= picture_threshold * picture_error(truth, tested);
  }
  CHECK(found >= 194);    // 198 expected; fewer with 1%
  CHECK(by_chance <= 4);  // 0.8 expected; more with 0.2%
}

TEST_CASE("statistics: tile means with scaled indirect light are right", "[statistics]") {
  tile_means tested(2), expected(2);
  for (const double x : {1.0, 1.5, 3.0}) {
    tested.add({1.0 + x, 2.0 + 4.0 * x});
    expected.add({1.0 + 1.5 * x, 2.0 + 6.0 * x});
  }
  const tile_means scaled = tested.scaled_beyond({1.0, 2.0}, 1.5);
  for (std::size_t tile = 0; tile < 2; ++tile) {
    CHECK(scaled.mean(tile) == Approx(expected.mean(tile)));
    CHECK(scaled.variance_of_mean(tile) == Approx(expected.variance_of_mean(tile)));
  }
  CHECK(scaled.picture_mean() == Approx(expected.picture_mean()));
  CHECK(scaled.variance_of_picture_mean() == Approx(expected.variance_of_picture_mean()));
}
