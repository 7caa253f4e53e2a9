// Of large waves a part of the paths is listened to, another in each sample.
#pragma once

#include <wfpg/base/math.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// Which paths are recorded: of each 2^shift runs of 32 paths one, drawn anew for each sample. Neighbours are
/// recorded together, since they share cache lines.
struct recorded_runs {
  static constexpr std::uint32_t run = 32;

  std::uint32_t shift = 0;
  std::uint32_t seed = 0;  // of the sample

  WFPG_HD std::size_t size(std::size_t paths) const {
    const std::size_t group = std::size_t(run) << shift;
    return shift == 0 ? paths : (paths + group - 1) / group * run;
  }
  /// Where a path, of less than 2^32, is among the recorded ones; false where it is not.
  WFPG_HD bool find(std::size_t path, std::uint32_t& place) const {
    place = static_cast<std::uint32_t>(path);
    if (shift == 0) return true;
    const std::uint32_t group = place / run >> shift, others = (1u << shift) - 1u;
    if ((place / run & others) != (hash32(seed, group) & others)) return false;
    place = group * run + place % run;
    return true;
  }
};

}  // namespace wfpg::detail
