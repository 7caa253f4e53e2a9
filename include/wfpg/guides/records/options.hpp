// Options of irradiance_records: resolutions of voxels and records, and how much work building them takes.
//
// Source: Jhang & Chang, "An Unbiased Hybrid Rendering Approach to Path Guiding", sections 2 and 4.
// Cost and memory: irradiance_records.hpp says how they follow from these options.
#pragma once

#include <wfpg/guide/sampling_options.hpp>

#include <cstdint>

namespace wfpg {

/// Options of irradiance_records, beside sampling_options. guide_fraction is 0.5 where unset. The guide's
/// constructor throws std::invalid_argument for values out of range.
struct irradiance_records_options : sampling_options {
  /// Sets unguided_samples to 0: the guide learns nothing from paths, so that the first sample is guided.
  irradiance_records_options() { unguided_samples = 0; }

  /// Voxels along the scene's longest side, a power of two in [1, 4096]. Voxels have tags and light.
  std::uint32_t octree_resolution = 64;
  /// Level of the octree whose nodes have a record; 4: 16 nodes a side. Levels below the leaves count as the
  /// leaves'.
  std::uint32_t record_level = 4;
  /// Rays cast from emitters to find directly lit voxels, in [1, 2^31].
  std::uint32_t emitter_rays = 1u << 18;
  /// Fraction of light that a directly lit surface reflects, in [0, 1]; one for all surfaces.
  float albedo = 0.5f;
  /// Cones that each of a record's 128 directions gathers from, in [1, 256].
  std::uint32_t cones_per_direction = 4;
  std::uint32_t smooth_bounces = 8;  ///< most smooth surfaces that a ray from an emitter follows; at most 64
  float floor = 0.01f;  ///< least weight of a direction, in multiples of the record's mean, in [0, 1]
};

}  // namespace wfpg
