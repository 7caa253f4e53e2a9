// Pearson's chi² test of counts against expected counts. Bins that expect fewer than 5 are pooled, since the
// statistic is chi²-distributed only in the limit of many.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

namespace wfpg::testing {

/// Q(a, x), the regularised upper incomplete gamma function: by its series below a + 1, by Lentz's continued
/// fraction above (Abramowitz & Stegun, 6.5.29 and 6.5.31).
inline double upper_gamma(double a, double x) {
  if (x <= 0.0) return 1.0;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1.0) {
    double term = 1.0 / a, sum = term;
    for (double n = a + 1.0; term > sum * 1e-16; n += 1.0) sum += term *= x / n;
    return 1.0 - front * sum;
  }
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

/// The probability that chi² of so many degrees of freedom is at least `statistic`.
inline double chi_square_tail(double statistic, double degrees) {
  return degrees > 0.0 ? upper_gamma(0.5 * degrees, 0.5 * statistic) : 1.0;
}

/// A bin, or a pool of bins that end at `last`, of a chi² test.
struct chi_square_bin {
  std::size_t first = 0, last = 0;
  double observed = 0.0, expected = 0.0;

  double term() const { return (observed - expected) * (observed - expected) / expected; }
  std::string message() const {
    std::ostringstream text;
    text << (first == last ? "bin " : "pool of bins from ") << first;
    if (first != last) text << " to " << last;
    text << ", observed " << observed << ", expected " << expected;
    return text.str();
  }
};

struct chi_square_result {
  double statistic = 0.0;
  double degrees = 0.0;
  double p = 1.0;
  chi_square_bin worst;  ///< the bin that adds most to the statistic
  std::string message;   ///< the statistic and that bin
};

/// Bins that expect at least 5, and pools of the others; what is left over joins the last of them.
inline std::vector<chi_square_bin> pool_bins(const std::vector<double>& observed,
                                             const std::vector<double>& expected) {
  constexpr double least = 5.0;
  std::vector<chi_square_bin> bins;
  chi_square_bin pool;
  const auto extend = [](chi_square_bin& bin, std::size_t last, double count, double expects) {
    if (bin.observed == 0.0 && bin.expected == 0.0) bin.first = last;
    bin.last = last;
    bin.observed += count;
    bin.expected += expects;
  };
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (expected[i] >= least) {
      bins.push_back({i, i, observed[i], expected[i]});
      continue;
    }
    extend(pool, i, observed[i], expected[i]);
    if (pool.expected < least) continue;
    bins.push_back(pool);
    pool = {};
  }
  if (bins.empty()) return {pool};
  extend(bins.back(), pool.last > bins.back().last ? pool.last : bins.back().last, pool.observed,
         pool.expected);
  return bins;
}

/// Tests counts against expected counts of the same sum. A count where nothing is expected at all fails with
/// p = 0.
inline chi_square_result chi_square_test(const std::vector<double>& observed,
                                         const std::vector<double>& expected) {
  chi_square_result result;
  for (std::size_t i = 0; i < observed.size(); ++i)
    if (!(expected[i] > 0.0) && observed[i] > 0.0) {
      result.p = 0.0;
      result.worst = {i, i, observed[i], expected[i]};
      result.message = "nothing expected in " + result.worst.message();
      return result;
    }
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

/// Mean and its standard error.
struct sample_mean {
  double sum = 0.0, squares = 0.0, n = 0.0;

  void add(double x) { sum += x, squares += x * x, n += 1.0; }
  double mean() const { return sum / n; }
  double error() const { return std::sqrt(std::max(squares / n - mean() * mean(), 0.0) / n); }
};

/// The probability that a normal variate is at least this far from 0, once `allowance` is taken off; of no
/// deviation 0 or 1.
inline double two_sided_tail(double difference, double allowance, double deviation) {
  const double beyond = std::fabs(difference) - allowance;
  if (!(beyond > 0.0)) return 1.0;
  return deviation > 0.0 ? std::erfc(beyond / (deviation * std::sqrt(2.0))) : 0.0;
}

}  // namespace wfpg::testing
