// Options of loops over values, of which 0 stands for an unset option.
#pragma once

#include <optional>

namespace wfpg_test {

/// The value, or no value if it is 0.
template <class T>
std::optional<T> unless_zero(T value) {
  return value != T(0) ? std::optional<T>(value) : std::nullopt;
}

}  // namespace wfpg_test
