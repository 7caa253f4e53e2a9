// What the kernels of bidirectional methods tell of camera paths and of the photons near them.
#pragma once

#include "tracer/technique_set.hpp"

#include <wfpg/light/light_gather.hpp>

#include <cstddef>
#include <cstdint>

namespace render {

struct subpath;
struct subpath_vertex;

/// A photon within the radius of a camera path's vertex or segment.
struct photon_in_reach {
  technique by;
  std::uint32_t segments;  ///< of the camera path, with the one that it is near
  wfpg::photon_merge at;   ///< index: of the light path's stored vertex; of bb1d, of its beam
};

/// An observer that looks at nothing. Calls for one pixel come from one thread at a time. Others have these
/// functions, too.
struct no_observer {
  /// A camera path has followed its segment with that number, from 1. `vertex`: where it arrives, or null.
  WFPG_HD void follow(std::size_t, const subpath&, std::uint32_t, const subpath_vertex*) const {}
  /// A part of a segment is merged with the photons along it.
  WFPG_HD void cross(std::size_t, std::uint32_t, const wfpg::path_beam&) const {}
  /// A photon is in reach.
  WFPG_HD void reach(std::size_t, const photon_in_reach&) const {}
  /// The last photon in reach merges. `value`: what it brings to the pixel, before its weight.
  WFPG_HD void merge(std::size_t, wfpg::vec3, float) const {}
};

}  // namespace render
