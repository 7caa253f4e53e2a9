// Steps of a march through the octree along a line: from a node, or from an empty cube, to the next one
// (after Laine & Karras 2010). Points and distances are in voxels of the leaves. O(depth) a step, no memory.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg::detail {

/// Moves a distance a little further, so that the point is past a face in spite of rounding. The step is 1e-3
/// voxels, and more far from the line's origin.
WFPG_HD inline float past_face(float t) {
  return t + max(1.0e-3f, t * 0x1p-22f);
}

/// Distance at which a line leaves the cube [0, size]³, or with `enter`, at which it enters it. A line that
/// starts inside enters at 0. One that runs beside the cube, parallel to a face, leaves at 0 and enters at
/// 3e38. A line of zero direction inside the cube never leaves.
WFPG_HD inline float distance_to_exit(vec3 origin, vec3 direction, float size, bool enter) {
  float result = enter ? 0.0f : 3.0e38f;
  for (int axis = 0; axis < 3; ++axis) {
    if (fabsf(direction[axis]) < 1.0e-12f) {
      const bool beside = origin[axis] < 0.0f || origin[axis] > size;
      if (beside) return enter ? 3.0e38f : 0.0f;
      continue;
    }
    const bool positive = direction[axis] > 0.0f;
    const float face = positive != enter ? size : 0.0f;
    const float t = (face - origin[axis]) / direction[axis];
    result = enter ? max(result, t) : min(result, t);
  }
  return result;
}

/// Finds the node of a level that holds a voxel, or invalid_node where there is none. `lower` and `size`
/// receive the node's cube. Without a node, they receive the largest empty cube that holds the voxel.
/// O(level).
WFPG_HD inline node_id node_or_gap(const sparse_voxel_octree_view& tree, uvec3 voxel, std::uint32_t level,
                                   vec3& lower, float& size) {
  node_id node = 0;
  std::uint32_t below = tree.depth();  // levels below the node
  while (below > tree.depth() - level && node != invalid_node) {
    --below;
    const std::uint32_t octant =
        (voxel.x >> below & 1u) | (voxel.y >> below & 1u) << 1 | (voxel.z >> below & 1u) << 2;
    node = tree.child(node, octant);
  }
  size = static_cast<float>(1u << below);
  lower = vec3((voxel >> below) << below);
  return node;
}

/// Whether a line can be marched along: origin, direction and the distance `exit` to the octree's end are
/// sound.
WFPG_HD inline bool is_direction(vec3 origin, vec3 direction, float exit) {
  return exit < 3.0e38f && is_finite(origin) && is_finite(direction);
}

}  // namespace wfpg::detail
