// What irradiance_records can be told (Jhang & Chang, "An Unbiased Hybrid Rendering Approach to Path
// Guiding").
#pragma once

#include <wfpg/guide/sampling_options.hpp>

#include <cstdint>

namespace wfpg {

/// What irradiance_records can be told, beside sampling_options, of which guide_fraction is 0.5 by default,
/// and unguided_samples 0, since nothing is learnt from them. Ranges are checked when a guider is made.
struct irradiance_records_options : sampling_options {
  /// All samples are guided.
  irradiance_records_options() { unguided_samples = 0; }

  std::uint32_t octree_resolution =
      64;  ///< voxels along the scene's longest side that have tags and light; a power of two in [1, 4096]
  std::uint32_t record_level = 4;  ///< records are of this level's nodes, at most the leaves'; 4: 16 a side
  std::uint32_t emitter_rays = 1u << 18;  ///< that find directly lit voxels, in [1, 2^31]
  float albedo = 0.5f;                    ///< of what they light, in [0, 1]
  std::uint32_t cones_per_direction = 4;  ///< of each record, in [1, 256]
  std::uint32_t smooth_bounces = 8;       ///< that a ray from an emitter follows, at most 64
  float floor = 0.01f;  ///< that each direction has at least, times the record's mean, in [0, 1]
};

}  // namespace wfpg
