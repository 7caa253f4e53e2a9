// The surfaces of a wave that the recorder knows, for path_guider::prepare(depth, caster).
//
// Source: wfpg's own. Cost: 4 bytes are read for each path, and 24 for each one at the wave's depth.
// Memory: none; it reads the recorder's.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/guide/recorded_wave.hpp>
#include <wfpg/host/bsdf.hpp>

#include <cstdint>

namespace wfpg {

/// Stands for a BSDF that only the host's kernels know. Surfaces of a recorded wave have it. Guides ask it
/// whether light can come from below.
struct kernel_bsdf {
  bool transmits_below = false;  ///< light can come from below the normal

  /// Returns false. Hosts do not report surfaces whose BSDF is delta in all lobes, and leave other delta
  /// lobes to the mixture.
  WFPG_HD bool is_delta() const { return false; }
  /// Returns what the host said of the vertex.
  WFPG_HD bool transmits() const { return transmits_below; }
};

/// Functor from a path's index to its surface: the surfaces of a wave of one depth. Paths that are not at
/// that depth are inactive.
struct recorded_surfaces {
  array_view<const std::uint32_t> states;       ///< of all paths
  array_view<const detail::wave_place> places;  ///< likewise
  std::uint32_t depth = 0;                      ///< of the wave

  /// Returns the surface of path `path`. Its normal stands for the geometric normal and the outgoing
  /// direction too: guides ask only for the side of the surface.
  WFPG_HD surface<kernel_bsdf> operator()(std::uint32_t path) const {
    surface<kernel_bsdf> s;
    const std::uint32_t state = states[path];
    s.active = detail::is_at_depth(state, depth);
    if (!s.active) return s;
    const detail::wave_place at = places[path];
    s.position = at.position;
    s.geometric_normal = s.normal = s.outgoing = at.normal;
    s.path = path;
    s.bsdf.transmits_below = (state & detail::wave_transmits) != 0;
    return s;
  }
  /// Returns the path of ray `path`: itself.
  WFPG_HD std::uint32_t path(std::uint32_t path) const { return path; }
};

}  // namespace wfpg
