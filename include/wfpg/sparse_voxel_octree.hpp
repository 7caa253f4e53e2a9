// The sparse voxel octree: voxels that hold surface, and their ancestors, level by level in contiguous arrays
// (paper, section 3.2; built from sorted Morton codes after Karras 2012, "Maximizing Parallelism in the
// Construction of BVHs, Octrees, and k-d Trees"). Structure only; what light leaves a node is
// exitance_cache.hpp's.
//
// Memory: 4 bytes a leaf, 9 an inner node, and for descents 16 for each node of every other level and at most
// 1 a node where they begin. Build: a sort of the fragments and O(leaves · depth), with 4 bytes for each of
// those.
#pragma once

#include <wfpg/buffer.hpp>
#include <wfpg/detail/math.hpp>
#include <wfpg/detail/thrust.hpp>
#include <wfpg/morton.hpp>
#include <wfpg/types.hpp>
#include <wfpg/voxelizer.hpp>

#include <thrust/copy.h>
#include <thrust/fill.h>
#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/transform_scan.h>

#include <cmath>
#include <vector>

namespace wfpg {

namespace detail {

/// A step of a descent over two levels at once: what of the 4 x 4 x 4 nodes below a node is there, in Morton
/// order.
struct alignas(16) two_levels {
  std::uint64_t present = 0;
  std::uint32_t first = 0;  ///< of those: its own two_levels, or the leaf it is

  /// That of a node by its coordinates' two last bits, or invalid_node.
  WFPG_HD std::uint32_t at(uvec3 p) const {
    const std::uint32_t i = spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2;
    if (!(present >> i & 1u)) return invalid_node;
    return first + popcount(present & ((std::uint64_t(1) << i) - 1u));
  }

 private:
  WFPG_HD static std::uint32_t spread(std::uint32_t x) { return (x & 1u) | (x & 2u) << 2; }
};

}  // namespace detail

/// What a kernel sees of an octree. Level 0 is the root, level depth() the leaves; ids grow with the level,
/// and in a level with the Morton code.
class sparse_voxel_octree_view {
 public:
  /// The deepest level that leaves can have: resolutions are at most 4096.
  static constexpr std::uint32_t max_depth = 12;

  /// Whether there are no nodes.
  WFPG_HD bool empty() const { return node_count() == 0; }
  /// The level of the leaves.
  WFPG_HD std::uint32_t depth() const { return depth_; }
  /// The cube that the root is.
  WFPG_HD const voxel_grid& grid() const { return grid_; }
  /// Nodes of all levels; ids are below it.
  WFPG_HD std::uint32_t node_count() const { return level_begin_[depth_ + 1]; }
  /// Leaves, the last of the nodes.
  WFPG_HD std::uint32_t leaf_count() const { return node_count() - first_leaf(); }
  /// The id of the first leaf.
  WFPG_HD node_id first_leaf() const { return level_begin_[depth_]; }
  /// Whether a node is a leaf.
  WFPG_HD bool is_leaf(node_id node) const { return node >= first_leaf(); }
  /// The first node of a level, 0 <= level <= depth() + 1; one past the last of the level before it.
  WFPG_HD node_id level_begin(std::uint32_t level) const { return level_begin_[level]; }

  /// The level of a node. O(depth).
  WFPG_HD std::uint32_t level_of(node_id node) const {
    std::uint32_t level = depth_;
    while (node < level_begin_[level]) --level;
    return level;
  }
  /// The node's parent; of the root, invalid_node.
  WFPG_HD node_id parent(node_id node) const { return parents_[node]; }
  /// The children of an inner node are `child_count` nodes from `first_child`, in the order of their octants.
  WFPG_HD node_id first_child(node_id node) const { return first_children_[node]; }
  /// Number of children of an inner node, 1 to 8.
  WFPG_HD std::uint32_t child_count(node_id node) const { return detail::popcount(child_masks_[node]); }
  /// The octants that an inner node has children in, a bit each.
  WFPG_HD std::uint32_t child_mask(node_id node) const { return child_masks_[node]; }
  /// The child of an inner node in an octant (bit 0: upper x, 1: y, 2: z), or invalid_node.
  WFPG_HD node_id child(node_id node, std::uint32_t octant) const {
    const std::uint32_t mask = child_masks_[node];
    if (!(mask >> octant & 1u)) return invalid_node;
    return first_children_[node] + detail::popcount(mask & ((1u << octant) - 1u));
  }

