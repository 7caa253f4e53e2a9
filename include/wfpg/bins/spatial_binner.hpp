// Assigns rays to spatial bins (paper, section 3.4, Algorithm 2; thesis, section 4.4.1, Algorithm 4). Rays
// are counted at the octree's leaves, and the counts are summed upward. Nodes with enough rays are marked. A
// ray belongs to its deepest marked ancestor. In oriented mode a bin is split further, by the dominant signed
// axis of its surfaces' normals.
//
// Cost: O(rays · depth + nodes) and one partition. Memory: 4 bytes a node, 20 a ray of capacity, and about 8
// more a ray while it sorts.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/bins/binning_options.hpp>
#include <wfpg/bins/marking.hpp>
#include <wfpg/bins/partitioner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/ranks/communicator.hpp>

namespace wfpg {

/// Orientation of a bin: which surfaces of the node belong to it. 0 to 5 are dominant signed axes in the
/// order +x -x +y -y +z -z. 6: surfaces that transmit. 7: all surfaces (plain mode). 8: number of
/// orientations.
enum bin_orientation : std::uint32_t { orientation_transmits = 6, orientation_any = 7, orientations = 8 };

/// Index of the signed axis nearest to a direction, 0 to 5 as in bin_orientation. The direction has any
/// positive length. Ties go to x, then to y.
WFPG_HD inline std::uint32_t dominant_axis(vec3 n) {
  const float x = fabsf(n.x), y = fabsf(n.y), z = fabsf(n.z);
  if (x >= y && x >= z) return n.x >= 0.0f ? 0u : 1u;
  if (y >= z) return n.y >= 0.0f ? 2u : 3u;
  return n.z >= 0.0f ? 4u : 5u;
}

/// What the binner reads of a ray.
struct ray_to_bin {
  vec3 position{0.0f};                          ///< world space; one that is not finite has no bin
  std::uint32_t orientation = orientation_any;  ///< below `orientations`: dominant_axis() or bin_orientation
  bool active = false;                          ///< false: the ray gets no bin and is not counted
  std::uint32_t paths = 1;                      ///< paths that it stands for, where others have no active ray
};

/// Bins as kernels see them: groups of a partition of the rays. Each bin has at least one ray. Bin ids are
/// below *count, and ascend by node and orientation.
struct bins_view : partition_view {
  /// Key of each ray's bin: node times 8 plus orientation, or 0xffffffff where the ray has no bin.
  array_view<const std::uint32_t> ray_keys;
  /// Rays of each bin on all ranks that share the wave. Null: those of this rank are all.
  const std::uint32_t* sizes_of_ranks = nullptr;

