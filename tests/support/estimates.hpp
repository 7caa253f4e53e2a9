// Means of the radiance that paths gather, and their variances.
#pragma once

#include <vector>

namespace wfpg_test {

/// A mean, and its variance.
struct estimate {
  double mean = 0.0, variance = 0.0;
};
inline estimate estimate_of(const std::vector<float>& gathered) {
  double sum = 0.0, squares = 0.0;
  for (const float value : gathered) {
    sum += double(value);
    squares += double(value) * double(value);
  }
  const auto n = double(gathered.size());
  return {sum / n, (squares / n - sum * sum / (n * n)) / n};
}

}  // namespace wfpg_test
