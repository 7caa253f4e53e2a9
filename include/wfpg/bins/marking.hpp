// Algorithm 2 of the paper (section 3.4): counts of rays at the octree's leaves are summed upward. The rays
// of a leaf then belong to its deepest ancestor with enough rays. The counts may be a wave's
// (spatial_binner), or running ones (kept fields).
//
// Cost: sum_of_children O(children) a node; marked_ancestor O(depth). No memory.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg {

/// Sums the counts of an inner node's children, saturated at 2³² - 1. `count_of` maps a node_id to its
/// std::uint32_t count. Precondition: `node` is no leaf.
template <class CountOf>
WFPG_HD std::uint32_t sum_of_children(const sparse_voxel_octree_view& tree, node_id node,
                                      const CountOf& count_of) {
  const node_id first = tree.first_child(node);
  // Eight counts of 32 bits do not overflow 64.
  std::uint64_t sum = 0;
  for (std::uint32_t c = 0; c < tree.child_count(node); ++c) sum += count_of(first + c);
  return static_cast<std::uint32_t>(min<std::uint64_t>(sum, 0xffffffffull));
}

/// Returns the deepest node with at least `enough` rays among a node and its ancestors. Where none deeper
/// than `min_level` has so many, it returns the ancestor of that level. A node above `min_level` is returned
/// as it is. `count_of` maps a node_id to a count. Precondition: `min_level` is at most the octree's depth.
template <class CountOf>
WFPG_HD node_id marked_ancestor(const sparse_voxel_octree_view& tree, node_id node, std::uint32_t min_level,
                                std::uint64_t enough, const CountOf& count_of) {
  // Ids grow with the level: a node deeper than min_level is at or past the end of that level.
  const node_id least_end = tree.level_begin(min_level + 1);
  while (count_of(node) < enough && node >= least_end) node = tree.parent(node);
  return node;
}

}  // namespace wfpg
