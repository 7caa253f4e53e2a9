// Options that say how rays form bins: the parameters of Algorithm 2 (paper, section 3.4), and which
// directions the field of a bin covers. The paper's own setting is l_min 5, c_ray 512 and fields over the
// sphere (Table 1).
#pragma once

#include <cstdint>

namespace wfpg {

/// Which rays share a bin, and over which directions the bin's field is defined.
enum class guiding_mode : std::uint8_t {
  /// Rays of one node and orientation. Where surfaces reflect, a field covers the hemisphere and carries the
  /// cosine. Where they transmit, it covers the sphere.
  oriented,
  /// The paper's: rays of one node. Fields cover the sphere and carry radiance alone.
  plain,
};

/// Parameters of Algorithm 2. Larger bins need fewer fields, and each field fits its rays less well.
struct binning_options {
  /// l_min: no bin is larger than a node of this level. The root is level 0. Values above the leaves' level
  /// act as the leaves' level.
  std::uint32_t min_level = 3;
  /// c_ray, at least 1: number of rays of a wave that make a node a bin. A kept field's bin gets about as
  /// many rays in a sample, or more where the budget of fields does not suffice.
  std::uint32_t rays_per_bin = 64;
};

}  // namespace wfpg
