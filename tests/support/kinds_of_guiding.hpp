// Every mode of guiding with fields of every lifetime, in the box of guiding.hpp.
#pragma once

#include "support/guiding.hpp"

#include <wfpg/path_guider.hpp>

#include <string>
#include <vector>

namespace wfpg_test {

constexpr wfpg::guiding_mode modes[] = {wfpg::guiding_mode::oriented, wfpg::guiding_mode::plain};

inline std::vector<guider_options> kinds_of_guiding() {
  std::vector<guider_options> kinds;
  for (const wfpg::guiding_mode mode : modes)
    for (const field_lifetime lifetime : lifetimes) kinds.push_back(box_options(mode, lifetime));
  return kinds;
}

inline std::string describe(const guider_options& options) {
  return std::string(options.mode == wfpg::guiding_mode::plain ? "plain, " : "oriented, ") +
         name_of(options.fields);
}

inline int count_guided(const std::vector<wfpg::sampled_direction>& drawn) {
  int n = 0;
  for (const wfpg::sampled_direction& d : drawn) n += d.technique == wfpg::sampling_technique::guide;
  return n;
}

}  // namespace wfpg_test
