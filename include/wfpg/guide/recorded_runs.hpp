// Chooses which paths of a sample are recorded where only a part of them is.
//
// Source: wfpg's own. Cost: one integer hash a look-up. Memory: 8 bytes, passed to kernels by value.
#pragma once

#include <wfpg/base/math.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// The recorded paths: one run of 32 paths in each group of 2^shift runs, chosen at random for each sample.
/// A run's paths are neighbours in memory, so that recording them writes whole cache lines.
struct recorded_runs {
  static constexpr std::uint32_t run = 32;  ///< paths in a row that are recorded together

  std::uint32_t shift = 0;  ///< log2 of the runs in a group; 0 records all paths
  std::uint32_t seed = 0;   ///< chooses the run of each group; differs between samples

  /// Returns the places to store for a sample of `paths` paths. The last group counts as a whole one, so
  /// that some places may have no path.
  WFPG_HD std::size_t size(std::size_t paths) const {
    const std::size_t group = std::size_t(run) << shift;
    return shift == 0 ? paths : (paths + group - 1) / group * run;
  }
  /// Writes the place of a path among the recorded ones, below size(). False where the path is not recorded.
  /// Precondition: `path` is below 2^32.
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
