// Phase functions and homogeneous media: densities are those of the samples, and the light is what analytic
// formulas say. A planted fault of 1% shows in each mean.
#include "support/policies.hpp"
#include "support/reports.hpp"
#include "support/sample_means.hpp"

#include <wfpg/host/medium.hpp>
#include <wfpg/host/phase.hpp>
#include <wfpg/testing/check_bsdf.hpp>

#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace wfpg_test;
using wfpg::henyey_greenstein;
using wfpg::homogeneous_medium;
using wfpg::testing::sample_mean;

namespace {

WFPG_TEST_CASE("phase: samples, densities and values of Henyey-Greenstein agree", "[medium]") {
  for (const float g : {-0.9f, -0.3f, 0.0f, 1.0e-6f, 0.5f, 0.9f}) {
    wfpg::testing::bsdf_check_options options;
    options.reciprocal = false;  // for cosines, which a phase function has not
    INFO("g " << g);
    check_passes(wfpg::testing::check_bsdf(Exec(), henyey_greenstein{g}, options));
  }
}

}  // namespace

TEST_CASE("phase: it is symmetric, and g is its mean cosine", "[medium]") {
  random_numbers random(5);
  for (const float g : {-0.7f, 0.0f, 0.3f, 0.9f, 0.999f}) {
    const henyey_greenstein phase{g};
    sample_mean cosine;
    for (int i = 0; i < 400000; ++i) {
      const wfpg::vec3 a = random.direction(), b = random.direction();
      if (i < 100) CHECK(phase.eval(a, b) == phase.eval(b, a));
      const float u = random.unit();
      cosine.add(1.0 + double(glm::dot(-a, phase.sample(a, {u, random.unit()}).direction)));
    }
    INFO("g " << g);
    CHECK(has_mean(cosine, 1.0 + double(g)));
  }
}

TEST_CASE("phase: forward lobes keep their digits", "[medium]") {
  const wfpg::vec3 outgoing = glm::normalize(wfpg::vec3(0.3f, -0.5f, 0.8f));
  for (const float g : {-0.999f, 0.99f, 0.999f}) {
    const double narrow = 1.0 - std::fabs(double(g));
    const double peak = (1.0 + std::fabs(double(g))) / (4.0 * double(wfpg::pi) * narrow * narrow);
    CHECK(double(henyey_greenstein{g}.pdf(outgoing, g > 0.0f ? -outgoing : outgoing)) ==
          Approx(peak).epsilon(1e-5));
  }
}

TEST_CASE("phase: a guide draws less where the lobe is narrow", "[medium]") {
  CHECK(henyey_greenstein{0.0f}.glossy({}).alpha >= 0.5f);
  CHECK(henyey_greenstein{0.8f}.glossy({}).alpha < 0.2f);
  CHECK(henyey_greenstein{0.99f}.glossy({}).alpha == 0.0f);
}

TEST_CASE("medium: light that scatters and light that passes are the exponential law's", "[medium]") {
  const homogeneous_medium medium{{0.1f, 0.5f, 0.0f}, {0.9f, 0.2f, 2.0f}};
  random_numbers random(7);
  for (const float limit : {0.2f, 0.5f, 1.0f}) {
    sample_mean scattered[3], passed[3], reached;
    for (int i = 0; i < 1000000; ++i) {
      const float u = random.unit();
      const auto drawn = medium.sample(u, random.unit(), limit);
      reached.add(drawn.scatters ? 0.0 : 1.0);
      for (int c = 0; c < 3; ++c) {
        scattered[c].add(drawn.scatters ? double(drawn.weight[c]) : 0.0);
        passed[c].add(drawn.scatters ? 0.0 : double(drawn.weight[c]));
      }
    }
    const wfpg::vec3 part = medium.scattering / medium.extinction(), passes = medium.transmittance(limit);
    for (int c = 0; c < 3; ++c) {
      INFO("channel " << c << ", limit " << limit);
      CHECK(double(passes[c]) == Approx(std::exp(-double(medium.extinction()[c] * limit))));
      CHECK(has_mean(scattered[c], double(part[c] * (1.0f - passes[c]))));
      if (passes[c] > 0.3f) CHECK(has_mean(passed[c], double(passes[c])));
    }
    CHECK(has_mean(reached, double(medium.pdf(limit, false))));
  }
}

TEST_CASE("medium: densities of distances integrate to one and are their frequencies", "[medium]") {
  const wfpg::basic_homogeneous_medium<glm::vec4> medium{glm::vec4(0.1f, 0.0f, 0.3f, 0.0f),
                                                         glm::vec4(1.0f, 0.0f, 0.2f, 4.0f)};
  constexpr float limit = 3.0f;
  constexpr int bins = 30;
  constexpr double samples = 400000.0;
  double counts[bins + 1] = {};
  random_numbers random(9);
  for (int i = 0; i < static_cast<int>(samples); ++i) {
    const float u = random.unit();
    const auto drawn = medium.sample(u, random.unit(), limit);
    if (!(drawn.distance >= 0.0f && drawn.distance <= limit)) FAIL("distance " << drawn.distance);
    const int bin = std::min(static_cast<int>(float(bins) * drawn.distance / limit), bins - 1);
    ++counts[drawn.scatters ? bin : bins];
  }
  double chi = 0.0, sum = 0.0;
  for (int bin = 0; bin <= bins; ++bin) {
    double probability = double(medium.pdf(limit, false));
    if (bin < bins) {
      probability = 0.0;
      constexpr int steps = 1000;
      for (int i = 0; i < steps; ++i)
        probability += double(medium.pdf(limit * (float(bin) + (float(i) + 0.5f) / steps) / bins, true)) *
                       double(limit) / bins / steps;
    }
    sum += probability;
    chi += std::pow(counts[bin] - samples * probability, 2) / (samples * probability);
  }
  CHECK(sum == Approx(1.0).epsilon(1e-4));
  CHECK(chi < 60.0);  // of 30 degrees of freedom: 0.1% are above
}

TEST_CASE("medium: without end, paths scatter 1 / (1 - albedo) times", "[medium]") {
  const homogeneous_medium medium{{0.4f, 0.2f, 0.1f}, {0.6f, 0.8f, 0.4f}};
  random_numbers random(11);
  sample_mean events[3];
  for (int path = 0; path < 200000; ++path) {
    wfpg::vec3 weight(1.0f), sum(0.0f);
    while (glm::dot(weight, weight) > 1e-12f) {
      const float u = random.unit();
      sum += weight;  // of light that arrives at an event, whether it is absorbed there or not
      const auto drawn = medium.sample(u, random.unit(), 3.0e38f);
      weight *= drawn.weight;
    }
    for (int c = 0; c < 3; ++c) events[c].add(double(sum[c]));
  }
  for (int c = 0; c < 3; ++c) {
    INFO("channel " << c);
    CHECK(has_mean(events[c], 1.0 / (1.0 - double(medium.scattering[c] / medium.extinction()[c]))));
  }
}

TEST_CASE("medium: a vacuum changes nothing", "[medium]") {
  const homogeneous_medium vacuum;
  const auto drawn = vacuum.sample(0.5f, 0.999f, 7.0f);
  CHECK_FALSE(drawn.scatters);
  CHECK(drawn.distance == 7.0f);
  CHECK(drawn.pdf == Approx(1.0f));
  CHECK(glm::distance(drawn.weight, wfpg::vec3(1.0f)) < 1e-6f);
  CHECK(glm::distance(vacuum.transmittance(3.0e38f), wfpg::vec3(1.0f)) < 1e-6f);
}
