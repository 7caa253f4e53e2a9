// The Morton codes of an octree's leaves: all that is needed to build it again, or to compare two octrees.
//
// Source: wfpg's own. Cost: one look-up a leaf, and a copy to the host. Memory: 8 bytes a leaf, during the
// call.
#pragma once

#include <wfpg/base/morton.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

#include <vector>

namespace wfpg {

/// Kernel: writes the Morton code of each leaf's voxel.
struct write_leaf_codes {
  sparse_voxel_octree_view tree;  ///< of the guide
  array_view<morton_code> codes;  ///< a leaf, in the octree's order
  /// Writes the code of leaf number `leaf`, counted from the first leaf. O(depth).
  WFPG_HD void operator()(std::size_t leaf) const {
    codes[leaf] = morton_encode(tree.coordinates(tree.first_leaf() + static_cast<node_id>(leaf)));
  }
};

/// Returns the Morton code of each leaf, in the octree's order, which is ascending. `tree`: it may be empty.
/// Waits for the work before it.
/// Throws out_of_memory.
template <class Exec>
std::vector<morton_code> leaf_codes(const Exec& exec, const sparse_voxel_octree_view& tree) {
  const buffer<morton_code, Exec> codes(exec, tree.leaf_count());
  exec.for_each(codes.size(), write_leaf_codes{tree, codes.view()});
  return codes.to_host(exec);
}

}  // namespace wfpg
