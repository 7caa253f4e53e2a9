// Cones through an octree whose nodes have light and opacity: they gather front to back, at each step from
// the node that is as large as the cone is wide there (Crassin et al. 2011, "Interactive Indirect
// Illumination Using Voxel Cone Tracing"). Nodes have an opacity for each axis, which two voxels in a row are
// composed to: a wall keeps what is behind it dark, at any level.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/octree/detail/octree_walk.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg::detail {

/// What an inner node lets through: along an axis four rows of two children stand side by side.
class child_rows {
 public:
  WFPG_HD child_rows() {
    for (auto& axis : clear_)
      for (float& row : axis) row = 1.0f;
  }
  /// A child, of an opacity along each axis.
  WFPG_HD void add(std::uint32_t octant, vec3 opacity) {
    for (std::uint32_t axis = 0; axis < 3; ++axis)
      clear_[axis][row_of(octant, axis)] *= 1.0f - opacity[static_cast<int>(axis)];
  }
  /// Of all children together, along each axis.
  WFPG_HD vec3 opacity() const {
    vec3 result;
    for (int axis = 0; axis < 3; ++axis) {
      const float* const rows = clear_[axis];
      result[axis] = 1.0f - 0.25f * (rows[0] + rows[1] + rows[2] + rows[3]);
    }
    return result;
  }

 private:
  /// An octant without the bit of an axis.
  WFPG_HD static std::uint32_t row_of(std::uint32_t octant, std::uint32_t axis) {
    const std::uint32_t below = (1u << axis) - 1u;
    return (octant & below) | (octant >> 1 & ~below);
  }

  float clear_[3][4];  // a row: what its first voxel lets through, and then both
};

/// What a cone gathered, and the share of it that met nothing.
struct gathered_light {
  float radiance = 0.0f;
  float clear = 1.0f;
};

/// Cones through an octree. Nodes is
///   vec3 opacity(node_id) const;                along each axis, of all of a node
///   float radiance(node_id, vec3 toward) const;  that leaves its side which faces a direction
template <class Nodes>
struct voxel_cones {
  sparse_voxel_octree_view tree;
  Nodes nodes;

  /// Front to back along a ray, the cone's axis: at each step through the node that is as large as the cone
  /// is wide there, or over what is empty. A ray that leads nowhere meets nothing. O(nodes passed · depth).
  WFPG_HD gathered_light gather(const ray& axis, float solid_angle) const {
    constexpr float nearly_opaque = 1.0f / 256.0f;
    const vec3 origin = tree.grid().to_grid(axis.origin), direction = axis.direction;
    const float voxel = tree.grid().voxel_size();
    const auto extent = static_cast<float>(tree.grid().resolution);
    const float exit = distance_to_exit(origin, direction, extent, false);
    const float end = min(exit, axis.t_max / voxel);
    float t = past_face(max(axis.t_min / voxel, distance_to_exit(origin, direction, extent, true)));
    gathered_light result;
    if (tree.empty() || !leads_somewhere(origin, direction, exit)) return result;
    while (t < end && result.clear > nearly_opaque) {
      const vec3 cell = glm::clamp(origin + t * direction, vec3(0.0f), vec3(extent - 0.5f));
      vec3 lower;
      float size;
      const node_id node =
          node_or_gap(tree, uvec3(cell), tree.level_for_cone(t * voxel, solid_angle), lower, size);
      const float next = max(distance_to_exit(origin - lower, direction, size, false), t);
      if (node != invalid_node) pass(node, direction, (next - t) / size, result);
      t = past_face(next);
    }
    if (result.clear <= nearly_opaque) result.clear = 0.0f;
    return result;
  }

 private:
  /// Passes a node along a way of so many of its sides' lengths. A wall across the node is as opaque from
  /// aside as from ahead: light does not leak through walls.
  WFPG_HD void pass(node_id node, vec3 direction, float length, gathered_light& light) const {
    const vec3 along = glm::abs(direction);
    const float opacity = glm::dot(nodes.opacity(node), along);
    const float layers = length * max(along.x, max(along.y, along.z));
    const float clear = opacity < 0.9999f ? powf(1.0f - opacity, layers) : 0.0f;
    light.radiance += light.clear * (1.0f - clear) * nodes.radiance(node, -direction);
    light.clear *= clear;
  }
};

}  // namespace wfpg::detail
