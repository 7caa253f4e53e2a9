// The result of a check of what a host hands to the guider. Converts to bool, for any test framework.
// Cost and memory: one string.
#pragma once

#include <string>

/// Checks of what a host hands to the guider: BSDFs, ray casters, surfaces, and how it uses directions.
namespace wfpg::testing {

/// The result of a check: success, or the first violation. host_checker has a line for each violation.
struct check_report {
  /// The first violation: where, what was found, what was expected. Empty where all holds.
  std::string message;

  /// Returns true where no violation was found.
  explicit operator bool() const { return message.empty(); }
};

}  // namespace wfpg::testing