  /// Number of rays of a bin, on all ranks.
  WFPG_HD std::uint32_t rays(std::size_t bin) const {
    return sizes_of_ranks ? sizes_of_ranks[bin] : size(bin);
  }
  /// The octree node that contains a bin's rays.
  WFPG_HD node_id node(std::size_t bin) const { return key(bin) / orientations; }
  /// Orientation of a bin, 0 to 7: dominant_axis() or bin_orientation.
  WFPG_HD std::uint32_t orientation(std::size_t bin) const { return key(bin) % orientations; }
};

namespace detail {

/// The leaf at a ray's position, or one of its 26 neighbours; invalid_node where none is there. O(depth).
WFPG_HD inline node_id leaf_of(const sparse_voxel_octree_view& tree, const ray_to_bin& ray) {
  return is_finite(ray.position) ? tree.nearest_leaf(ray.position) : invalid_node;
}

/// Adds each active ray to the count of its leaf, and writes its key: leaf times 8 plus orientation. Rays
/// outside every voxel are added to `unbinned`. `Rays`: (std::size_t) -> ray_to_bin.
template <class Rays>
struct count_at_leaves {
  Rays rays;  ///< the rays' descriptions
  sparse_voxel_octree_view tree;
  array_view<std::uint32_t> keys;  ///< receives a key a ray, 0xffffffff for none
  std::uint32_t* node_counts;      ///< a node; zero before
  std::uint32_t* unbinned;         ///< one counter
  WFPG_HD void operator()(std::size_t i) const {
    const ray_to_bin ray = rays(i);
    keys[i] = 0xffffffffu;
    if (!ray.active) return;
    // Rounding may put a hit point into an empty voxel, so leaves next door count too.
    const node_id leaf = leaf_of(tree, ray);
    if (leaf == invalid_node) {
      atomic_add(unbinned, 1);
      return;
    }
    atomic_add(node_counts + leaf, 1);
    keys[i] = leaf * orientations + ray.orientation;
  }
};

/// Gives an inner node the sum of its children's counts, once these are known.
struct sum_wave_counts {
  sparse_voxel_octree_view tree;
  std::uint32_t* node_counts;
  WFPG_HD void operator()(node_id node) const {
    // Children are complete by now: levels are visited from the deepest up.
    node_counts[node] = sum_of_children(tree, node, [&](node_id child) { return node_counts[child]; });
  }
};

/// Replaces the leaf in a ray's key by the node of its bin. The orientation stays: oriented bins share a
/// node's count, and may have fewer rays than rays_per_bin.
struct ascend_to_marked {
  sparse_voxel_octree_view tree;
  const std::uint32_t* node_counts;
  binning_options options;  ///< with min_level clamped to the depth
  array_view<std::uint32_t> keys;
  WFPG_HD void operator()(std::size_t i) const {
    if (keys[i] == 0xffffffffu) return;
    // All rays of a leaf end in one node, since counts are by node alone.
    const node_id node = marked_ancestor(tree, keys[i] / orientations, options.min_level,
                                         options.rays_per_bin, [&](node_id n) { return node_counts[n]; });
    keys[i] = node * orientations + keys[i] % orientations;
  }
};

}  // namespace detail

/// Bins up to `capacity` rays over one octree. It allocates once, so it can be used for each wave.
template <class Exec>
class spatial_binner {
 public:
  /// Owns no memory and has capacity 0.
  spatial_binner() = default;
  /// Allocates for `capacity` rays over an octree, which must outlive the binner. Throws out_of_memory.
  /// Throws std::invalid_argument where rays_per_bin is 0, the capacity is 2³² - 1 or more, or the octree has
  /// 2²⁹ nodes or more.
  spatial_binner(const Exec& exec, const sparse_voxel_octree_view& tree, const binning_options& options,
                 std::size_t capacity)
      : tree_(tree),
        options_(options),
        partitioner_(exec, capacity),
        node_counts_(exec, tree.node_count()),
        keys_(exec, capacity),
        unbinned_(exec, 1) {
    require(options.rays_per_bin >= 1, "rays per bin", options.rays_per_bin, "at least 1");
    // A key has 32 bits, of which 3 are the orientation.
    require(tree.node_count() < (1u << 29), "number of octree nodes", tree.node_count(), "less than 2^29");
    options_.min_level = min(options_.min_level, tree.depth());
  }

  /// Bins rays [0, n), which the functor `rays` describes: (std::size_t) -> ray_to_bin. Rays outside every
  /// voxel get no bin and are counted. The view is valid until the next call. Throws std::invalid_argument
  /// where n is above the capacity. O(n · depth + nodes) and a sort of n keys.
  ///
  /// `ranks`: bins are chosen by the rays of all ranks. They exchange 4 bytes a leaf.
  template <class Rays>
  bins_view bin(const Exec& exec, std::size_t n, const Rays& rays, communicator* ranks = nullptr) {
    require(n <= keys_.size(), "number of rays", n, "at most the binner's capacity");
    // Keys are those of leaves first, and of bins after the ascent.
    const array_view<std::uint32_t> keys(keys_.data(), n);
    exec.fill_bytes(node_counts_.data(), 0, node_counts_.bytes());
    exec.fill_bytes(unbinned_.data(), 0, unbinned_.bytes());
    exec.for_each(n, detail::count_at_leaves<Rays>{rays, tree_, keys, node_counts_.data(), unbinned_.data()});
    if (ranks) ranks->all_reduce_sum(node_counts_.view().subview(tree_.first_leaf(), tree_.leaf_count()));
    // Levels above l_min are not summed: no bin lies there.
    detail::for_each_bottom_up(exec, tree_, options_.min_level,
                               detail::sum_wave_counts{tree_, node_counts_.data()});
    exec.for_each(n, detail::ascend_to_marked{tree_, node_counts_.data(), options_, keys});
    // Keys end at nodes times 8, so the sort leaves out the bits that they cannot have.
    return {partitioner_.partition(exec, keys, bits_of(tree_.node_count() * orientations)), keys};
  }

  /// Number of active rays of the last call that lie outside every voxel, in the policy's memory.
  const std::uint32_t* unbinned() const { return unbinned_.data(); }
  /// Bytes of all that it has allocated, its partitioner's included.
  std::size_t bytes() const {
    return partitioner_.bytes() + node_counts_.bytes() + keys_.bytes() + unbinned_.bytes();
  }

 private:
  sparse_voxel_octree_view tree_;            ///< not owned
  binning_options options_;                  ///< with min_level at most the depth
  partitioner<Exec> partitioner_;            ///< groups the rays by key
  buffer<std::uint32_t, Exec> node_counts_;  ///< a node: rays in the wave
  buffer<std::uint32_t, Exec> keys_;         ///< a ray
  buffer<std::uint32_t, Exec> unbinned_;     ///< one counter
};

}  // namespace wfpg
