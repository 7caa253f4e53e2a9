// The rays of a host's wave as the binner takes them.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/host/bsdf.hpp>

namespace wfpg {

/// A wave's rays as the binner wants them. Delta surfaces are sampled alone and need no bin; those whose
/// normal is none have none, as if they lay outside every voxel.
template <class Surfaces>
struct wave_rays {
  Surfaces surfaces;
  guiding_mode mode;
  WFPG_HD ray_to_bin operator()(std::size_t i) const {
    const auto s = surfaces(static_cast<std::uint32_t>(i));
    ray_to_bin result;
    result.active = s.active && !s.bsdf.is_delta();
    if (!result.active) return result;
    result.position = is_normal(s.normal) ? s.position : vec3(bits_float(0x7fc00000u));
    if (mode == guiding_mode::oriented)
      result.orientation = s.bsdf.transmits() ? static_cast<std::uint32_t>(orientation_transmits)
                                              : dominant_axis(facing_normal(s));
    return result;
  }
};

}  // namespace wfpg
