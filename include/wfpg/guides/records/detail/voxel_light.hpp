// What light leaves voxels, for cones to gather: of a leaf from the emitters in it and the light that they
// send there, of inner nodes the mean of their children, and how opaque nodes are along each axis. Nodes have
// two sides, as in the exitance cache.
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
  vec3 opacity;       ///< along each axis, of all of the node
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
    to.opacity = vec3(from.is_clear() && !emits ? 0.0f : min(to.area, 1.0f));
    nodes[first_leaf + leaf] = to;
    tags[leaf] = emits ? voxel_tag::light : is_lit ? voxel_tag::directly_lit : voxel_tag::object;
  }

 private:
  static constexpr float least_area = 0x1p-10f;  // a cone hardly sees what has less
};

/// An inner node from its children.
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

/// All nodes, as cones see them.
struct lit_nodes {
  const voxel_light* lights = nullptr;
  const std::uint16_t* normals = nullptr;

  WFPG_HD vec3 opacity(node_id node) const { return lights[node].opacity; }
  WFPG_HD float radiance(node_id node, vec3 toward) const {
    return lights[node].radiance[side_facing(node, toward)];
  }
  /// The side of a node that faces a direction.
  WFPG_HD std::uint32_t side_facing(node_id node, vec3 direction) const {
    return glm::dot(unpack_voxel_direction(normals[node]), direction) >= 0.0f ? 0u : 1u;
  }
};

}  // namespace detail
}  // namespace wfpg
