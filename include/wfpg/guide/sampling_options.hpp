// What every guide can be told.
#pragma once

#include <wfpg/base/error.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

/// What guiding can be told, whatever the guide. Every field has a default; ranges are checked when a guider
/// is made.
struct sampling_options {
  /// Share of guided samples, in [0, 1]; 0: the guide's own.
  float guide_fraction = 0.0f;
  /// Depths that are guided, from 0 on, at least 1; deeper rays are their BSDFs'. By default all. Beside
  /// next-event estimation leave out the depth of a path's last direction, which finds emitters alone and is
  /// as well drawn from the BSDF, for less: n - 2 of paths of n segments, if that is one or more.
  std::uint32_t guided_depths = 0xffffffffu;
  /// Guide toward emitters themselves. Beside next-event estimation they count with their MIS weight, and
  /// false leaves them to it: better where fields do not learn.
  bool include_emission = true;
  std::uint32_t unguided_samples =
      1;  ///< samples at the beginning that only record ("PT first", section 3.7)
  /// Of all that the guider draws by itself.
  std::uint64_t seed = 0;
  std::size_t max_paths = 0;  ///< paths of a sample; 0: the renderer deposits by itself
  std::uint32_t max_depth =
      8;                     ///< vertices of a path that the recorder holds, and depths that statistics tell
  std::size_t max_rays = 0;  ///< of a wave; 0: max_paths
};

namespace detail {

/// Refuses options that are out of range.
inline void require_valid(const sampling_options& o) {
  require(o.guide_fraction >= 0.0f && o.guide_fraction <= 1.0f, "guide_fraction", o.guide_fraction,
          "in [0, 1]");
  require(o.guided_depths >= 1, "guided_depths", o.guided_depths, "at least 1");
  require(o.max_depth >= 1 && o.max_depth <= 1024, "max_depth", o.max_depth, "in [1, 1024]");
  require(o.max_paths < 0xffffffffull, "max_paths", o.max_paths, "less than 2^32 - 1");
  require(o.max_rays < 0xffffffffull, "max_rays", o.max_rays, "less than 2^32 - 1");
  require(o.max_paths * o.max_depth < 0xffffffffull, "max_paths times max_depth, the vertices of a sample,",
          o.max_paths * o.max_depth, "less than 2^32 - 1");
}

}  // namespace detail
}  // namespace wfpg
