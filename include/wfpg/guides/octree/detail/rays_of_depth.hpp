// The counters of statistics by depth that ranks add up.
#pragma once

#include <wfpg/guide/statistics.hpp>

namespace wfpg::detail {

/// A depth's rays, then its unbinned rays, for rank_counters. Bins and cones are equal on all ranks.
struct rays_of_depth {
  depth_statistics* depths;  ///< counts since the guide was made
  /// Returns counter `i`, below twice the number of depths.
  WFPG_HD std::uint64_t& operator()(std::size_t i) const {
    return i % 2 == 0 ? depths[i / 2].rays : depths[i / 2].unbinned;
  }
};

}  // namespace wfpg::detail