  /// The ancestor at a level no deeper than the node's own; the node itself at its own level. O(levels).
  WFPG_HD node_id ancestor(node_id node, std::uint32_t level) const {
    while (node >= level_begin_[level + 1]) node = parents_[node];
    return node;
  }

  /// The leaf at voxel coordinates below resolution, or invalid_node. O(depth).
  WFPG_HD node_id leaf_at(uvec3 voxel) const {
    if (empty()) return invalid_node;
    std::uint32_t below = depth_ - top_level_;  // an even number of levels
    std::uint32_t at = top_[top_index(voxel >> below, top_level_)];
    for (; below > 0 && at != invalid_node; below -= 2) at = steps_[at].at(voxel >> (below - 2));
    return at;
  }
  /// The leaf that holds a point, or invalid_node. O(depth).
  WFPG_HD node_id leaf_at(vec3 p) const {
    uvec3 voxel;
    return grid_.voxel_of(p, voxel) ? leaf_at(voxel) : invalid_node;
  }
  /// leaf_at(p), or else the leaf of the 26 around whose centre is nearest to p, or invalid_node: rounding
  /// puts one hit point in ten thousand next door.
  WFPG_HD node_id nearest_leaf(vec3 p) const {
    const node_id here = leaf_at(p);
    return here != invalid_node ? here : nearest_neighbour(p);
  }

  /// The node on the path from a leaf to the root whose face area is nearest, in ratio, to that of a cone's
  /// base at a distance: A = r² ω (paper, Eq. 6). `solid_angle` in steradians.
  WFPG_HD node_id node_for_cone(node_id leaf, float distance, float solid_angle) const {
    node_id node = leaf;
    for (std::uint32_t level = level_for_cone(distance, solid_angle); level < depth_; ++level)
      node = parents_[node];
    return node;
  }
  /// The level of that node; the leaves' where the cone is narrow.
  WFPG_HD std::uint32_t level_for_cone(float distance, float solid_angle) const {
    const float face = grid_.voxel_size() * grid_.voxel_size();
    const float ratio = distance * distance * solid_angle * (0.5f / face);  // 2: halfway to 4, in ratio
    if (!(ratio > 1.0f)) return depth_;
    // A level up for each power of 4 below the ratio, by its exponent.
    const std::uint32_t exponent = ((detail::float_bits(ratio) - 1u) >> 23) - 127u;
    return depth_ - detail::min(exponent / 2 + 1, depth_);
  }

  /// Voxel coordinates of a node at its own level. O(level).
  WFPG_HD uvec3 coordinates(node_id node) const {
    uvec3 c(0u);
    for (std::uint32_t shift = 0; node != 0; ++shift) {
      const node_id up = parents_[node];
      const std::uint32_t o = octant_of(node, up);
      c += uvec3(o & 1u, o >> 1 & 1u, o >> 2 & 1u) << shift;
      node = up;
    }
    return c;
  }
  /// World-space box of a node. O(level).
  WFPG_HD bounds3 bounds(node_id node) const {
    const float size = node_size(level_of(node));
    const vec3 lower = grid_.origin + vec3(coordinates(node)) * size;
    return {lower, lower + size};
  }
  /// The middle of that box. O(level).
  WFPG_HD vec3 centre(node_id node) const { return bounds(node).centre(); }
  /// Side of a node's cube, scene units.
  WFPG_HD float node_size(std::uint32_t level) const { return grid_.side / static_cast<float>(1u << level); }

 private:
  template <class Exec>
  friend class sparse_voxel_octree;

  WFPG_HD static std::uint32_t top_index(uvec3 p, std::uint32_t level) {
    return p.x | p.y << level | p.z << 2 * level;
  }

