// Volumetric cone tracing as a ray caster. It is one of the ways in which a field's cones find the radiance
// of the exitance cache (paper, section 3.3). Source: Crassin et al. 2011, "Interactive Indirect Illumination
// Using Voxel Cone Tracing". It needs no host and no geometry but the octree's:
//
//   const wfpg::voxel_opacity<Exec> opacity(exec, guider.octree());   once
//   const wfpg::svo_cone_caster cones(guider.cache(), opacity.view());
//   guider.sample_directions(wave, cones, directions);
//
// A cone passes nodes as large as it is wide, from front to back. It gathers the radiance of each node
// through what the nodes before it let pass. The result is a blurred view of all that the cone covers; a ray
// sees one voxel of it.
//
// Cones leak light, which the paper names. Walls cover some nodes in part. Walls along no axis let through
// about 2% of the light behind them in tests, and a quarter along single cones that graze them. No light
// leaks where nodes are leaves. Openings look smaller, by part of the nodes at their rim.
//
// Cones answer with a miss and the radiance that they gathered, since it comes from no one distance.
// Transient fields use it as any caster's. Kept fields store it. They do not see the cache change until the
// cell is cast again, once in kept.recast refreshes. Values of 8 or less suit cones better than the default.
// A host that calls path_guider::forget_light() calls invalidate_all() too. docs/algorithm.md compares cones
// with the other ways.
//
// Cost: O(nodes passed · depth) a cone. Memory: 3 bytes an inner node.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxel_cones.hpp>

namespace wfpg {
namespace detail {

/// Opacity of an inner node along x, y and z, in units of 1 / 255.
struct packed_opacity {
  std::uint8_t along[3];  ///< along x, y and z
};

}  // namespace detail

/// Opacity of an octree's nodes along each axis, as kernels read it. Trivially copyable; valid while its
/// owner lives.
class voxel_opacity_view {
 public:
  /// A view of nothing, which is not to be read.
  voxel_opacity_view() = default;
  /// View of an octree and of its inner nodes' opacities: `nodes` has an entry for each inner node.
  WFPG_HD voxel_opacity_view(const sparse_voxel_octree_view& tree, const detail::packed_opacity* nodes)
      : tree_(tree), nodes_(nodes) {}

  /// Opacity of all of a node along x, y and z, each in [0, 1]. Leaves are opaque, 1, as svo_ray_caster has
  /// them. Precondition: a node of the octree.
  WFPG_HD vec3 operator()(node_id node) const {
    if (tree_.is_leaf(node)) return vec3(1.0f);
    const detail::packed_opacity packed = nodes_[node];
    return vec3(packed.along[0], packed.along[1], packed.along[2]) * (1.0f / 255.0f);
  }

 private:
  sparse_voxel_octree_view tree_;
  const detail::packed_opacity* nodes_ = nullptr;
};

namespace detail {

/// Computes an inner node's opacity from its children's, which are known.
struct compose_opacity {
  sparse_voxel_octree_view tree;  ///< the nodes' structure
  packed_opacity* nodes;          ///< an inner node

  WFPG_HD void operator()(node_id node) const {
    const voxel_opacity_view opacity(tree, nodes);
    const std::uint32_t mask = tree.child_mask(node);
    node_id child = tree.first_child(node);
    child_rows rows;
    for (std::uint32_t octant = 0; octant < 8; ++octant)
      if (mask >> octant & 1u) rows.add(octant, opacity(child++));
    // Rounded to the nearest of 256 values.
    const vec3 shares = rows.opacity() * 255.0f + 0.5f;
    for (int axis = 0; axis < 3; ++axis) nodes[node].along[axis] = static_cast<std::uint8_t>(shares[axis]);
  }
};

/// Light and opacity of nodes as voxel_cones asks for them: radiance from the exitance cache.
struct cached_nodes {
  exitance_cache_view cache;
  voxel_opacity_view opacities;

  /// Opacity along each axis.
  WFPG_HD vec3 opacity(node_id node) const { return opacities(node); }
  /// Radiance of the side that faces `toward`, W/(m² sr), or of an ancestor with data.
  WFPG_HD float radiance(node_id node, vec3 toward) const { return cache.read(node, toward); }
};

}  // namespace detail

/// Owns the opacities of an octree in the memory of `Exec`: 3 bytes an inner node. The octree must outlive
/// it.
template <class Exec>
class voxel_opacity {
 public:
  /// Owns nothing; its view is not to be read.
  voxel_opacity() = default;

  /// Computes the opacities of an octree from which of its voxels hold surface. They do not depend on light,
  /// so once a scene is enough. O(nodes). Throws out_of_memory.
  voxel_opacity(const Exec& exec, const sparse_voxel_octree<Exec>& tree)
      : nodes_(exec, tree.node_count() - tree.leaf_count()), view_(tree.view(), nodes_.data()) {
    detail::for_each_bottom_up(exec, tree.view(), 0, detail::compose_opacity{tree.view(), nodes_.data()});
  }

  /// The opacities for kernels; valid while this object lives.
  voxel_opacity_view view() const { return view_; }
  /// Bytes of the opacities.
  std::size_t bytes() const { return nodes_.bytes(); }

 private:
  buffer<detail::packed_opacity, Exec> nodes_;
  voxel_opacity_view view_;
};

/// An inline caster of cones; the top of this header says how they work. It reads the cache as it is when it
/// casts. Light of emitters is seen only where it is deposited (sampling_options::include_emission). Nodes
/// nearer than `clearance` voxels are passed, since a cone starts in a voxel of its own surface.
class svo_cone_caster {
 public:
  /// Caster over a cache and the opacities of the cache's octree. `environment`: radiance where a cone leaves
  /// the octree, luminance, W/(m² sr), cut at 1e30. `clearance`: in voxels, at least 0.
  WFPG_HD svo_cone_caster(const exitance_cache_view& cache, const voxel_opacity_view& opacity,
                          float environment = 0.0f, float clearance = 2.0f)
      : cones_{cache.octree(), {cache, opacity}},
        environment_(min(environment, 1.0e30f)),
        clearance_(clearance) {}

  /// Casts a cone around `axis`. Returns a miss with the radiance that it gathers, plus the environment's
  /// times the fraction that stays clear; at most 1e30. `solid_angle` in steradians. A ray that is not
  /// finite, or whose direction is zero, gets the environment's radiance alone.
  WFPG_HD ray_hit operator()(const ray& axis, float solid_angle) const {
    ray clear_of_origin = axis;
    clear_of_origin.t_min = max(axis.t_min, clearance_ * cones_.tree.grid().voxel_size());
    const detail::gathered_light found = cones_.gather(clear_of_origin, solid_angle);
    return {-1.0f, min(found.radiance + found.clear * environment_, 1.0e30f)};
  }
  /// Casts a cone that is nowhere wider than a voxel.
  WFPG_HD ray_hit operator()(const ray& axis) const { return (*this)(axis, 0.0f); }

 private:
  detail::voxel_cones<detail::cached_nodes> cones_;  ///< octree, cache and opacities
  float environment_;                                ///< W/(m² sr)
  float clearance_;                                  ///< voxels
};

}  // namespace wfpg
