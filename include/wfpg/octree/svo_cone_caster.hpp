// Volumetric cone tracing as a ray caster: the third way of the paper's section 3.3 in which a field's cones
// find the radiance of the exitance cache, after Crassin et al. 2011, "Interactive Indirect Illumination
// Using Voxel Cone Tracing". It needs no host and no geometry but the octree's:
//
//   const wfpg::voxel_opacity<Exec> opacity(exec, guider.octree());   once
//   const wfpg::svo_cone_caster cones(guider.cache(), opacity.view());
//   guider.sample_directions(wave, cones, directions);
//
// A cone passes nodes as large as it is wide, from front to back, and gathers the radiance of each through
// what those before it let pass: a blurred view of all that the cone covers, where a ray sees one voxel of
// it. The price are leaks, which the paper names. Walls cover some nodes in part: along no axis they let
// through about 2% of the light behind them in tests, single cones that graze them a quarter; none do where
// nodes are leaves. And openings look smaller, by part of the nodes at their rim.
//
// Cones answer as misses do, with the radiance that they gathered, since it comes from no one distance.
// Transient fields are made of that as of any caster's. Kept fields remember it as it is: they do not see the
// cache change until the cell is cast again, once in kept.recast refreshes: 8 or less suit them better than
// the default. A host that calls path_guider::forget_light() calls invalidate_all() too. What they gain
// beside the other ways is in docs/algorithm.md.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxel_cones.hpp>

namespace wfpg {
namespace detail {

/// Shares of 1 / 255 along each axis.
struct packed_opacity {
  std::uint8_t along[3];
};

}  // namespace detail

/// How opaque an octree's nodes are along each axis. Trivially copyable; valid while its owner lives.
class voxel_opacity_view {
 public:
  voxel_opacity_view() = default;
  /// `nodes`: of the inner nodes.
  WFPG_HD voxel_opacity_view(const sparse_voxel_octree_view& tree, const detail::packed_opacity* nodes)
      : tree_(tree), nodes_(nodes) {}

  /// Of all of a node along x, y and z, in [0, 1]; 1 of leaves, as svo_ray_caster has it. Precondition: a
  /// node of the octree.
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

/// An inner node's opacity from its children's.
struct compose_opacity {
  sparse_voxel_octree_view tree;
  packed_opacity* nodes;

  WFPG_HD void operator()(node_id node) const {
    const voxel_opacity_view opacity(tree, nodes);
    const std::uint32_t mask = tree.child_mask(node);
    node_id child = tree.first_child(node);
    child_rows rows;
    for (std::uint32_t octant = 0; octant < 8; ++octant)
      if (mask >> octant & 1u) rows.add(octant, opacity(child++));
    const vec3 shares = rows.opacity() * 255.0f + 0.5f;
    for (int axis = 0; axis < 3; ++axis) nodes[node].along[axis] = static_cast<std::uint8_t>(shares[axis]);
  }
};

/// The cache as cones see it.
struct cached_nodes {
  exitance_cache_view cache;
  voxel_opacity_view opacities;

  WFPG_HD vec3 opacity(node_id node) const { return opacities(node); }
  WFPG_HD float radiance(node_id node, vec3 toward) const { return cache.read(node, toward); }
};

}  // namespace detail

/// Owns the opacities of an octree, in the memory of `Exec`: 3 bytes an inner node. The octree must outlive
/// it.
template <class Exec>
class voxel_opacity {
 public:
  voxel_opacity() = default;

  /// Of an octree as it is, from which voxels have surfaces. O(nodes). Throws out_of_memory.
  voxel_opacity(const Exec& exec, const sparse_voxel_octree<Exec>& tree)
      : nodes_(exec, tree.node_count() - tree.leaf_count()), view_(tree.view(), nodes_.data()) {
    detail::for_each_bottom_up(exec, tree.view(), 0, detail::compose_opacity{tree.view(), nodes_.data()});
  }

  /// What kernels see; valid while this lives.
  voxel_opacity_view view() const { return view_; }
  /// Of what it holds.
  std::size_t bytes() const { return nodes_.bytes(); }

 private:
  buffer<detail::packed_opacity, Exec> nodes_;
  voxel_opacity_view view_;
};

/// An inline caster of cones, see the top of this header. It reads the cache as it is when it casts: light of
/// emitters only where that is deposited (sampling_options::include_emission). Nodes nearer than `clearance`
/// voxels are passed, since a cone starts in a voxel of its own surface. Cost: O(nodes passed · depth).
class svo_cone_caster {
 public:
  /// `opacity`: of the cache's octree. `environment`: radiance where a cone leaves the octree, luminance,
  /// W/(m² sr).
  WFPG_HD svo_cone_caster(const exitance_cache_view& cache, const voxel_opacity_view& opacity,
                          float environment = 0.0f, float clearance = 2.0f)
      : cones_{cache.octree(), {cache, opacity}},
        environment_(min(environment, 1.0e30f)),
        clearance_(clearance) {}

  /// A miss with the radiance that a cone around `axis` gathers, and of the environment what is left clear;
  /// at most 1e30. `solid_angle` in steradians. A ray that is not finite, or whose direction is zero, leaves
  /// the octree.
  WFPG_HD ray_hit operator()(const ray& axis, float solid_angle) const {
    ray clear_of_origin = axis;
    clear_of_origin.t_min = max(axis.t_min, clearance_ * cones_.tree.grid().voxel_size());
    const detail::gathered_light found = cones_.gather(clear_of_origin, solid_angle);
    return {-1.0f, min(found.radiance + found.clear * environment_, 1.0e30f)};
  }
  /// The same of a cone that is nowhere wider than a voxel.
  WFPG_HD ray_hit operator()(const ray& axis) const { return (*this)(axis, 0.0f); }

 private:
  detail::voxel_cones<detail::cached_nodes> cones_;
  float environment_;
  float clearance_;
};

}  // namespace wfpg
