// Cones through an octree whose nodes have light and opacity. A cone gathers light front to back. At each
// step it reads the node that is as large as the cone is wide there. Source: Crassin et al. 2011,
// "Interactive Indirect Illumination Using Voxel Cone Tracing"; section 3.3 of the paper names it.
//
// Nodes have an opacity for each axis. Two voxels in a row are composed, and rows side by side are averaged.
// A wall thus keeps what is behind it dark, at any level.
//
// Cost: O(nodes passed · depth) a cone. No memory of its own.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/octree/detail/octree_walk.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg::detail {

/// Composes the opacity of an inner node. Along each axis, its eight octants form four rows of two. A row
/// lets through the product of its octants' clear fractions; the four rows are averaged.
class child_rows {
 public:
  /// All octants empty: every row lets all light through.
  WFPG_HD child_rows() {
    for (auto& axis : clear_)
      for (float& row : axis) row = 1.0f;
  }
  /// Adds the child in an octant, with its opacity along each axis in [0, 1]. Empty octants are not added.
  WFPG_HD void add(std::uint32_t octant, vec3 opacity) {
    for (std::uint32_t axis = 0; axis < 3; ++axis)
      clear_[axis][row_of(octant, axis)] *= 1.0f - opacity[static_cast<int>(axis)];
  }
  /// Opacity of all children together along each axis, in [0, 1].
  WFPG_HD vec3 opacity() const {
    vec3 result;
    for (int axis = 0; axis < 3; ++axis) {
      // Each row covers a quarter of the node's face.
      const float* const rows = clear_[axis];
      result[axis] = 1.0f - 0.25f * (rows[0] + rows[1] + rows[2] + rows[3]);
    }
    return result;
  }

 private:
  /// Row of an octant along an axis, 0 to 3: the octant without that axis's bit.
  WFPG_HD static std::uint32_t row_of(std::uint32_t octant, std::uint32_t axis) {
    const std::uint32_t below = (1u << axis) - 1u;
    return (octant & below) | (octant >> 1 & ~below);
  }

  /// Fraction of light that each row lets through, along each axis.
  float clear_[3][4];
};

/// What a cone gathered.
struct gathered_light {
  float radiance = 0.0f;  ///< of the nodes that it met, W/(m² sr)
  float clear = 1.0f;     ///< fraction of the cone that met nothing, in [0, 1]
};

/// Cones through an octree. `Nodes` has the members
///   vec3 opacity(node_id) const;                  along each axis, of all of a node, in [0, 1]
///   float radiance(node_id, vec3 toward) const;   of the side that faces a direction
template <class Nodes>
struct voxel_cones {
  sparse_voxel_octree_view tree;  ///< the octree, not owned
  Nodes nodes;                    ///< light and opacity of its nodes

  /// Gathers light front to back along `axis`, from its t_min to its t_max, scene units. `solid_angle` in
  /// steradians. Where there is no node as large as the cone is wide, the march goes over the empty cube in
  /// one step. It ends when 1/256 or less is left clear, which then counts as 0. A ray that leads nowhere
  /// gathers nothing. O(nodes passed · depth).
  WFPG_HD gathered_light gather(const ray& axis, float solid_angle) const {
    // Nodes behind would add less than this fraction of their radiance.
    constexpr float nearly_opaque = 1.0f / 256.0f;
    // The march is in voxels.
    const vec3 origin = tree.grid().to_grid(axis.origin), direction = axis.direction;
    const float voxel = tree.grid().voxel_size();
    const auto extent = static_cast<float>(tree.grid().resolution);
    const float exit = distance_to_exit(origin, direction, extent, false);
    const float end = min(exit, axis.t_max / voxel);
    float t = past_face(max(axis.t_min / voxel, distance_to_exit(origin, direction, extent, true)));
    gathered_light result;
    if (tree.empty() || !is_direction(origin, direction, exit)) return result;
    // A step: find the node or gap at t, pass it, and go on behind its face.
    while (t < end && result.clear > nearly_opaque) {
      // The octree's border belongs to its last voxels.
      const vec3 cell = glm::clamp(origin + t * direction, vec3(0.0f), vec3(extent - 0.5f));
      vec3 lower;
      float size;
      const node_id node =
          node_or_gap(tree, uvec3(cell), tree.level_for_cone(t * voxel, solid_angle), lower, size);
      // Rounding must not lead the march backward.
      const float next = max(distance_to_exit(origin - lower, direction, size, false), t);
      if (node != invalid_node) pass(node, direction, (next - t) / size, result);
      t = past_face(next);
    }
    // What is left of an opaque cone is no light of the environment.
    if (result.clear <= nearly_opaque) result.clear = 0.0f;
    return result;
  }

 private:
  /// Passes a node along `length` of its sides. The opacity is the sum of the axes' opacities, weighted with
  /// |direction|. A wall across the node is as opaque to a slanted cone as to a straight one, so light does
  /// not leak through it.
  WFPG_HD void pass(node_id node, vec3 direction, float length, gathered_light& light) const {
    const vec3 along = glm::abs(direction);
    const float opacity = glm::dot(nodes.opacity(node), along);
    // How many layers of nodes the path is worth: 1 from face to face.
    const float layers = length * max(along.x, max(along.y, along.z));
    // Opacity of one layer, to the power of the layers passed (Beer-Lambert).
    const float clear = opacity < 0.9999f ? powf(1.0f - opacity, layers) : 0.0f;
    // Front to back: what is behind is seen through what is in front.
    light.radiance += light.clear * (1.0f - clear) * nodes.radiance(node, -direction);
    light.clear *= clear;
  }
};

}  // namespace wfpg::detail
