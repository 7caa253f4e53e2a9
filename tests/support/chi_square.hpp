// Families of chi² tests, and the tests themselves under this namespace.
#pragma once

#include <wfpg/testing/statistics.hpp>

#include <sstream>
#include <string>

namespace wfpg_test {

using wfpg::testing::chi_square_bin;
using wfpg::testing::chi_square_result;
using wfpg::testing::chi_square_tail;
using wfpg::testing::chi_square_test;
using wfpg::testing::pool_bins;
using wfpg::testing::upper_gamma;

/// Combines many independent chi² tests into one at significance 0.1%. No single p may be below 0.1% / n
/// (Bonferroni). The sum of all statistics is chi² with the sum of degrees, and its p may not be below 0.1%
/// either. The sum finds small errors that all tests share, Bonferroni a large one of a single test. Both
/// together reject at most 0.2% of correct samplers. Seeds are fixed, so a verdict does not change from run
/// to run.
class chi_square_family {
 public:
  void add(const chi_square_result& result, const std::string& name) {
    ++tests_;
    statistic_ += result.statistic;
    degrees_ += result.degrees;
    if (result.p >= least_p_) return;
    least_p_ = result.p;
    worst_ = name + ": " + result.message;
  }
  int size() const { return tests_; }
  bool accepted() const { return least_p_ > 1e-3 / tests_ && combined_p() > 1e-3; }
  std::string message() const {
    std::ostringstream text;
    text << tests_ << " tests, combined p = " << combined_p() << "; worst of them " << worst_;
    return text.str();
  }

 private:
  double combined_p() const { return chi_square_tail(statistic_, degrees_); }

  int tests_ = 0;
  double statistic_ = 0.0, degrees_ = 0.0, least_p_ = 2.0;
  std::string worst_;
};

}  // namespace wfpg_test
