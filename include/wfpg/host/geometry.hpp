// A host's geometry as the library takes it: triangles, or samples of surfaces that are not triangles.
// It is read once, by the voxelizer, and not kept.
// Source: the paper's octree is built from such geometry (section 4).
// Cost: none. Memory: views own nothing; a fragment has 28 bytes.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

namespace wfpg {

/// A host's triangles, in the policy's memory.
/// Vertices are in counter-clockwise order seen from the outside.
struct triangle_mesh_view {
  array_view<const vec3> positions;   ///< world space; |coordinate| <= largest_coordinate
  array_view<const uvec3> triangles;  ///< three indices into positions each
};

/// A sample of a surface, for voxelization.
/// world space, scene units
struct surface_fragment {
  vec3 position{0.0f};            ///< world space
  vec3 normal{0.0f, 0.0f, 1.0f};  ///< unit length
  float area = 1.0f;              ///< positive; only its ratio to others in a voxel matters
};

/// Largest magnitude of a coordinate that geometry may have, scene units.
/// Squares of it stay finite floats.
inline constexpr float largest_coordinate = 1.0e15f;

/// Returns whether a position can be voxelized: finite, no coordinate beyond largest_coordinate.
WFPG_HD inline bool is_valid_position(vec3 p) {
  return is_finite(p) && fabsf(p.x) <= largest_coordinate && fabsf(p.y) <= largest_coordinate &&
         fabsf(p.z) <= largest_coordinate;
}

}  // namespace wfpg
