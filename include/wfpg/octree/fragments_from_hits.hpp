// Builds voxel fragments from the hits of paths, and closes the holes between hits. A sample of a small
// picture hits half of the voxels that its paths see. Rays that end in the other half would not be guided,
// and the light from there would be lost.
//
// Each hit becomes a square in its tangent plane, as large as hits are sparse around it. The distance between
// hits follows from the smallest cube of the octree that holds eight of them. Where hits are dense, squares
// are no larger than a voxel, and a hit has one fragment, as of fragments_from_samples().
//
// Source: none.
// Cost: a sort of the hits, and up to 24 binary searches among them for each. Memory: 16 bytes a fragment, of
// which there are about 10 a voxel where hits are sparse. While it runs, 36 more a hit.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <cstdint>

namespace wfpg {

/// Makes fragments from the hits of a sample's paths, as surface_collector has them: one a hit, and more
/// around it where hits are sparse. `resolution`, `bounds` and the report are those of
/// fragments_from_samples().
///
/// Fragments around a hit count little beside those of other hits, so that these decide a voxel's normal. The
/// square of a hit may reach beyond the edge of its surface, by about the distance between hits. Voxels there
/// cost memory alone, as long as rays and cones go through the host's scene. Do not take the octree for the
/// scene: svo_ray_caster would find the squares.
///
/// Throws as fragments_from_samples() does.
template <class Exec>
voxel_fragments<Exec> fragments_from_hits(const Exec& exec, array_view<const surface_fragment> hits,
                                          std::uint32_t resolution, const bounds3& bounds = {});

}  // namespace wfpg

#include <wfpg/octree/detail/fragments_from_hits_impl.hpp>
