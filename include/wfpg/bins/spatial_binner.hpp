// Rays to spatial bins (paper, section 3.4, Algorithm 2; thesis, Algorithm 4): rays are counted at the
// octree's leaves, counts are summed upward, nodes with enough rays are marked, a ray belongs to its deepest
// marked ancestor. In oriented mode a bin is split further by the dominant signed axis of its surfaces'
// normals.
//
// Cost: O(rays · depth + nodes) and one partition; 4 bytes a node, 20 a ray of capacity, and about 8
// more while it sorts.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/bins/partitioner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg {

/// How rays form bins and what their fields cover.
enum class guiding_mode : std::uint8_t {
  oriented,  ///< by node and orientation; fields carry the cosine and cover the hemisphere of surfaces that
             ///< reflect
  plain,     ///< the paper's: by node; fields cover the sphere and carry radiance alone
};

/// Which part of a node's surfaces a bin serves: a dominant signed axis (+x -x +y -y +z -z), surfaces that
/// transmit, or all (plain mode).
enum bin_orientation : std::uint32_t { orientation_transmits = 6, orientation_any = 7, orientations = 8 };

/// The dominant signed axis of a direction, 0 to 5.
WFPG_HD inline std::uint32_t dominant_axis(vec3 n) {
  const float x = fabsf(n.x), y = fabsf(n.y), z = fabsf(n.z);
  if (x >= y && x >= z) return n.x >= 0.0f ? 0u : 1u;
  if (y >= z) return n.y >= 0.0f ? 2u : 3u;
  return n.z >= 0.0f ? 4u : 5u;
}

/// What the binner asks of a ray.
struct ray_to_bin {
  vec3 position{0.0f};                          ///< world space; one that is not finite has no bin
  std::uint32_t orientation = orientation_any;  ///< bin_orientation or dominant_axis
  bool active = false;                          ///< false: no bin
};

/// Algorithm 2's parameters.
struct binning_options {
  std::uint32_t min_level =
      3;  ///< l_min: no bin is larger than a node of this level (root 0); clamped to the leaves'
  std::uint32_t rays_per_bin = 64;  ///< c_ray: rays that mark a node, at least 1
};

/// Bins as kernels see them: groups of a partition of the rays.
struct bins_view : partition_view {
  array_view<const std::uint32_t> ray_keys;  ///< a ray: its bin's key, 0xffffffff where it has none

  /// The node that a bin's rays are in.
  WFPG_HD node_id node(std::size_t bin) const { return key(bin) / orientations; }
  /// Which of its surfaces: bin_orientation or dominant_axis.
  WFPG_HD std::uint32_t orientation(std::size_t bin) const { return key(bin) % orientations; }
};

namespace detail {

/// The leaf that an active ray's surface lies in, or invalid_node.
WFPG_HD inline node_id leaf_of(const sparse_voxel_octree_view& tree, const ray_to_bin& ray) {
  return is_finite(ray.position) ? tree.nearest_leaf(ray.position) : invalid_node;
}

/// `Rays`: (std::size_t) -> ray_to_bin.
template <class Rays>
struct count_at_leaves {
  Rays rays;
  sparse_voxel_octree_view tree;
  array_view<std::uint32_t> keys;
  std::uint32_t* node_counts;
  std::uint32_t* unbinned;
  WFPG_HD void operator()(std::size_t i) const {
    const ray_to_bin ray = rays(i);
    keys[i] = 0xffffffffu;
    if (!ray.active) return;
    const node_id leaf = leaf_of(tree, ray);
    if (leaf == invalid_node) {
      atomic_add(unbinned, 1);
      return;
    }
    atomic_add(node_counts + leaf, 1);
    keys[i] = leaf * orientations + ray.orientation;
  }
};

struct sum_children {
  sparse_voxel_octree_view tree;
  std::uint32_t* node_counts;
  WFPG_HD void operator()(node_id node) const {
    const node_id first = tree.first_child(node);
    std::uint32_t sum = 0;
    for (std::uint32_t c = 0; c < tree.child_count(node); ++c) sum += node_counts[first + c];
    node_counts[node] = sum;
  }
};

/// From the leaf up to the deepest marked node: enough rays, or the least level.
struct ascend_to_marked {
  sparse_voxel_octree_view tree;
  const std::uint32_t* node_counts;
  binning_options options;
  array_view<std::uint32_t> keys;
  WFPG_HD void operator()(std::size_t i) const {
    if (keys[i] == 0xffffffffu) return;
    node_id node = keys[i] / orientations;
    const node_id least_end = tree.level_begin(options.min_level + 1);
    while (node_counts[node] < options.rays_per_bin && node >= least_end) node = tree.parent(node);
    keys[i] = node * orientations + keys[i] % orientations;
  }
};

}  // namespace detail

/// Bins up to `capacity` rays over one octree, as often as asked, in memory taken once.
template <class Exec>
class spatial_binner {
 public:
  spatial_binner() = default;
  /// The octree behind the view must outlive this. Throws out_of_memory; std::invalid_argument where c_ray is
  /// 0, the capacity is 2³² - 1 or more, or the octree has 2²⁹ nodes or more.
  spatial_binner(const Exec& exec, const sparse_voxel_octree_view& tree, const binning_options& options,
                 std::size_t capacity)
      : tree_(tree),
        options_(options),
        partitioner_(exec, capacity),
        node_counts_(exec, tree.node_count()),
        keys_(exec, capacity),
        unbinned_(exec, 1) {
    require(options.rays_per_bin >= 1, "rays per bin", options.rays_per_bin, "at least 1");
    require(tree.node_count() < (1u << 29), "number of octree nodes", tree.node_count(), "less than 2^29");
    options_.min_level = min(options_.min_level, tree.depth());
  }

  /// Bins rays [0, n), described by a functor (std::size_t) -> ray_to_bin. Rays outside every voxel are in no
  /// bin and counted. Throws std::invalid_argument beyond the capacity. The view holds until the next call.
  template <class Rays>
  bins_view bin(const Exec& exec, std::size_t n, const Rays& rays) {
    require(n <= keys_.size(), "number of rays", n, "at most the binner's capacity");
    const array_view<std::uint32_t> keys(keys_.data(), n);
    ::thrust::fill_n(exec.thrust(), node_counts_.data(), node_counts_.size(), 0u);
    ::thrust::fill_n(exec.thrust(), unbinned_.data(), 1, 0u);
    exec.for_each(n, detail::count_at_leaves<Rays>{rays, tree_, keys, node_counts_.data(), unbinned_.data()});
    detail::for_each_bottom_up(exec, tree_, options_.min_level,
                               detail::sum_children{tree_, node_counts_.data()});
    exec.for_each(n, detail::ascend_to_marked{tree_, node_counts_.data(), options_, keys});
    return {partitioner_.partition(exec, keys, bits_of(tree_.node_count() * orientations)), keys};
  }

  /// Active rays of the last call that lie outside every voxel, in the policy's memory.
  const std::uint32_t* unbinned() const { return unbinned_.data(); }
  /// Of all that it allocated.
  std::size_t bytes() const {
    return partitioner_.bytes() + node_counts_.bytes() + keys_.bytes() + unbinned_.bytes();
  }

 private:
  sparse_voxel_octree_view tree_;
  binning_options options_;
  partitioner<Exec> partitioner_;
  buffer<std::uint32_t, Exec> node_counts_;
  buffer<std::uint32_t, Exec> keys_;
  buffer<std::uint32_t, Exec> unbinned_;
};

}  // namespace wfpg
