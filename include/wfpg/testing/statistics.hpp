// Pearson's chi² test of counts against expected counts, and the tails of two distributions.
// Bins that expect fewer than 5 are pooled.
// The statistic is chi²-distributed only in the limit of many.
// Source: Pearson 1900; Abramowitz and Stegun, chapter 6.5, for the incomplete gamma function.
// Cost: O(bins) a test. Memory: one entry a bin.
// All on the host, in double precision.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

namespace wfpg::testing {

/// Returns Q(a, x), the regularised upper incomplete gamma function, in [0, 1]. 1 where x <= 0.
/// By its series below a + 1, and by Lentz's continued fraction above.
/// Source: Abramowitz and Stegun, 6.5.29 and 6.5.31.
/// Precondition: a > 0. The fraction ends at a relative change of 1e-14.
inline double upper_gamma(double a, double x) {
  if (x <= 0.0) return 1.0;
  // x^a e^-x / Gamma(a), by logarithms, since each factor alone overflows for large a.
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  // Here the series of the lower function converges fastest, and Q is 1 minus it.
  if (x < a + 1.0) {
    double term = 1.0 / a, sum = term;
    for (double n = a + 1.0; term > sum * 1e-16; n += 1.0) sum += term *= x / n;
    return 1.0 - front * sum;
  }
  // Lentz's method keeps the ratios of successive numerators and denominators, which stay moderate.
  double b = x + 1.0 - a, c = 1e300, d = 1.0 / b, result = d;
  for (double i = 1.0; i < 1e5; i += 1.0) {
    const double numerator = i * (a - i);
    b += 2.0;
    d = 1.0 / (b + numerator * d);
    c = b + numerator / c;
    result *= c * d;
    if (std::fabs(c * d - 1.0) < 1e-14) break;
  }
  return front * result;
}

/// Returns the probability that chi² of `degrees` degrees of freedom is at least `statistic`.
/// Without a degree of freedom it is 1.
/// It is Q(degrees / 2, statistic / 2).
inline double chi_square_tail(double statistic, double degrees) {
  return degrees > 0.0 ? upper_gamma(0.5 * degrees, 0.5 * statistic) : 1.0;
}

/// A bin of a chi² test, or a pool of several.
struct chi_square_bin {
  std::size_t first = 0,  ///< first bin of the pool
      last = 0;           ///< last bin of the pool; the first one for a bin by itself
  double observed = 0.0,  ///< samples counted in the pool
      expected = 0.0;     ///< samples that the hypothesis puts there

