// Counts that the octree's stages report: geometry that was left out, and deposits that were dropped.
#pragma once

#include <cstdint>

namespace wfpg {

/// What was left out of a build, and why.
struct build_report {
  std::uint32_t non_finite = 0;  ///< triangles or samples with NaN, infinite or too large coordinates
  std::uint32_t out_of_range =
      0;  ///< triangles with an index beyond the vertices; samples outside given bounds
  std::uint32_t degenerate = 0;  ///< triangles without area, samples without normal or positive area

  /// All of them.
  std::uint32_t skipped() const { return non_finite + out_of_range + degenerate; }
};

/// Deposits that were not stored, since the cache was built.
struct dropped_deposits {
  std::uint32_t invalid = 0;   ///< NaN, infinite or negative radiance, or a non-finite position or direction
  std::uint32_t outside = 0;   ///< no voxel at or next to the position
  std::uint32_t overflow = 0;  ///< the queue was full

  /// All of them.
  std::uint64_t total() const { return std::uint64_t(invalid) + outside + overflow; }
};

}  // namespace wfpg
