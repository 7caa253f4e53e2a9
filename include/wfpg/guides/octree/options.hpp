// Options of the octree's guides, kept_guide and transient_guide. A guide's constructor checks the ranges,
// and throws std::invalid_argument.
//
// Sources: Yalciner and Akyuz (2024), sections 3 and 4, and the thesis (2024), Eq. 5.1. Options of kept
// fields, lights and recording are wfpg's own. Memory: each option that costs bytes says how many.
#pragma once

#include <wfpg/bins/binning_options.hpp>
#include <wfpg/guide/sampling_options.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace wfpg {

/// How the cells of a field become a distribution.
struct field_options {
  /// Width alpha of the Gaussian filter exp(-x²/alpha²), in cells of a field over the sphere, at least 0. 0:
  /// no filter (thesis, Eq. 5.1). Over a hemisphere the filter spans √2 as many cells, which are narrower:
  /// the same angle.
  float filter_alpha = 0.8f;
  /// Epsilon, at least 0: added to each cell, times the field's mean unless `absolute_floor`. A positive one
  /// keeps every direction's density positive.
  float floor = 1.0e-2f;
  /// `floor` is a radiance (luminance, W/(m² sr)), not a fraction of the mean.
  bool absolute_floor = false;
};

/// How groups of lights are chosen for next-event estimation.
struct light_guide_options {
  /// Weight of each group of lights before anything is learnt, such as its power: finite, at least 0. At
  /// least one is positive, and there are at most 256. A group of weight 0 is never chosen. Empty: light
  /// choices are not learnt.
  std::vector<float> weights;
  /// Nodes along the octree's side at the deepest level that learns; a power of two in [1, 4096].
  std::uint32_t resolution = 32;
  /// Fraction of choices that ignore what was learnt, in (0, 1). It bounds the noise where a learnt
  /// probability is too low.
  float floor = 0.2f;
};

/// Resolution, memory and refresh of kept fields.
struct kept_field_options {
  /// F: cells along a field's side, in [2, 128]. A field casts F² cones when it is new.
  std::uint32_t resolution = 32;
  /// R: a refresh casts one of R cones again, at least 1. At F² and above, one cone.
  std::uint32_t recast = 32;
  /// Bytes of all slots. One slot takes about 10 F² bytes, or 8 F² where fields do not learn.
  std::size_t budget_bytes = std::size_t(24) << 20;
  bool learn = true;  ///< fields learn from paths, where the host calls path_recorder_view::scatter()
  /// Number of path samples that a cell's cone counts as; positive and finite.
  float cone_samples = 1.0f;
  /// Cones that one wave casts at most. Other builds wait for the next wave. A ray whose field is not built
  /// yet uses an ancestor's, or is not guided. The default is no limit.
  std::uint64_t max_wave_cones = ~std::uint64_t(0);
  /// A slot that no ray used for this many samples is freed; at least 1.
  std::uint32_t idle_samples = 16;
};

/// Options of both guides, beside sampling_options. `guide_fraction` is in (0, 1], and below 1 with products.
/// Its default is 0.5 in plain mode, and 0.7 in oriented mode. A transient oriented bin of fewer than
/// binning.rays_per_bin rays has 0.5. Kept fields that learn begin with the default, and each learns its own:
/// learnt_fractions.hpp. A fraction that is set stays.
struct octree_guide_options : sampling_options {
  /// Voxels along the scene's longest side; a power of two in [1, 4096].
  std::uint32_t octree_resolution = 128;
  /// How rays form bins, and whether fields cover hemispheres or spheres.
  guiding_mode mode = guiding_mode::oriented;
  binning_options binning;     ///< size of bins
  field_options field;         ///< filter and floor
  light_guide_options lights;  ///< groups of lights that next-event estimation chooses from
  /// P: each ray samples its field times its BSDF, evaluated in P x P blocks. P is 4, 8 or 16, and divides
  /// the fields' resolutions; 16 does not divide the default of kept.resolution. Unset: rays sample fields
  /// alone.
  std::optional<std::uint32_t> product_resolution;
  /// Target deposits per leaf and sample, at least 1; sets the recorded fraction of paths. After warm-up a
  /// quarter of that, in one sample of four. Recording costs the same however many pixels there are. Unset:
  /// all paths of all samples.
  std::optional<std::uint32_t> deposits_per_leaf = 16;
  /// Capacity of a sample's deposits, and of values that fields learn, at most 2^31. Unset: enough for the
  /// recorder. A host that deposits by itself sets it, and may then deposit in any sample.
  std::optional<std::size_t> deposit_capacity;
  std::size_t caster_buffer_bytes = std::size_t(16) << 20;  ///< bytes of a batch caster's cones in flight
  /// A number that identifies the scene, such as a checksum. load_guide() refuses a guide that was saved with
  /// another.
  std::uint64_t scene_tag = 0;
};

/// Options of kept_guide: those of both guides, and `kept`.
struct kept_guide_options : octree_guide_options {
  kept_field_options kept;  ///< resolution, budget and refresh of kept fields
};

/// Options of transient_guide: those of both guides, and the fields' resolution.
struct transient_guide_options : octree_guide_options {
  /// F at depth 0: cells along a field's side, in [2, 128]. It halves at each depth.
  std::uint32_t field_resolution = 32;
  /// F does not become smaller than this, in [2, 128].
  std::uint32_t min_field_resolution = 16;
};

}  // namespace wfpg
