// Means over seeds and their ratios, with uncertainties.
#pragma once

#include <optional>
#include <vector>

namespace quality {

/// Statistic of independent values. A single value has no spreads.
struct statistic {
  double mean = 0.0;
  std::optional<double> deviation;       ///< standard deviation of a value, with n - 1 in the denominator
  std::optional<double> standard_error;  ///< of the mean
};

/// `values` must not be empty.
statistic statistic_of(const std::vector<double>& values);

struct ratio {
  double value = 0.0;
  std::optional<double> standard_error;  ///< to first order in both spreads
};

/// Ratio of two independent means. Absent if one is not positive and finite.
std::optional<ratio> ratio_of(const statistic& numerator, const statistic& denominator);

}  // namespace quality
