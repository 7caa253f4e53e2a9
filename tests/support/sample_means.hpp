// Means of samples, compared with values that are known.
#pragma once

#include "support/catch.hpp"

#include <wfpg/testing/statistics.hpp>

#include <cmath>

namespace wfpg_test {

/// Whether a mean is an expected value: within 4 standard errors, and so precise that 1% of it shows.
inline bool has_mean(const wfpg::testing::sample_mean& found, double expected) {
  const auto distance = [&](double factor) {
    return std::fabs(factor * found.mean() - expected) / found.error();
  };
  INFO(found.mean() << " +- " << found.error() << ", expected " << expected);
  CHECK(distance(1.0) < 4.0);
  CHECK(distance(1.01) > 4.0);
  return distance(1.0) < 4.0 && distance(1.01) > 4.0;
}

}  // namespace wfpg_test
