// Sentences of check reports.
#pragma once

#include <wfpg/base/types.hpp>

#include <ostream>
#include <sstream>
#include <string>

namespace wfpg::detail {

/// A vector as a report writes it.
struct in_words {
  vec3 v;
};
inline std::ostream& operator<<(std::ostream& out, const in_words& w) {
  return out << '(' << w.v.x << ", " << w.v.y << ", " << w.v.z << ')';
}

/// Returns its arguments one after the other as text, with four digits a number.
template <class... Parts>
std::string sentence(const Parts&... parts) {
  std::ostringstream text;
  text.precision(4);
  (text << ... << parts);
  return text.str();
}

}  // namespace wfpg::detail
