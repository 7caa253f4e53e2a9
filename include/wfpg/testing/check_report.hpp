// The outcome of a check of what a host hands to the guider.
#pragma once

#include <string>

/// Checks of what a host hands to the guider.
namespace wfpg::testing {

/// The outcome of a check.
struct check_report {
  std::string message;  ///< the first violation: where, what was found, what was expected; empty: all holds

  /// True where all holds.
  explicit operator bool() const { return message.empty(); }
};

}  // namespace wfpg::testing
