// Work on an octree's inner nodes, children before their parents: a loop for each level that has many nodes,
// and one block for all levels that have few, since a launch takes longer than they do.
#pragma once

#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg::detail {

/// f(node) for the nodes of a level.
template <class F>
struct visit_level {
  F f;
  node_id first;
  WFPG_HD void operator()(std::size_t i) const { f(first + static_cast<node_id>(i)); }
};

/// f(node) for the nodes of the levels below `end`, the deepest first, down to `least`.
template <class F>
struct visit_levels {
  F f;
  sparse_voxel_octree_view tree;
  std::uint32_t least, end;

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

/// f(node) for each inner node of the levels from `least` on.
template <class Exec, class F>
void for_each_bottom_up(const Exec& exec, const sparse_voxel_octree_view& tree, std::uint32_t least,
                        const F& f) {
  constexpr std::uint32_t few = 512;
  std::uint32_t end = tree.depth();
  for (; end > least && tree.level_size(end - 1) > few; --end)
    exec.for_each(tree.level_size(end - 1), visit_level<F>{f, tree.level_begin(end - 1)});
  if (end > least && !tree.empty()) exec.for_each_block(1, 0, visit_levels<F>{f, tree, least, end});
}

}  // namespace wfpg::detail
