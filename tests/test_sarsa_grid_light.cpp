// What a SARSA grid learns in a furnace of known radiance, and the means of guided paths.
#include "support/catch.hpp"
#include "support/estimates.hpp"
#include "support/sarsa.hpp"

#include <cmath>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::sarsa_grid_options;
using wfpg::sarsa_sampler;
using wfpg::sarsa_update;

sarsa_grid_options furnace_options(sarsa_update update, float learning_rate) {
  sarsa_grid_options options = sarsa_options(2048);
  options.update = update;
  options.learning_rate = learning_rate;
  options.resolution = 2;
  options.direction_resolution = 4;
  options.max_depth = 48;  // one path in 45000 gets there
  return options;
}

template <class Exec>
sarsa_guider<Exec> furnace_guider(const Exec& exec, const sarsa_grid_options& options) {
  const box_mesh<Exec> mesh(exec);
  return {exec, mesh.view(), options};
}

WFPG_TEST_CASE("sarsa grid: Monte Carlo converges to a furnace's radiance", "[sarsa][furnace]") {
  const Exec exec;
  sarsa_guider<Exec> guider = furnace_guider(exec, furnace_options(sarsa_update::monte_carlo, 0.0f));
  trace_in_furnace(exec, guider, 24);
  CHECK(mean_radiance(exec, guider) == Approx(furnace_radiance).epsilon(0.02));
}

WFPG_TEST_CASE("sarsa grid: SARSA approaches a furnace's radiance from below, step by step",
               "[sarsa][furnace]") {
  const Exec exec;
  for (const sarsa_update update : {sarsa_update::sarsa, sarsa_update::expected_sarsa}) {
    INFO(name_of(update));
    sarsa_guider<Exec> guider = furnace_guider(exec, furnace_options(update, 0.1f));
    // One bounce per step. If all values are new, the sum is 1 + 0.8 + 0.8² + ...
    trace_in_furnace(exec, guider, 1);
    CHECK(mean_radiance(exec, guider) == Approx(1.0f).epsilon(0.001));
    trace_in_furnace(exec, guider, 1);
    const double after_two = mean_radiance(exec, guider);
    CHECK(after_two > 1.3);
    CHECK(after_two < 1.85);
    trace_in_furnace(exec, guider, 30);
    CHECK(mean_radiance(exec, guider) == Approx(furnace_radiance).epsilon(0.05));
  }
}

/// The samples after which the error in the furnace is measured.
constexpr std::uint32_t looked_at[] = {8, 16, 32, 64, 128, 256};

/// Prints a row of docs/guides.md, and returns the errors in per cent.
template <class Exec>
std::vector<double> print_furnace_errors(const Exec& exec, sarsa_update update, float learning_rate,
                                         std::uint32_t step) {
  sarsa_grid_options options = furnace_options(update, learning_rate);
  options.max_paths = 4096;
  options.resolution = 4;
  options.direction_resolution = 8;
  options.guide_fraction = 0.7f;
  options.step = step;
  sarsa_guider<Exec> guider = furnace_guider(exec, options);
  std::cout << "| " << name_of(update) << " | " << learning_rate << " | " << step;
  std::vector<double> errors;
  for (const std::uint32_t samples : looked_at) {
    trace_in_furnace(exec, guider, samples - guider.statistics().samples);
    errors.push_back(100.0 * (mean_radiance(exec, guider) / double(furnace_radiance) - 1.0));
    std::cout << " | " << std::fixed << std::setprecision(1) << errors.back() << std::defaultfloat;
  }
  std::cout << " |" << std::endl;
  return errors;
}

// Hidden, since it takes a minute. It prints the rows of a table in docs/guides.md.
WFPG_TEST_CASE("sarsa grid: the bias in a furnace is below known bounds", "[.][bias]") {
  const Exec exec;
  std::cout << "| update | learning rate | step | 8 samples | 16 | 32 | 64 | 128 | 256 |\n";
  for (const sarsa_update update : sarsa_updates)
    for (const float rate : {0.0f, 0.05f, 0.2f}) {
      const std::vector<double> errors = print_furnace_errors(exec, update, rate, 1);
      if (update == sarsa_update::monte_carlo)
        CHECK(std::abs(errors.front()) < 20.0);
      else  // from below
        CHECK(errors.front() < -20.0);
      if (rate > 0.0f) CHECK(std::abs(errors.back()) < 10.0);
    }
  const std::vector<double> slow = print_furnace_errors(exec, sarsa_update::sarsa, 0.05f, 8);
  CHECK(slow.front() < -60.0);
  CHECK(slow.back() > -20.0);
}

/// Paths whose guide has learnt from other paths before, with other random numbers.
template <class Exec>
estimate guided_estimate(const Exec& exec, const sarsa_grid_options& options) {
  constexpr std::uint32_t before = 8, samples = 16;
  const box_mesh<Exec> mesh(exec);
  sarsa_guider<Exec> guider(exec, mesh.view(), options);
  const auto gathered = trace_paths(exec, guider, before + samples, options.max_paths, box_caster());
  return estimate_of({gathered.begin() + std::ptrdiff_t(before * options.max_paths), gathered.end()});
}

WFPG_TEST_CASE("sarsa grid: guided paths keep the mean and lower the variance", "[sarsa]") {
  const Exec exec;
  sarsa_grid_options options = sarsa_options(2048);
  options.unguided_samples = 1000;
  const estimate unguided = guided_estimate(exec, options);
  options.unguided_samples = 0;
  for (const sarsa_update update : sarsa_updates)
    for (const sarsa_sampler sampler : sarsa_samplers)
      for (const float fraction : {0.0f, 1.0f}) {
        if (fraction > 0.0f && update != sarsa_update::sarsa) continue;
        INFO(name_of(update) << ", " << name_of(sampler) << ", fraction " << fraction);
        options.update = update;
        options.sampler = sampler;
        options.guide_fraction = unless_zero(fraction);
        options.floor = fraction > 0.0f ? 1.0f : 0.01f;  // a test of means needs bounded weights
        const estimate found = guided_estimate(exec, options);
        CHECK(std::abs(found.mean - unguided.mean) < 4.0 * std::sqrt(found.variance + unguided.variance));
        if (sampler == sarsa_sampler::mixed_rejection && !(fraction > 0.0f))
          CHECK(found.variance < 0.7 * unguided.variance);
      }
}

}  // namespace
