// What light leaves voxels, for cones to gather: of a leaf from the emitters in it and the light that they
// send there, of inner nodes the mean of their children, and how opaque nodes are along each axis; and the
// cones, which gather front to back (Crassin et al. 2011, "Interactive Indirect Illumination Using Voxel Cone
// Tracing"). Nodes have two sides, as in the exitance cache, and an opacity for each axis, which two voxels
// in a row are composed to: a wall keeps what is behind it dark, at any level.
#pragma once

#include <wfpg/detail/octree_walk.hpp>
#include <wfpg/detail/voxel_normals.hpp>
#include <wfpg/sparse_voxel_octree.hpp>
#include <wfpg/types.hpp>

namespace wfpg {

/// What a voxel is to irradiance_records.
enum class voxel_tag : std::uint8_t {
  empty,         ///< no surface
  object,        ///< surface
  light,         ///< surface, some of which emits
  directly_lit,  ///< surface that light from an emitter meets, also by way of smooth surfaces
};

namespace detail {

/// Light of a leaf's sides, in integers: their sums are exact in any order.
struct leaf_light {
  std::uint64_t emitted[2];
  std::uint64_t arrived[2];
  std::uint64_t crossed;  ///< went through, from either side to the other

  /// Cones see through it, as straight as they are: what is behind is about where it seems to be.
  WFPG_HD bool is_clear() const { return crossed > arrived[0] + arrived[1]; }
};

/// What a cone finds in a node.
struct voxel_light {
  float radiance[2];  ///< that leaves a side
  float opacity[3];   ///< along each axis, of all of the node
  float area;         ///< of surface, in faces of a leaf
};

/// Area of surface in each leaf, in faces.
struct measure_leaves {
  array_view<const std::uint32_t> fragment_begin;  // a leaf
  array_view<const fragment_surface> fragments;
  float per_face;  // 1 / a leaf's face
  float* areas;

  WFPG_HD void operator()(std::size_t leaf) const {
    const std::size_t begin = fragment_begin[leaf];
    const std::size_t end = leaf + 1 < fragment_begin.size() ? fragment_begin[leaf + 1] : fragments.size();
    float sum = 0.0f;
    for (std::size_t i = begin; i < end; ++i) sum += fragments[i].area;
    areas[leaf] = sum * per_face;
  }
};

/// Light and tags of leaves.
struct light_leaves {
  const leaf_light* light;
  const float* areas;
  node_id first_leaf;
  float emitted_unit, arrived_unit;  // radiance times faces
  voxel_light* nodes;
  voxel_tag* tags;

  WFPG_HD void operator()(std::size_t leaf) const {
    const leaf_light from = light[leaf];
    voxel_light to;
    to.area = areas[leaf];
    bool emits = false, is_lit = false;
    for (int side = 0; side < 2; ++side) {
      emits = emits || from.emitted[side] > 0;
      is_lit = is_lit || from.arrived[side] > 0;
      const float power = static_cast<float>(from.emitted[side]) * emitted_unit +
                          static_cast<float>(from.arrived[side]) * arrived_unit;
      to.radiance[side] = power / max(to.area, least_area);
    }
    for (float& opacity : to.opacity) opacity = from.is_clear() && !emits ? 0.0f : min(to.area, 1.0f);
    nodes[first_leaf + leaf] = to;
    tags[leaf] = emits ? voxel_tag::light : is_lit ? voxel_tag::directly_lit : voxel_tag::object;
  }

 private:
  static constexpr float least_area = 0x1p-10f;  // a cone hardly sees what has less
};

/// An inner node from its children. Along an axis four rows of two stand side by side.
struct gather_children {
  sparse_voxel_octree_view tree;
  const std::uint8_t* swapped;  // an inner node: children whose sides are swapped, a bit each
  voxel_light* nodes;

  WFPG_HD void operator()(node_id node) const {
    const voxel_light* const children = nodes + tree.first_child(node);
    const std::uint32_t mask = tree.child_mask(node);
    voxel_light to{};
    float clear[3][4];  // a row: what its first voxel lets through, and then both
    for (int axis = 0; axis < 3; ++axis)
      for (float& row : clear[axis]) row = 1.0f;
    std::uint32_t c = 0;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      if (!(mask >> octant & 1u)) continue;
      const voxel_light& child = children[c];
      const std::uint32_t other = swapped[node] >> c & 1u;
      to.area += child.area;
      for (std::uint32_t side = 0; side < 2; ++side)
        to.radiance[side] += child.area * child.radiance[side ^ other];
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        clear[axis][row_of(octant, axis)] *= 1.0f - child.opacity[axis];
      ++c;
    }
    for (float& radiance : to.radiance) radiance /= max(to.area, 1.0e-30f);
    for (int axis = 0; axis < 3; ++axis) {
      const float* const rows = clear[axis];
      to.opacity[axis] = 1.0f - 0.25f * (rows[0] + rows[1] + rows[2] + rows[3]);
    }
    nodes[node] = to;
  }

 private:
  /// An octant without the bit of an axis.
  WFPG_HD static std::uint32_t row_of(std::uint32_t octant, std::uint32_t axis) {
    const std::uint32_t below = (1u << axis) - 1u;
    return (octant & below) | (octant >> 1 & ~below);
  }
};

/// What a cone gathered, and the share of it that met nothing.
struct gathered_light {
  float radiance = 0.0f;
  float clear = 1.0f;
};

/// Cones through an octree whose nodes have light.
struct voxel_cones {
  sparse_voxel_octree_view tree;
  const voxel_light* nodes = nullptr;
  const std::uint16_t* normals = nullptr;  // a node

  /// Front to back from a place, world space, along a unit direction: at each step through the node that is
  /// as large as the cone is wide there, or over what is empty. O(nodes passed · depth).
  WFPG_HD gathered_light gather(vec3 from, vec3 direction, float solid_angle) const {
    constexpr float nearly_opaque = 1.0f / 256.0f;
    const vec3 origin = tree.grid().to_grid(from);
    const float voxel = tree.grid().voxel_size();
    const auto extent = static_cast<float>(tree.grid().resolution);
    const float exit = distance_to_exit(origin, direction, extent, false);
    float t = past_face(distance_to_exit(origin, direction, extent, true));
    gathered_light result;
    if (tree.empty() || !leads_somewhere(origin, direction, exit)) return result;
    while (t < exit && result.clear > nearly_opaque) {
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

  /// The side of a node that faces a direction.
  WFPG_HD std::uint32_t side_facing(node_id node, vec3 direction) const {
    return glm::dot(unpack_voxel_direction(normals[node]), direction) >= 0.0f ? 0u : 1u;
  }

 private:
  /// Passes a node along a way of so many of its sides' lengths. A wall across the node is as opaque from
  /// aside as from ahead: light does not leak through walls.
  WFPG_HD void pass(node_id node, vec3 direction, float length, gathered_light& light) const {
    const voxel_light& at = nodes[node];
    const vec3 along = glm::abs(direction);
    const float opacity = at.opacity[0] * along.x + at.opacity[1] * along.y + at.opacity[2] * along.z;
    const float layers = length * max(along.x, max(along.y, along.z));
    const float clear = opacity < 0.9999f ? powf(1.0f - opacity, layers) : 0.0f;
    light.radiance += light.clear * (1.0f - clear) * at.radiance[side_facing(node, -direction)];
    light.clear *= clear;
  }
};

}  // namespace detail
}  // namespace wfpg
