// Lists the nodes of the octree that are far brighter than what surrounds them, such as small lamps.
// Refreshes of kept fields aim cones at them (aimed_cones.hpp).
//
// Means count nodes, not children: a lamp that hangs alone has an octant of its own. What surrounds a node
// has as many nodes as a surface would, and those that are missing are dark.
//
// The list is a function of the exitance cache alone. Ranks with equal caches have equal lists, and guide
// files need not hold it. wfpg's own.
//
// Cost: O(nodes of level 6) each time the cache changes. Nothing is read back to the host. Memory: 2.3 KB.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/octree/exitance_cache.hpp>

#include <vector>

namespace wfpg::detail {

/// Constants of the list. Measured in wfpg-room (docs/ablations.md).
struct bright_node_constants {
  /// Nodes of this level are compared, or leaves where these are less deep. 6: a 64th of the scene's side.
  static constexpr std::uint32_t level = 6;
  /// A node is compared with its ancestor this many levels up, which has about 64 such nodes of a surface.
  /// It is one level more where that has no more than 64: then the lamp hangs alone.
  static constexpr std::uint32_t levels_up = 3;
  /// Radiance of a bright node over that of its surroundings, at least.
  static constexpr float over_surroundings = 4.0f;
  /// Radiance of a bright node over the mean of all nodes, at least. Rooms with one broad lamp then list
  /// nothing.
  static constexpr float over_scene = 32.0f;
  /// Deposits that a node needs, and as many for each node of its surroundings. With fewer, either may be
  /// bright or dark by chance.
  static constexpr std::uint32_t deposits = 64;
  /// Nodes in the list, at most.
  static constexpr std::uint32_t most = 64;
};

/// A bright side of a node.
struct bright_side {
  vec3 position;     // world space: middle of its brightest leaf, where cones are aimed
  std::uint32_t id;  // 2 node + side
  vec3 normal;       // of the side, unit length
};

/// The list as kernels see it. Trivially copyable. Empty by default.
struct bright_nodes_view {
  const bright_side* sides = nullptr;    // the brightest first
  const std::uint32_t* count = nullptr;  // number of them, at most bright_node_constants::most

  /// Number of sides in the list.
  WFPG_HD std::uint32_t size() const { return count ? *count : 0; }
};

/// Kernel: writes the mean radiance of a level's nodes, each by its brighter side. One block.
struct average_nodes {
  exitance_cache_view cache;
  node_id first;  // of the level
  int size;       // nodes of the level
  float* mean;    // output

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    const double sum = block.sum(size, [&](int i) {
      const node_id node = first + static_cast<node_id>(i);
      const float radiance = max(max(cache.radiance(node, 0), cache.radiance(node, 1)), 0.0f);
      return is_finite(radiance) ? double(radiance) : 0.0;
    });
    block.for_each(1, [&](int) { *mean = static_cast<float>(sum / size); });
  }
};

/// Kernel: offers both sides of a node's children to the list. A side belongs to one of `most` buckets, which
/// keeps the brightest: the same one in any order of threads.
struct offer_bright_sides {
  using constants = bright_node_constants;
  static constexpr std::uint64_t none = ~std::uint64_t(0);

  exitance_cache_view cache;
  node_id first;           // of the level above
  const float* mean;       // of all nodes of the children's level
  std::uint64_t* buckets;  // inverted radiance above the side's id; the least number wins

  WFPG_HD void operator()(std::size_t i) const {
    const node_id parent = first + static_cast<node_id>(i);
    const float least = constants::over_scene * *mean;
    // A parent is the mean of at most eight children. Nearly all have no bright one.
    if (!(8.0f * max(cache.radiance(parent, 0), cache.radiance(parent, 1)) > least)) return;
    const node_id child = cache.octree().first_child(parent);
    for (std::uint32_t k = 0; k < 2 * cache.octree().child_count(parent); ++k)
      offer(child + k / 2, k % 2, least);
  }

 private:
  // Nodes of a surface in an ancestor so many levels up.
  WFPG_HD static constexpr std::uint32_t surface(std::uint32_t levels) { return 1u << 2 * levels; }

  WFPG_HD void offer(node_id node, std::uint32_t side, float least) const {
    const float radiance = cache.radiance(node, side);
    if (!(radiance > least) || !is_finite(radiance)) return;
    const area around = surroundings(node, side);
    if (!(radiance > constants::over_surroundings * around.radiance)) return;
    if (!has_deposits(node, constants::deposits)) return;
    if (!has_deposits(around.node, constants::deposits * around.nodes)) return;
    const std::uint32_t id = 2 * node + side;
    atomic_min(buckets + hash32(0, id) % constants::most, std::uint64_t(~float_bits(radiance)) << 32 | id);
  }

  struct area {
    node_id node;
    std::uint32_t nodes;  // of the level that is listed, at most those of a surface
    float radiance;       // mean over a surface, of which nodes that are missing are dark
  };

