// Sums over cells.
#include "measures.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

namespace inspect {

std::vector<double> normalised(std::vector<double> values) {
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  if (sum > 0.0)
    for (double& value : values) value /= sum;
  return values;
}

double kl_divergence(const std::vector<double>& p, const std::vector<double>& q) {
  double sum = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (!(p[i] > 0.0)) continue;
    if (!(q[i] > 0.0)) return std::numeric_limits<double>::infinity();
    sum += p[i] * std::log(p[i] / q[i]);
  }
  return sum;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mean_b = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
    ab += (a[i] - mean_a) * (b[i] - mean_b);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : std::numeric_limits<double>::quiet_NaN();
}

std::vector<double> coarsened(const std::vector<double>& fine, int times) {
  const auto side = static_cast<std::size_t>(std::lround(std::sqrt(double(fine.size()))));
  const auto step = static_cast<std::size_t>(times);
  const std::size_t coarse = side / step;
  std::vector<double> means(coarse * coarse, 0.0);
  for (std::size_t i = 0; i < fine.size(); ++i)
    means[i / side / step * coarse + i % side / step] += fine[i] / double(step * step);
  return means;
}

}  // namespace inspect
