// Implementation of sparse_voxel_octree.hpp: all levels of an octree from sorted Morton codes (after Karras
// 2012). Nodes of all levels are made by the same loops, one over the leaves and one over the inner nodes.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

#include <thrust/copy.h>
#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/transform_scan.h>

#include <vector>

namespace wfpg {
namespace detail {

/// Whether a fragment is the first of its voxel's, in the order of Morton codes.
struct starts_voxel {
  array_view<const morton_code> codes;
  WFPG_HD bool operator()(std::uint32_t i) const { return i == 0 || codes[i] != codes[i - 1]; }
};

/// Writes the code of each leaf, and its first level. That is the first level, from the root on, on which the
/// leaf and the one before it have nodes of their own. The first leaf's is 0.
struct describe_leaves {
  array_view<const morton_code> codes;
  array_view<const std::uint32_t> fragment_begin;
  std::uint32_t depth;
  array_view<morton_code> leaf_codes;
  array_view<std::uint8_t> first_levels;

  WFPG_HD void operator()(std::size_t leaf) const {
    const std::uint32_t fragment = fragment_begin[leaf];
    leaf_codes[leaf] = codes[fragment];
    std::uint32_t level = leaf > 0 ? depth : 0;
    for (morton_code apart = leaf > 0 ? (codes[fragment] ^ codes[fragment - 1]) >> 3 : 0; apart > 0;
         apart >>= 3)
      --level;
    first_levels[leaf] = static_cast<std::uint8_t>(level);
  }
};

/// Numbers the inner nodes before they exist. For each level there are bits that say with which leaves a node
/// of that level begins, in words of 32 leaves. `prefix` has the number of nodes up to and with each word,
/// over all levels in turn.
struct node_numbers {
  array_view<const std::uint32_t> begins, prefix;
  std::uint32_t words;  // of a level

  static constexpr std::uint32_t leaves_a_word = 32;

  /// The node of an inner level that holds a leaf: the number of nodes that begin up to it, less 1.
  WFPG_HD node_id node(std::uint32_t level, std::uint32_t leaf) const {
    const std::size_t word = std::size_t(level) * words + leaf / leaves_a_word;
    return prefix[word] - popcount(begins[word] >> leaf % leaves_a_word >> 1) - 1;
  }
  /// One past the last node of an inner level.
  WFPG_HD node_id end(std::uint32_t level) const { return prefix[(std::size_t(level) + 1) * words - 1]; }
};

/// Writes one word of node_numbers: a bit for each of 32 leaves, set where a node of the level begins with
/// it.
struct mark_beginnings {
  array_view<const std::uint8_t> first_levels;
  std::uint32_t words;  // of a level
  std::uint32_t* begins;

  WFPG_HD void operator()(std::size_t word) const {
    const std::size_t level = word / words, first = word % words * node_numbers::leaves_a_word;
    const std::size_t n = min(first_levels.size() - first, std::size_t(node_numbers::leaves_a_word));
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < n; ++i) bits |= (first_levels[first + i] <= level ? 1u : 0u) << i;
    begins[word] = bits;
  }
};

/// Number of nodes that begin in a word.
struct count_bits {
  WFPG_HD std::uint32_t operator()(std::uint32_t bits) const { return popcount(bits); }
};

/// Copies the end of each inner level for the host.
struct gather_level_ends {
  node_numbers inner;
  node_id* ends;
  WFPG_HD void operator()(std::size_t level) const {
    ends[level] = inner.end(static_cast<std::uint32_t>(level));
  }
};

/// Links the nodes that begin with a leaf with their parents, and stores that leaf for each of them. One call
/// a leaf.
struct link_nodes {
  array_view<const std::uint8_t> first_levels;
  node_numbers inner;
  std::uint32_t depth;
  node_id first_leaf;
  node_id* parents;
  node_id* first_children;
  std::uint32_t* first_leaf_of;  // a node: counted from the first leaf

  WFPG_HD void operator()(std::size_t i) const {
    const auto leaf = static_cast<std::uint32_t>(i);
    const std::uint32_t first = first_levels[leaf];
    node_id up = first > 0 ? node(first - 1, leaf) : invalid_node;
    for (std::uint32_t level = first; level <= depth; ++level) {
      const node_id here = node(level, leaf);
      first_leaf_of[here] = leaf;
      parents[here] = up;
      if (level > first) first_children[up] = here;
      up = here;
    }
  }

 private:
  WFPG_HD node_id node(std::uint32_t level, std::uint32_t leaf) const {
    return level == depth ? first_leaf + leaf : inner.node(level, leaf);
  }
};

/// Finds the octants of an inner node's children. They end where the children of the next inner node begin.
struct find_child_masks {
  array_view<const morton_code> leaf_codes;
  const std::uint32_t* first_leaf_of;
  array_view<const node_id> first_children;
  node_id node_count;
  sparse_voxel_octree_view tree;  // its levels
  std::uint8_t* child_masks;