  WFPG_HD std::uint32_t octant_of(node_id node, node_id up) const {
    std::uint32_t mask = child_masks_[up];
    for (node_id before = first_children_[up]; before < node; ++before) mask &= mask - 1u;
    std::uint32_t o = 0;
    while (!(mask >> o & 1u)) ++o;
    return o;
  }
  WFPG_HD node_id nearest_neighbour(vec3 p) const {
    const vec3 g = grid_.to_grid(p);
    const auto last = static_cast<float>(grid_.resolution);
    const bool near = g.x >= -1.0f && g.x < last + 1.0f && g.y >= -1.0f && g.y < last + 1.0f &&
                      g.z >= -1.0f && g.z < last + 1.0f;
    if (!near) return invalid_node;
    node_id best = invalid_node;
    float best_distance = 1.0e30f;
    for (int i = 0; i < 27; ++i) {
      const vec3 v{floorf(g.x) + static_cast<float>(i % 3 - 1),
                   floorf(g.y) + static_cast<float>(i / 3 % 3 - 1),
                   floorf(g.z) + static_cast<float>(i / 9 - 1)};
      if (v.x < 0.0f || v.y < 0.0f || v.z < 0.0f || v.x >= last || v.y >= last || v.z >= last) continue;
      const node_id leaf = leaf_at(uvec3(v));
      const vec3 to_centre = v + 0.5f - g;
      const float distance = glm::dot(to_centre, to_centre);
      if (leaf == invalid_node || distance >= best_distance) continue;
      best = leaf;
      best_distance = distance;
    }
    return best;
  }

  voxel_grid grid_;
  std::uint32_t depth_ = 0;
  node_id level_begin_[max_depth + 2] = {};
  const node_id* parents_ = nullptr;         // a node
  const node_id* first_children_ = nullptr;  // an inner node
  const std::uint8_t* child_masks_ = nullptr;
  // Descents begin in a table of one level's nodes by their coordinates: each node's first step, or the leaf
  // that it is; invalid_node where there is none.
  std::uint32_t top_level_ = 0;
  const std::uint32_t* top_ = nullptr;
  const detail::two_levels* steps_ = nullptr;
};

namespace detail {

/// Whether a fragment is the first of its voxel's.
struct starts_voxel {
  array_view<const morton_code> codes;
  WFPG_HD bool operator()(std::uint32_t i) const { return i == 0 || codes[i] != codes[i - 1]; }
};

/// What is known of a leaf before there are nodes: its code, and the first level, from the root, on which it
/// and the leaf before it have nodes of their own.
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

/// Every inner level of the octree over its leaves, one level after the other: element l · leaves + i is the
/// node of level l that holds leaf i. 1 for the first element of each node: counting those numbers the nodes.
struct starts_node {
  array_view<const std::uint8_t> first_levels;
  float per_leaf;  // 1 / leaves

  WFPG_HD std::uint32_t operator()(std::uint32_t element) const {
    const auto leaves = static_cast<std::uint32_t>(first_levels.size());
    // Division by estimate: there are 13 levels at most, so that it errs by one at most.
    auto level = static_cast<std::uint32_t>(static_cast<float>(element) * per_leaf);
    auto rest = static_cast<std::int64_t>(element) - static_cast<std::int64_t>(level) * leaves;
    if (rest < 0) {
      --level;
      rest += leaves;
    } else if (rest >= static_cast<std::int64_t>(leaves)) {
      ++level;
      rest -= leaves;
    }
    return first_levels[static_cast<std::size_t>(rest)] <= level ? 1u : 0u;
  }
};

struct gather_level_ends {
  array_view<const std::uint32_t> nodes_through;  // an element of the levels
  std::size_t leaves;
  node_id* ends;
  WFPG_HD void operator()(std::size_t level) const { ends[level] = nodes_through[(level + 1) * leaves - 1]; }
};

/// Links the nodes that begin with a leaf with their parents, and remembers that leaf.
struct link_nodes {
  array_view<const std::uint8_t> first_levels;
  array_view<const std::uint32_t> nodes_through;  // an element of the levels
  std::uint32_t depth;
  node_id first_leaf;
  node_id* parents;
  node_id* first_children;
  std::uint32_t* first_leaf_of;  // a node: counted from the first leaf