  // The area that a node is compared with, on the side that faces as `side` of the node does.
  WFPG_HD area surroundings(node_id node, std::uint32_t side) const {
    node_id up = node;
    for (std::uint32_t i = 0; i < constants::levels_up; ++i) climb(up, side);
    std::uint32_t all = surface(constants::levels_up), nodes = min(nodes_in(up, node), all);
    const node_id above = cache.octree().parent(up);
    if (above != invalid_node && nodes_in(above, node) <= all) {
      nodes = nodes_in(above, node);
      all = surface(constants::levels_up + 1);
      climb(up, side);
    }
    const float part = static_cast<float>(nodes) / static_cast<float>(all);
    return {up, nodes, part * max(cache.radiance(up, side), 0.0f)};
  }
  // Goes to the parent, and to its side that matches.
  WFPG_HD void climb(node_id& node, std::uint32_t& side) const {
    const node_id up = cache.octree().parent(node);
    side = cache.matching_side(up, node - cache.octree().first_child(up), side);
    node = up;
  }
  // Number of an ancestor's descendants on the level of `node`.
  WFPG_HD std::uint32_t nodes_in(node_id ancestor, node_id node) const {
    const sparse_voxel_octree_view& tree = cache.octree();
    node_id begin = ancestor, last = ancestor;
    for (std::uint32_t level = tree.level_of(ancestor); level < tree.level_of(node); ++level)
      descend(begin, last);
    return last - begin + 1;
  }
  // From the first and last node of a range to their first and last child.
  WFPG_HD void descend(node_id& begin, node_id& last) const {
    const sparse_voxel_octree_view& tree = cache.octree();
    begin = tree.first_child(begin);
    last = tree.first_child(last) + tree.child_count(last) - 1;
  }
  // Whether the leaves of a node have `wanted` deposits, on both sides together. Only bright sides are asked,
  // and most end after a few leaves.
  WFPG_HD bool has_deposits(node_id node, std::uint32_t wanted) const {
    const sparse_voxel_octree_view& tree = cache.octree();
    node_id leaf = node, last = node;
    while (!tree.is_leaf(leaf)) descend(leaf, last);
    std::uint64_t n = 0;
    for (; leaf <= last && n < wanted; ++leaf) n += cache.deposits(leaf);
    return n >= wanted;
  }
};

/// Kernel: sorts what the buckets hold into the list. One call a bucket.
struct list_bright_sides {
  exitance_cache_view cache;
  const std::uint64_t* buckets;
  bright_side* sides;
  std::uint32_t* count;

  WFPG_HD void operator()(std::size_t i) const {
    std::uint32_t before = 0, all = 0;
    for (std::uint32_t k = 0; k < bright_node_constants::most; ++k) {
      before += buckets[k] < buckets[i] ? 1u : 0u;
      all += buckets[k] != offer_bright_sides::none ? 1u : 0u;
    }
    if (i == 0) *count = all;
    if (buckets[i] != offer_bright_sides::none)
      sides[before] = described(static_cast<std::uint32_t>(buckets[i]));
  }

 private:
  // Finds the brightest leaf of a side, child by child.
  WFPG_HD bright_side described(std::uint32_t id) const {
    const sparse_voxel_octree_view& tree = cache.octree();
    node_id node = id / 2;
    std::uint32_t side = id % 2;
    const vec3 normal = side == 0 ? cache.normal(node) : -cache.normal(node);
    while (!tree.is_leaf(node)) {
      const node_id first = tree.first_child(node);
      std::uint32_t brightest = 0;
      float most = -2.0f;  // less than a child without data has
      for (std::uint32_t c = 0; c < tree.child_count(node); ++c) {
        const float radiance = cache.radiance(first + c, cache.matching_side(node, c, side));
        if (radiance > most) brightest = c;
        most = max(most, radiance);
      }
      side = cache.matching_side(node, brightest, side);
      node = first + brightest;
    }
    return {tree.centre(node), id, normal};
  }
};

/// Owns the list, in the memory of `Exec`.
template <class Exec>
class bright_nodes {
  using constants = bright_node_constants;

 public:
  /// Without memory; may only be assigned to.
  bright_nodes() = default;
  /// Makes an empty list.
  explicit bright_nodes(const Exec& exec)
      : buckets_(exec, constants::most),
        sides_(exec, constants::most),
        count_(exec, std::vector<std::uint32_t>(1)),
        mean_(exec, 1u) {}

  /// Lists the bright nodes of a cache. Stays empty where the octree has fewer than `levels_up` levels below
  /// the root.
  void find(const Exec& exec, const exitance_cache_view& cache) {
    const sparse_voxel_octree_view& tree = cache.octree();
    if (tree.empty() || tree.depth() < constants::levels_up) return;
    const std::uint32_t level = min(tree.depth(), constants::level);
    exec.fill_bytes(buckets_.data(), 0xff, buckets_.bytes());  // offer_bright_sides::none
    exec.for_each_block(1, 0,
                        average_nodes{cache, tree.level_begin(level),
                                      static_cast<int>(tree.level_size(level)), mean_.data()});
    exec.for_each(tree.level_size(level - 1),
                  offer_bright_sides{cache, tree.level_begin(level - 1), mean_.data(), buckets_.data()});
    exec.for_each(constants::most, list_bright_sides{cache, buckets_.data(), sides_.data(), count_.data()});
  }

  bright_nodes_view view() const { return {sides_.data(), count_.data()}; }
  std::size_t bytes() const { return buckets_.bytes() + sides_.bytes() + count_.bytes() + mean_.bytes(); }

 private:
  buffer<std::uint64_t, Exec> buckets_;
  buffer<bright_side, Exec> sides_;
  buffer<std::uint32_t, Exec> count_;
  buffer<float, Exec> mean_;  // of the nodes of the level
};

}  // namespace wfpg::detail
