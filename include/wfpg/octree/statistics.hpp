// Counts that the octree's stages report: geometry that was left out of a build, and deposits that were
// dropped. Nothing is dropped without being counted here. Cost: O(1), no memory but the counters.
#pragma once

#include <cstdint>

namespace wfpg {

/// How much geometry was left out of a build, and why. A build with skipped geometry is still usable.
struct build_report {
  /// Triangles or samples with a coordinate that is NaN, infinite or beyond largest_coordinate.
  std::uint32_t non_finite = 0;
  /// Triangles with an index beyond the vertices; samples outside the given bounds.
  std::uint32_t out_of_range = 0;
  /// Triangles without area; samples without a unit normal or without a positive, finite area.
  std::uint32_t degenerate = 0;

  /// Number of triangles or samples that were left out, for all three reasons.
  std::uint32_t skipped() const { return non_finite + out_of_range + degenerate; }
};

/// Deposits that were not stored since the cache was built.
struct dropped_deposits {
  /// Radiance was NaN, infinite or negative, or position or direction was not finite.
  std::uint32_t invalid = 0;
  /// No voxel holds the position or lies next to it.
  std::uint32_t outside = 0;
  /// The queue was full: raise its capacity.
  std::uint32_t overflow = 0;

  /// Number of deposits that were dropped, for all three reasons.
  std::uint64_t total() const { return std::uint64_t(invalid) + outside + overflow; }
};

}  // namespace wfpg