  /// Returns the pool's term of the statistic: (observed - expected)² / expected.
  /// The expected count must be positive, as pools have it.
  double term() const { return (observed - expected) * (observed - expected) / expected; }
  /// Returns the pool in words, with both counts.
  /// Bins are given by their indices.
  std::string message() const {
    std::ostringstream text;
    text << (first == last ? "bin " : "pool of bins from ") << first;
    if (first != last) text << " to " << last;
    text << ", observed " << observed << ", expected " << expected;
    return text.str();
  }
};

/// The result of a chi² test.
struct chi_square_result {
  double statistic = 0.0;  ///< chi²: the sum of all terms, at least 0
  double degrees = 0.0;    ///< degrees of freedom: pools less one
  double p = 1.0;  ///< probability of such a statistic or a larger one, where the hypothesis holds; in [0, 1]
  chi_square_bin worst;  ///< the bin that adds most to the statistic
  std::string message;   ///< statistic, degrees, p and the worst bin in words
};

/// Returns bins that expect at least 5, and pools of the others, in order of their completion.
/// A pool grows until it expects 5.
/// What is left over joins the last bin.
/// Both vectors have one length.
/// Where all together expect less than 5, there is one pool.
inline std::vector<chi_square_bin> pool_bins(const std::vector<double>& observed,
                                             const std::vector<double>& expected) {
  // The usual rule of thumb for the chi² approximation (Cochran 1952).
  constexpr double least = 5.0;
  std::vector<chi_square_bin> bins;
  chi_square_bin pool;
  // Adds a count to a pool. An empty pool begins at the bin that is added.
  const auto extend = [](chi_square_bin& bin, std::size_t last, double count, double expects) {
    if (bin.observed == 0.0 && bin.expected == 0.0) bin.first = last;
    bin.last = last;
    bin.observed += count;
    bin.expected += expects;
  };
  for (std::size_t i = 0; i < observed.size(); ++i) {
    // A bin that needs no pool. The open pool goes on after it.
    if (expected[i] >= least) {
      bins.push_back({i, i, observed[i], expected[i]});
      continue;
    }
    extend(pool, i, observed[i], expected[i]);
    // A full pool becomes a bin.
    if (pool.expected < least) continue;
    bins.push_back(pool);
    pool = {};
  }
  // All bins together expect less than 5: a test with no degree of freedom.
  if (bins.empty()) return {pool};
  extend(bins.back(), pool.last > bins.back().last ? pool.last : bins.back().last, pool.observed,
         pool.expected);
  return bins;
}

/// Tests counts against expected counts of equal sum.
/// A count where nothing is expected at all fails with p = 0, whatever the other bins hold.
/// Precondition: both vectors have one length, and are not empty.
inline chi_square_result chi_square_test(const std::vector<double>& observed,
                                         const std::vector<double>& expected) {
  chi_square_result result;
  for (std::size_t i = 0; i < observed.size(); ++i)
    // The division by the expected count would give infinity; NaN counts as nothing expected.
    if (!(expected[i] > 0.0) && observed[i] > 0.0) {
      result.p = 0.0;
      result.worst = {i, i, observed[i], expected[i]};
      result.message = "nothing expected in " + result.worst.message();
      return result;
    }
  // One degree is lost, since the sums are equal.
  const std::vector<chi_square_bin> bins = pool_bins(observed, expected);
  result.worst = bins.front();
  for (const chi_square_bin& bin : bins) {
    result.statistic += bin.term();
    if (bin.term() > result.worst.term()) result.worst = bin;
  }
  result.degrees = static_cast<double>(bins.size() - 1);
  result.p = chi_square_tail(result.statistic, result.degrees);
  std::ostringstream text;
  text << "chi^2 = " << result.statistic << " with " << result.degrees << " degrees, p = " << result.p
       << "; worst: " << result.worst.message();
  result.message = text.str();
  return result;
}

/// A mean of samples and its standard error, from running sums.
/// 24 bytes, in double precision.
struct sample_mean {
  double sum = 0.0,   ///< sum of the samples
      squares = 0.0,  ///< sum of their squares
      n = 0.0;        ///< how many they are

  /// Adds one sample. O(1).
  /// NaN makes all results NaN.
  void add(double x) { sum += x, squares += x * x, n += 1.0; }
  /// Returns the mean. Precondition: at least one sample.
  double mean() const { return sum / n; }
  /// Returns the standard error of the mean: the standard deviation over sqrt(n).
  /// Rounding may make the variance negative, which counts as 0.
  /// The variance divides by n, not n - 1.
  double error() const { return std::sqrt(std::max(squares / n - mean() * mean(), 0.0) / n); }
};

/// Returns the probability that a normal variate of mean 0 lies at least as far from 0 as `difference`.
/// `allowance` is taken off the difference first: errors that are no chance, such as a quadrature's.
/// Without a deviation it is 1 or 0: within the allowance or beyond it.
inline double two_sided_tail(double difference, double allowance, double deviation) {
  const double beyond = std::fabs(difference) - allowance;
  // Within the allowance. NaN ends here too: callers test their values first.
  if (!(beyond > 0.0)) return 1.0;
  // erfc gives both tails of the normal distribution at once.
  return deviation > 0.0 ? std::erfc(beyond / (deviation * std::sqrt(2.0))) : 0.0;
}

}  // namespace wfpg::testing
