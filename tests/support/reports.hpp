// Checks of the reports of <wfpg/testing>.
#pragma once

#include "support/catch.hpp"

#include <wfpg/testing/check_report.hpp>

#include <string>
#include <vector>

namespace wfpg_test {

using wfpg::testing::check_report;

/// Checks that a report is a failure whose message has all of these words.
inline void check_names(const check_report& report, const std::vector<std::string>& words) {
  INFO(report.message);
  CHECK(!report);
  for (const std::string& word : words) {
    INFO(word);
    CHECK(report.message.find(word) != std::string::npos);
  }
}
inline void check_passes(const check_report& report) {
  INFO(report.message);
  CHECK(report);
}

}  // namespace wfpg_test