  WFPG_HD void operator()(std::size_t node) const {
    const std::uint32_t shift =
        3 * (tree.depth() - 1 - tree.level_of(static_cast<node_id>(node)));  // below the children's octants
    const node_id end = node + 1 < first_children.size() ? first_children[node + 1] : node_count;
    std::uint32_t mask = 0;
    for (node_id child = first_children[node]; child < end; ++child)
      mask |= 1u << (leaf_codes[first_leaf_of[child]] >> shift & 7u);
    child_masks[node] = static_cast<std::uint8_t>(mask);
  }
};

/// Fills the table where descents begin: the nodes of one level by their coordinates. An entry is the node's
/// index among the steps of its level; leaves enter their ids.
struct fill_top {
  array_view<const morton_code> leaf_codes;
  const std::uint32_t* first_leaf_of;
  node_id level_begin;
  std::uint32_t level, depth;
  std::uint32_t* top;
  WFPG_HD void operator()(std::size_t i) const {
    const node_id node = level_begin + static_cast<node_id>(i);
    const uvec3 p = morton_decode(leaf_codes[first_leaf_of[node]] >> 3 * (depth - level));
    top[p.x | p.y << level | p.z << 2 * level] = level == depth ? node : static_cast<std::uint32_t>(i);
  }
};

/// Computes the steps that descents take from the nodes of a level: which nodes exist two levels below, and
/// the first one.
struct fill_steps {
  sparse_voxel_octree_view tree;
  std::uint32_t level;
  std::uint32_t next_steps;  // where those of level + 2 begin
  two_levels* steps;         // of this level
  WFPG_HD void operator()(std::size_t i) const {
    const node_id node = tree.level_begin(level) + static_cast<node_id>(i);
    two_levels step;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const node_id child = tree.child(node, octant);
      if (child != invalid_node) step.present |= std::uint64_t(tree.child_mask(child)) << 8 * octant;
    }
    step.first = tree.first_child(tree.first_child(node));
    if (level + 2 < tree.depth()) step.first += next_steps - tree.level_begin(level + 2);
    steps[i] = step;
  }
};

/// Sorts fragments by Morton code. The sort is stable: fragments of one voxel keep their order. While it
/// runs, it takes 16 more bytes a fragment, besides the sort's temporaries.
template <class Exec>
void sort_fragments(const Exec& exec, voxel_fragments<Exec>& fragments) {
  const std::size_t n = fragments.size();
  buffer<morton_code, Exec> codes(exec, n);
  buffer<fragment_surface, Exec> surfaces(exec, n);
  const int bits = max(3 * (bits_of(fragments.grid.resolution) - 1), 1);
  exec.sort_pairs(n, bits, fragments.codes.data(), fragments.surfaces.data(), codes.data(), surfaces.data());
  fragments.codes.swap(codes);
  fragments.surfaces.swap(surfaces);
}

}  // namespace detail

template <class Exec>
sparse_voxel_octree<Exec>::sparse_voxel_octree(const Exec& exec, voxel_fragments<Exec>& fragments) {
  detail::require_resolution(fragments.grid.resolution);
  view_.grid_ = fragments.grid;
  while (1u << view_.depth_ < fragments.grid.resolution) ++view_.depth_;
  detail::sort_fragments(exec, fragments);
  build_levels(exec, find_leaves(exec, fragments));
}

/// Finds the fragments' distinct voxels, and where the fragments of each begin.
template <class Exec>
auto sparse_voxel_octree<Exec>::find_leaves(const Exec& exec, const voxel_fragments<Exec>& fragments)
    -> leaves_of_build {
  const std::size_t n = fragments.size();
  const array_view<const morton_code> codes = fragments.codes.view();
  leaf_fragment_begin_ = buffer<std::uint32_t, Exec>(exec, n);  // of which there are `leaves`
  const ::thrust::counting_iterator<std::uint32_t> first(0);
  std::uint32_t* const end = ::thrust::copy_if(exec.thrust(), first, first + static_cast<std::uint32_t>(n),
                                               leaf_fragment_begin_.data(), detail::starts_voxel{codes});
  const auto leaves = static_cast<std::size_t>(end - leaf_fragment_begin_.data());
  leaves_of_build result{{exec, leaves}, {exec, leaves}};
  exec.for_each(leaves, detail::describe_leaves{codes, leaf_fragment_begin_.view(), view_.depth_,
                                                result.codes.view(), result.first_levels.view()});
  return result;
}

