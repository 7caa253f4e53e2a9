// Builds voxel fragments by casting rays, for hosts that have a ray caster but no triangles in hand. Lines
// cross the scene's box and go on behind each hit, so that they find rooms inside rooms.
//
// Source: none. The lines of the first round fill a voxel's width each, as those of a scan-line voxelizer do.
// Cost: three rays for each hit and each line, and fragments_from_samples(). The default casts 6 resolution²
// lines in each round.
// Memory: 52 bytes a hit, up to 70 while hits are collected, and at most 52 MiB for the lines in flight.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <cstdint>
#include <optional>

namespace wfpg {

/// Options of fragments_from_caster(): how many lines it casts, and where.
struct caster_fragments_options {
  /// Voxels along each side of the octree's cube: a power of two in [1, 4096]. Give it the guide's value.
  std::uint32_t octree_resolution = 128;
  /// Lines of each round, in [1, 2²⁸]. Unset: 6 resolution², one through each voxel of each face, but at most
  /// 2²².
  ///
  /// More lines find more of small surfaces. A round takes time in proportion.
  std::optional<std::uint32_t> rays;
  /// Rounds, in [1, 64]. The first casts lines along the axes, through a grid over the cube's faces. Lines of
  /// every second round start at hits, those of the others at the faces, in random directions.
  std::uint32_t rounds = 3;
  /// Hits of one line at most, in [1, 65536]. A line ends after them, or where it leaves the cube.
  std::uint32_t crossings = 64;
  /// Seed of all random numbers. Equal seeds give equal fragments.
  std::uint64_t seed = 0;
};

/// Makes voxel fragments from the hits of a ray caster, one a hit. `bounds` is the box of the scene's
/// surfaces, world space. The octree's cube lies around it, as fragments_from_samples() makes it.
///
/// A hit has no normal. Two more rays, a sixteenth of a voxel beside the first, hit the same surface and give
/// its plane. Where they hit something else, the normal is the direction toward the ray's origin, and the
/// fragment counts little beside others. A line goes on a quarter of a voxel behind each hit. What lies
/// nearer behind is found from the other side.
///
/// The report counts hits that are skipped, which end their lines. `non_finite`: the distance is NaN or
/// infinite, or leads beyond largest_coordinate. `out_of_range`: the hit is beyond the cube.
///
/// `caster` has at least one form of ray_caster.hpp; the inline form is used where it has both. Rays begin
/// inside the cube and have its far side as t_max, which casters may ignore.
///
/// Throws std::invalid_argument for bounds that are empty, not finite or beyond largest_coordinate, and for
/// options out of range. Throws out_of_memory, and what the caster throws.
template <class Exec, class Caster>
voxel_fragments<Exec> fragments_from_caster(const Exec& exec, const Caster& caster, const bounds3& bounds,
                                            const caster_fragments_options& options = {});

}  // namespace wfpg

#include <wfpg/octree/detail/fragments_from_caster_impl.hpp>
