// Sample statistics.
#include "statistic.hpp"

#include <cmath>
#include <numeric>

namespace quality {

statistic statistic_of(const std::vector<double>& values) {
  const double count = static_cast<double>(values.size());
  statistic result;
  result.mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  if (values.size() < 2) return result;
  double squares = 0.0;
  for (const double v : values) squares += (v - result.mean) * (v - result.mean);
  result.deviation = std::sqrt(squares / (count - 1.0));
  result.standard_error = *result.deviation / std::sqrt(count);
  return result;
}

std::optional<ratio> ratio_of(const statistic& numerator, const statistic& denominator) {
  for (const double mean : {numerator.mean, denominator.mean})
    if (!(mean > 0.0) || !std::isfinite(mean)) return std::nullopt;
  ratio result{numerator.mean / denominator.mean, std::nullopt};
  if (numerator.standard_error && denominator.standard_error)
    result.standard_error = result.value * std::hypot(*numerator.standard_error / numerator.mean,
                                                      *denominator.standard_error / denominator.mean);
  return result;
}

}  // namespace quality
