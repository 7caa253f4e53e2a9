// An octree's nodes on the host, with all that its view reports of each.
#pragma once

#include "support/evaluate.hpp"

#include <wfpg/octree/sparse_voxel_octree.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wfpg_test {

struct node_record {
  static constexpr std::uint32_t max_depth = wfpg::sparse_voxel_octree_view::max_depth;

  std::uint32_t level, is_leaf, child_count;
  wfpg::node_id parent, first_child;
  wfpg::node_id child[8];
  wfpg::node_id ancestor[max_depth + 1];
  wfpg::uvec3 coordinates;
  wfpg::bounds3 bounds;
};

struct describe_node {
  wfpg::sparse_voxel_octree_view tree;
  WFPG_HD node_record operator()(std::size_t i) const {
    const auto node = static_cast<wfpg::node_id>(i);
    node_record r{};
    r.level = tree.level_of(node);
    r.is_leaf = tree.is_leaf(node) ? 1 : 0;
    r.parent = tree.parent(node);
    r.first_child = r.is_leaf ? wfpg::invalid_node : tree.first_child(node);
    r.child_count = r.is_leaf ? 0 : tree.child_count(node);
    for (std::uint32_t octant = 0; octant < 8; ++octant)
      r.child[octant] = r.is_leaf ? wfpg::invalid_node : tree.child(node, octant);
    for (std::uint32_t level = 0; level <= node_record::max_depth; ++level)
      r.ancestor[level] = level <= r.level ? tree.ancestor(node, level) : wfpg::invalid_node;
    r.coordinates = tree.coordinates(node);
    r.bounds = tree.bounds(node);
    return r;
  }
};

template <class Exec>
std::vector<node_record> nodes_of(const Exec& exec, const wfpg::sparse_voxel_octree_view& tree) {
  return evaluate(exec, tree.node_count(), describe_node{tree});
}

}  // namespace wfpg_test