template <class Exec>
void sparse_voxel_octree<Exec>::build_levels(const Exec& exec, const leaves_of_build& leaves) {
  const std::size_t leaf_count = leaves.codes.size();
  const std::uint64_t most = std::uint64_t(view_.depth_) * leaf_count;
  require(most < invalid_node, "number of leaves times levels", most, "less than 2^32 - 1");
  constexpr std::size_t leaves_a_word = detail::node_numbers::leaves_a_word;
  const auto words = static_cast<std::uint32_t>((leaf_count + leaves_a_word - 1) / leaves_a_word);
  const buffer<std::uint32_t, Exec> begins(exec, view_.depth_ * words), prefix(exec, begins.size());
  const array_view<const std::uint8_t> first_levels = leaves.first_levels.view();
  exec.for_each(begins.size(), detail::mark_beginnings{first_levels, words, begins.data()});
  ::thrust::transform_inclusive_scan(exec.thrust(), begins.data(), begins.data() + begins.size(),
                                     prefix.data(), detail::count_bits{}, ::thrust::plus<std::uint32_t>());
  const detail::node_numbers inner{begins.view(), prefix.view(), words};
  find_level_ends(exec, inner, leaf_count);
  allocate(exec);
  const buffer<std::uint32_t, Exec> first_leaf_of(exec, view_.node_count());
  exec.for_each(leaf_count,
                detail::link_nodes{first_levels, inner, view_.depth_, view_.first_leaf(), parents_.data(),
                                   first_children_.data(), first_leaf_of.data()});
  exec.for_each(first_children_.size(),
                detail::find_child_masks{leaves.codes.view(), first_leaf_of.data(), first_children_.view(),
                                         view_.node_count(), view_, child_masks_.data()});
  build_descents(exec, leaves.codes, first_leaf_of);
}

template <class Exec>
void sparse_voxel_octree<Exec>::find_level_ends(const Exec& exec, const detail::node_numbers& inner,
                                                std::size_t leaves) {
  const std::uint32_t depth = view_.depth_;
  std::vector<node_id> inner_ends(depth, 0);
  if (leaves > 0 && depth > 0) {
    const buffer<node_id, Exec> ends(exec, depth);
    exec.for_each(depth, detail::gather_level_ends{inner, ends.data()});
    inner_ends = ends.to_host(exec);
  }
  for (std::uint32_t level = 1; level <= depth; ++level) view_.level_begin_[level] = inner_ends[level - 1];
  const std::uint64_t total = view_.level_begin_[depth] + std::uint64_t(leaves);
  require(total < invalid_node, "number of octree nodes", total, "less than 2^32 - 1");
  for (std::uint32_t level = depth + 1; level < sparse_voxel_octree_view::max_depth + 2; ++level)
    view_.level_begin_[level] = static_cast<node_id>(total);
}

template <class Exec>
void sparse_voxel_octree<Exec>::allocate(const Exec& exec) {
  parents_ = buffer<node_id, Exec>(exec, view_.node_count());
  first_children_ = buffer<node_id, Exec>(exec, view_.first_leaf());
  child_masks_ = buffer<std::uint8_t, Exec>(exec, view_.first_leaf());
  view_.parents_ = parents_.data();
  view_.first_children_ = first_children_.data();
  view_.child_masks_ = child_masks_.data();
  if (view_.node_count() == 0) return;
  // The table's level is an even number of levels above the leaves. The table has at most a byte for each
  // node of the octree.
  std::uint32_t& top = view_.top_level_ = view_.depth_ % 2;
  while (top + 2 < view_.depth_ && (4ull << 3 * (top + 2)) <= view_.node_count()) top += 2;
  std::uint32_t steps = 0;
  for (std::uint32_t level = top; level < view_.depth_; level += 2) steps += view_.level_size(level);
  top_ = buffer<std::uint32_t, Exec>(exec, std::size_t(1) << 3 * top);
  steps_ = buffer<detail::two_levels, Exec>(exec, steps);
  view_.top_ = top_.data();
  view_.steps_ = steps_.data();
}

/// Fills the table where descents begin, and the steps of every other level.
template <class Exec>
void sparse_voxel_octree<Exec>::build_descents(const Exec& exec, const buffer<morton_code, Exec>& leaf_codes,
                                               const buffer<std::uint32_t, Exec>& first_leaf_of) {
  const std::uint32_t top = view_.top_level_;
  // All bits of invalid_node are set.
  exec.fill_bytes(top_.data(), 0xff, top_.bytes());
  exec.for_each(view_.level_size(top),
                detail::fill_top{leaf_codes.view(), first_leaf_of.data(), view_.level_begin_[top], top,
                                 view_.depth_, top_.data()});
  std::uint32_t begin = 0;
  for (std::uint32_t level = top; level < view_.depth_; level += 2) {
    const std::uint32_t end = begin + view_.level_size(level);
    exec.for_each(end - begin, detail::fill_steps{view_, level, end, steps_.data() + begin});
    begin = end;
  }
}

}  // namespace wfpg
