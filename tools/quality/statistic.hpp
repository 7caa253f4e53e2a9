// Means over seeds and their ratios, with what they are uncertain by.
#pragma once

#include <optional>
#include <vector>

namespace quality {

/// Of independent values. Spreads are absent of one value.
struct statistic {
  double mean = 0.0;
  std::optional<double> deviation;       ///< standard deviation of a value, n - 1 in its denominator
  std::optional<double> standard_error;  ///< of the mean
};

/// `values` must not be empty.
statistic statistic_of(const std::vector<double>& values);

struct ratio {
  double value = 0.0;
  std::optional<double> standard_error;  ///< to first order in both spreads
};

/// Of two independent means; absent where one is not positive and finite.
std::optional<ratio> ratio_of(const statistic& numerator, const statistic& denominator);

}  // namespace quality
