// Runs a functor on an octree's inner nodes, children before parents, for bottom-up averages and sums (paper,
// sections 3.2 and 3.4). Levels with many nodes get a loop each. All levels with few nodes share one thread
// block, since a kernel launch takes longer than they do. Cost: one call a node; one launch a large level,
// and one for the rest. No memory.
#pragma once

#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg::detail {

/// Calls f(node) for the nodes of one level, which are independent of each other.
template <class F>
struct visit_level {
  F f;            ///< (node_id) -> void
  node_id first;  ///< of the level
  /// Visits the i-th node of the level.
  WFPG_HD void operator()(std::size_t i) const { f(first + static_cast<node_id>(i)); }
};

/// Calls f(node) for the nodes of levels [least, end) in one thread block, the deepest level first.
template <class F>
struct visit_levels {
  F f;                            ///< (node_id) -> void, called by all threads of the block
  sparse_voxel_octree_view tree;  ///< with few nodes on each of these levels
  std::uint32_t least, end;       ///< first level, and one past the last

  /// Visits the levels, with a barrier after each: a parent reads what its children wrote.
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    for (std::uint32_t level = end; level-- > least;) {
      const node_id first = tree.level_begin(level);
      block.for_each(static_cast<int>(tree.level_size(level)),
                     [&](int i) { f(first + static_cast<node_id>(i)); });
      block.sync();
    }
  }
};

/// Calls f(node) for each inner node of the levels from `least` on, the deepest level first. f may read what
/// it wrote for the node's children. An empty octree has no calls. O(nodes) calls.
template <class Exec, class F>
void for_each_bottom_up(const Exec& exec, const sparse_voxel_octree_view& tree, std::uint32_t least,
                        const F& f) {
  // Levels of at most so many nodes are left to the one block.
  constexpr std::uint32_t few = 512;
  std::uint32_t end = tree.depth();
  // A level has at least as many nodes as the one above it, so the large levels are the deepest.
  for (; end > least && tree.level_size(end - 1) > few; --end)
    exec.for_each(tree.level_size(end - 1), visit_level<F>{f, tree.level_begin(end - 1)});
  if (end > least && !tree.empty()) exec.for_each_block(1, 0, visit_levels<F>{f, tree, least, end});
}

}  // namespace wfpg::detail