  WFPG_HD void operator()(std::size_t leaf) const {
    const std::uint32_t first = first_levels[leaf];
    node_id up = first > 0 ? node(first - 1, leaf) : invalid_node;
    for (std::uint32_t level = first; level <= depth; ++level) {
      const node_id here = node(level, leaf);
      first_leaf_of[here] = static_cast<std::uint32_t>(leaf);
      parents[here] = up;
      if (level > first) first_children[up] = here;
      up = here;
    }
  }

 private:
  WFPG_HD node_id node(std::uint32_t level, std::size_t leaf) const {
    if (level == depth) return first_leaf + static_cast<node_id>(leaf);
    return nodes_through[level * first_levels.size() + leaf] - 1;
  }
};

/// Which octants the children of an inner node are in. They end where those of the next node begin.
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

/// A level's nodes by their coordinates, each as the step that it has; leaves as themselves.
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

/// The steps that descents take from the nodes of a level.
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

/// Fragments in the order of their codes; those of one voxel keep their order.
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

/// Owns an octree in the memory of `Exec`. Without fragments it is empty and answers invalid_node.
template <class Exec>
class sparse_voxel_octree {
 public:
  sparse_voxel_octree() = default;

  /// Builds the octree whose leaves are the fragments' voxels, and sorts the fragments by Morton code (the
  /// cache is built from them next). Throws out_of_memory, std::invalid_argument where there are 2³² - 1
  /// nodes or more.
  sparse_voxel_octree(const Exec& exec, voxel_fragments<Exec>& fragments) {
    view_.grid_ = fragments.grid;
    while (1u << view_.depth_ < fragments.grid.resolution) ++view_.depth_;
    detail::sort_fragments(exec, fragments);
    build_levels(exec, find_leaves(exec, fragments));
  }

  /// What kernels see; valid while the octree lives.
  sparse_voxel_octree_view view() const { return view_; }
  /// Voxels along a side.
  std::uint32_t resolution() const { return view_.grid_.resolution; }
  /// Nodes of all levels.
  std::uint32_t node_count() const { return view_.node_count(); }
  /// Voxels that hold surface.
  std::uint32_t leaf_count() const { return view_.leaf_count(); }
  /// Of what is kept; without leaf_fragment_begin().
  std::size_t bytes() const {
    return parents_.bytes() + first_children_.bytes() + child_masks_.bytes() + top_.bytes() + steps_.bytes();
  }

  /// Where each leaf's fragments begin in the sorted order, until release_build_data(); a leaf's index counts
  /// from the first leaf.
  array_view<const std::uint32_t> leaf_fragment_begin() const {
    return {leaf_fragment_begin_.data(), leaf_fragment_begin_.size() > 0 ? leaf_count() : 0};
  }
  /// Frees what only building the cache needs.
  void release_build_data() { leaf_fragment_begin_ = {}; }

 private:
  struct leaves_of_build {
    buffer<morton_code, Exec> codes;
    buffer<std::uint8_t, Exec> first_levels;
  };

