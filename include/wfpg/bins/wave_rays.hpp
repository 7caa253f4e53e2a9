// The rays of a host's wave as the spatial binner reads them: position, orientation, and whether they need a
// bin. They are the input of Algorithm 2 (paper, section 3.4).
// Cost: one surface a ray, read in the kernel that bins it; no memory. Rays of paths that the guide takes no
// part in cost one look-up of their path instead, where the host's functor has path().
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/host/recorded_runs.hpp>
#include <wfpg/host/wave.hpp>

namespace wfpg {

/// Functor from a ray's index to a ray_to_bin, for spatial_binner::bin(). `Surfaces` maps an index of the
/// wave to a surface. Inactive rays and those on delta surfaces get no bin: a delta BSDF is sampled without a
/// guide. A ray whose normal is not finite or not about unit length has no bin either. It counts as outside
/// every voxel.
template <class Surfaces>
struct wave_rays {
  Surfaces surfaces;                ///< the host's: (std::uint32_t) -> surface
  guiding_mode mode;                ///< whether bins are split by orientation
  recorded_runs guided_paths = {};  ///< rays of other paths are inactive
  /// Index of path 0 among the paths of all ranks; no_path without ranks.
  std::uint32_t first_path = no_path;

  /// Number of ray i: its index, or with ranks that of its path among all paths. Then it does not depend on
  /// the number of ranks, where the wave's rays are those of all.
  WFPG_HD std::uint32_t number(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    if (first_path == no_path) return ray;
    const std::uint32_t path = path_of(ray);
    return first_path + (path == no_path ? ray : path);
  }
  /// Describes ray i. It is not active where its path takes no part in guiding, or its surface is not active.
  /// In oriented mode, surfaces that reflect are split by the shading normal on the outgoing side. Surfaces
  /// that transmit share one orientation.
  WFPG_HD ray_to_bin operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    ray_to_bin result;
    // While the guide probes, most rays are of other paths. Reading a surface may take as long as finding its
    // field.
    if constexpr (gives_paths_v<Surfaces>)
      if (guided_paths.log2_divisor() > 0 && !guided_paths.includes(surfaces.path(ray))) return result;
    const auto s = surfaces(ray);
    result.active = s.active && !s.bsdf.is_delta() && guided_paths.includes(s.path);
    result.paths = s.path == no_path ? 1u : 1u << guided_paths.log2_divisor();
    if (!result.active) return result;
    // A position that is NaN lies in no voxel.
    result.position = is_normal(s.normal) ? s.position : vec3(bits_float(0x7fc00000u));
    if (mode == guiding_mode::oriented)
      result.orientation = s.bsdf.transmits() ? static_cast<std::uint32_t>(orientation_transmits)
                                              : dominant_axis(facing_normal(s));
    return result;
  }

 private:
  /// Path of a ray, or no_path where the host does not tell it.
  /// Reads as little of the surface as the host allows.
  WFPG_HD std::uint32_t path_of(std::uint32_t ray) const {
    if constexpr (gives_paths_v<Surfaces>)
      return surfaces.path(ray);
    else
      return surfaces(ray).path;
  }
};

}  // namespace wfpg
