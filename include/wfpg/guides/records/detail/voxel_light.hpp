// Light that leaves voxels, and their opacity, for cones to gather. A leaf's light is that of the emitters in
// it and what it reflects of theirs. An inner node's is the mean of its children's. Opacity is kept for each
// axis. Nodes have two sides, as in the exitance cache.
//
// Source: Jhang & Chang, "An Unbiased Hybrid Rendering Approach to Path Guiding", section 2.2.
// Memory: 40 bytes a leaf and 24 a node, while records are built.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxel_cones.hpp>
#include <wfpg/octree/voxel_normals.hpp>

namespace wfpg {

/// What a voxel is to irradiance_records.
enum class voxel_tag : std::uint8_t {
  empty,         ///< no surface
  object,        ///< surface
  light,         ///< surface, some of which emits
  directly_lit,  ///< surface that light from an emitter meets, also by way of smooth surfaces
};

namespace detail {

/// Sums of a leaf's light by side, in integers, which are exact in any order. 40 bytes.
struct leaf_light {
  std::uint64_t emitted[2];  ///< by emitters in the leaf
  std::uint64_t arrived[2];  ///< power of rays that ended here
  std::uint64_t crossed;     ///< power of rays that went through, from either side to the other

  /// Whether more light crosses than ends here. Cones then pass through, unbent: what is behind is about
  /// where it seems to be.
  WFPG_HD bool is_clear() const { return crossed > arrived[0] + arrived[1]; }
};

/// Light and opacity of a node. 24 bytes.
struct voxel_light {
  float radiance[2];  ///< mean radiance that leaves each side
  vec3 opacity;       ///< along each axis, in [0, 1], of the whole node
  float area;         ///< area of surface in the node, in faces of a leaf
};

/// Kernel that sums the area of surface in each leaf, in faces of the leaf.
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

/// Kernel that converts a leaf's sums to radiance, opacity and a tag. Its opacity is its area, at most 1, or
/// 0 if it is clear and does not emit.
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
    to.opacity = vec3(from.is_clear() && !emits ? 0.0f : min(to.area, 1.0f));
    nodes[first_leaf + leaf] = to;
    tags[leaf] = emits ? voxel_tag::light : is_lit ? voxel_tag::directly_lit : voxel_tag::object;
  }

 private:
  static constexpr float least_area = 0x1p-10f;  // a cone hardly sees what has less
};

/// Kernel that computes an inner node from its children. Radiance is the mean by area.
struct gather_children {
  sparse_voxel_octree_view tree;
  const std::uint8_t* swapped;  // an inner node: children whose sides are swapped, a bit each
  voxel_light* nodes;

  WFPG_HD void operator()(node_id node) const {
    const voxel_light* const children = nodes + tree.first_child(node);
    const std::uint32_t mask = tree.child_mask(node);
    voxel_light to{};
    child_rows rows;
    std::uint32_t c = 0;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      if (!(mask >> octant & 1u)) continue;
      const voxel_light& child = children[c];
      const std::uint32_t other = swapped[node] >> c & 1u;
      to.area += child.area;
      for (std::uint32_t side = 0; side < 2; ++side)
        to.radiance[side] += child.area * child.radiance[side ^ other];
      rows.add(octant, child.opacity);
      ++c;
    }
    for (float& radiance : to.radiance) radiance /= max(to.area, 1.0e-30f);
    to.opacity = rows.opacity();
    nodes[node] = to;
  }
};

/// The interface of nodes that voxel_cones asks for.
struct lit_nodes {
  const voxel_light* lights = nullptr;
  const std::uint16_t* normals = nullptr;

  WFPG_HD vec3 opacity(node_id node) const { return lights[node].opacity; }
  WFPG_HD float radiance(node_id node, vec3 toward) const {
    return lights[node].radiance[side_facing(node, toward)];
  }
  /// Side of a node that faces a direction: 0 on the side of the node's normal, else 1.
  WFPG_HD std::uint32_t side_facing(node_id node, vec3 direction) const {
    return glm::dot(unpack_voxel_direction(normals[node]), direction) >= 0.0f ? 0u : 1u;
  }
};

}  // namespace detail
}  // namespace wfpg