  /// The fragments' voxels.
  leaves_of_build find_leaves(const Exec& exec, const voxel_fragments<Exec>& fragments) {
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

  void build_levels(const Exec& exec, const leaves_of_build& leaves) {
    const std::size_t leaf_count = leaves.codes.size();
    const std::uint64_t element_count = std::uint64_t(view_.depth_) * leaf_count;
    detail::require(element_count < invalid_node, "number of leaves times levels", element_count,
                    "less than 2^32 - 1");
    const auto elements = static_cast<std::uint32_t>(element_count);
    const buffer<std::uint32_t, Exec> through(exec, elements);
    const ::thrust::counting_iterator<std::uint32_t> first(0);
    ::thrust::transform_inclusive_scan(
        exec.thrust(), first, first + elements, through.data(),
        detail::starts_node{leaves.first_levels.view(), 1.0f / static_cast<float>(leaf_count)},
        ::thrust::plus<std::uint32_t>());
    find_level_ends(exec, through, leaf_count);
    allocate(exec);
    const buffer<std::uint32_t, Exec> first_leaf_of(exec, view_.node_count());
    exec.for_each(leaf_count, detail::link_nodes{leaves.first_levels.view(), through.view(), view_.depth_,
                                                 view_.first_leaf(), parents_.data(), first_children_.data(),
                                                 first_leaf_of.data()});
    exec.for_each(first_children_.size(),
                  detail::find_child_masks{leaves.codes.view(), first_leaf_of.data(), first_children_.view(),
                                           view_.node_count(), view_, child_masks_.data()});
    const std::uint32_t top = view_.top_level_;
    ::thrust::fill_n(exec.thrust(), top_.data(), top_.size(), invalid_node);
    exec.for_each(level_size(top), detail::fill_top{leaves.codes.view(), first_leaf_of.data(),
                                                    view_.level_begin_[top], top, view_.depth_, top_.data()});
    std::uint32_t begin = 0;
    for (std::uint32_t level = top; level < view_.depth_; level += 2) {
      const std::uint32_t end = begin + level_size(level);
      exec.for_each(end - begin, detail::fill_steps{view_, level, end, steps_.data() + begin});
      begin = end;
    }
  }

  std::uint32_t level_size(std::uint32_t level) const {
    return view_.level_begin_[level + 1] - view_.level_begin_[level];
  }

  void find_level_ends(const Exec& exec, const buffer<std::uint32_t, Exec>& through, std::size_t leaves) {
    const std::uint32_t depth = view_.depth_;
    std::vector<node_id> inner_ends(depth, 0);
    if (leaves > 0 && depth > 0) {
      const buffer<node_id, Exec> ends(exec, depth);
      exec.for_each(depth, detail::gather_level_ends{through.view(), leaves, ends.data()});
      inner_ends = ends.to_host(exec);
    }
    for (std::uint32_t level = 1; level <= depth; ++level) view_.level_begin_[level] = inner_ends[level - 1];
    const std::uint64_t total = view_.level_begin_[depth] + std::uint64_t(leaves);
    detail::require(total < invalid_node, "number of octree nodes", total, "less than 2^32 - 1");
    for (std::uint32_t level = depth + 1; level < sparse_voxel_octree_view::max_depth + 2; ++level)
      view_.level_begin_[level] = static_cast<node_id>(total);
  }

  void allocate(const Exec& exec) {
    parents_ = buffer<node_id, Exec>(exec, view_.node_count());
    first_children_ = buffer<node_id, Exec>(exec, view_.first_leaf());
    child_masks_ = buffer<std::uint8_t, Exec>(exec, view_.first_leaf());
    view_.parents_ = parents_.data();
    view_.first_children_ = first_children_.data();
    view_.child_masks_ = child_masks_.data();
    if (view_.node_count() == 0) return;
    // An even number of levels above the leaves, and no larger than a byte a node.
    std::uint32_t& top = view_.top_level_ = view_.depth_ % 2;
    while (top + 2 < view_.depth_ && (4ull << 3 * (top + 2)) <= view_.node_count()) top += 2;
    std::uint32_t steps = 0;
    for (std::uint32_t level = top; level < view_.depth_; level += 2) steps += level_size(level);
    top_ = buffer<std::uint32_t, Exec>(exec, std::size_t(1) << 3 * top);
    steps_ = buffer<detail::two_levels, Exec>(exec, steps);
    view_.top_ = top_.data();
    view_.steps_ = steps_.data();
  }

  buffer<node_id, Exec> parents_;
  buffer<node_id, Exec> first_children_;
  buffer<std::uint8_t, Exec> child_masks_;
  buffer<std::uint32_t, Exec> top_;
  buffer<detail::two_levels, Exec> steps_;
  buffer<std::uint32_t, Exec> leaf_fragment_begin_;
  sparse_voxel_octree_view view_;
};

}  // namespace wfpg
