// The sparse voxel octree: voxels that hold surface, and their ancestors, level by level in contiguous arrays
// (paper, section 3.2; built from sorted Morton codes after Karras 2012, "Maximizing Parallelism in the
// Construction of BVHs, Octrees, and k-d Trees"). Structure only; what light leaves a node is
// exitance_cache.hpp's.
//
// Memory: 4 bytes a leaf, 9 an inner node, and at most one a node where descents begin. Build: a sort of the
// fragments and O(nodes).
#pragma once

#include <wfpg/buffer.hpp>
#include <wfpg/detail/math.hpp>
#include <wfpg/detail/thrust.hpp>
#include <wfpg/morton.hpp>
#include <wfpg/types.hpp>
#include <wfpg/voxelizer.hpp>

#include <thrust/fill.h>
#include <thrust/iterator/zip_iterator.h>
#include <thrust/scan.h>
#include <thrust/sort.h>
#include <thrust/tuple.h>

#include <cmath>
#include <vector>

namespace wfpg {

/// What a kernel sees of an octree. Level 0 is the root, level depth() the leaves; ids grow with the level,
/// and in a level with the Morton code.
class sparse_voxel_octree_view {
 public:
  static constexpr std::uint32_t max_depth = 12;

  WFPG_HD bool empty() const { return node_count() == 0; }
  WFPG_HD std::uint32_t depth() const { return depth_; }
  WFPG_HD const voxel_grid& grid() const { return grid_; }
  WFPG_HD std::uint32_t node_count() const { return level_begin_[depth_ + 1]; }
  WFPG_HD std::uint32_t leaf_count() const { return node_count() - first_leaf(); }
  WFPG_HD node_id first_leaf() const { return level_begin_[depth_]; }
  WFPG_HD bool is_leaf(node_id node) const { return node >= first_leaf(); }
  /// The first node of a level, 0 <= level <= depth() + 1; one past the last of the level before it.
  WFPG_HD node_id level_begin(std::uint32_t level) const { return level_begin_[level]; }

  WFPG_HD std::uint32_t level_of(node_id node) const {
    std::uint32_t level = depth_;
    while (node < level_begin_[level]) --level;
    return level;
  }
  /// The node's parent; of the root, invalid_node.
  WFPG_HD node_id parent(node_id node) const { return parents_[node]; }
  /// The children of an inner node are `child_count` nodes from `first_child`, in the order of their octants.
  WFPG_HD node_id first_child(node_id node) const { return first_children_[node]; }
  WFPG_HD std::uint32_t child_count(node_id node) const { return detail::popcount8(child_masks_[node]); }
  /// The child of an inner node in an octant (bit 0: upper x, 1: y, 2: z), or invalid_node.
  WFPG_HD node_id child(node_id node, std::uint32_t octant) const {
    const std::uint32_t mask = child_masks_[node];
    if (!(mask >> octant & 1u)) return invalid_node;
    return first_children_[node] + detail::popcount8(mask & ((1u << octant) - 1u));
  }

  /// The ancestor at a level no deeper than the node's own; the node itself at its own level. O(levels).
  WFPG_HD node_id ancestor(node_id node, std::uint32_t level) const {
    while (node >= level_begin_[level + 1]) node = parents_[node];
    return node;
  }

  /// The leaf at voxel coordinates below resolution, or invalid_node. O(depth).
  WFPG_HD node_id leaf_at(uvec3 voxel) const {
    if (empty()) return invalid_node;
    std::uint32_t level = depth_ - top_level_;
    node_id node = top_[top_index(voxel >> level, top_level_)];
    for (; level > 0 && node != invalid_node; --level) node = child(node, octant(voxel, level - 1));
    return node;
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
    return ancestor(leaf, level_for_cone(distance, solid_angle));
  }
  WFPG_HD std::uint32_t level_for_cone(float distance, float solid_angle) const {
    const float area = distance * distance * solid_angle;
    std::uint32_t level = depth_;
    float face = grid_.voxel_size() * grid_.voxel_size();
    for (; level > 0 && area > 2.0f * face; --level) face *= 4.0f;  // 2: halfway to 4, in ratio
    return level;
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
  WFPG_HD vec3 centre(node_id node) const { return bounds(node).centre(); }
  /// Side of a node's cube, scene units.
  WFPG_HD float node_size(std::uint32_t level) const { return grid_.side / static_cast<float>(1u << level); }

 private:
  template <class Exec>
  friend class sparse_voxel_octree;

  WFPG_HD static std::uint32_t top_index(uvec3 p, std::uint32_t level) {
    return p.x | p.y << level | p.z << 2 * level;
  }

  WFPG_HD static std::uint32_t octant(uvec3 voxel, std::uint32_t bit) {
    return (voxel.x >> bit & 1u) | (voxel.y >> bit & 1u) << 1 | (voxel.z >> bit & 1u) << 2;
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
  // Descents begin in a table of the nodes of one level by their coordinates, invalid_node where there is
  // none.
  std::uint32_t top_level_ = 0;
  const node_id* top_ = nullptr;
};

namespace detail {

struct starts_group {
  array_view<const morton_code> codes;
  array_view<std::uint32_t> heads;
  int shift;  // codes that agree above this bit are one group
  WFPG_HD void operator()(std::size_t i) const {
    heads[i] = i == 0 || codes[i] >> shift != codes[i - 1] >> shift ? 1u : 0u;
  }
};

/// Gathers the code of each group, given the 1-based group of each element.
struct gather_groups {
  array_view<const morton_code> codes;
  array_view<const std::uint32_t> group_through;
  int shift;
  array_view<morton_code> group_codes;
  array_view<std::uint32_t> group_begin;
  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t group = group_through[i] - 1;
    if (i > 0 && group_through[i - 1] == group_through[i]) return;
    group_codes[group] = codes[i] >> shift;
    group_begin[group] = static_cast<std::uint32_t>(i);
  }
};

struct link_nodes {
  array_view<const morton_code> codes;
  array_view<const std::uint32_t> parent_through;
  node_id level_begin, parent_level_begin;
  node_id* parents;
  node_id* first_children;
  std::uint8_t* child_masks;
  WFPG_HD void operator()(std::size_t i) const {
    const node_id up = parent_level_begin + parent_through[i] - 1;
    parents[level_begin + i] = up;
    if (i > 0 && parent_through[i - 1] == parent_through[i]) return;
    std::uint32_t mask = 0;
    for (std::size_t j = i; j < codes.size() && parent_through[j] == parent_through[i]; ++j)
      mask |= 1u << (codes[j] & 7u);
    first_children[up] = static_cast<node_id>(level_begin + i);
    child_masks[up] = static_cast<std::uint8_t>(mask);
  }
};

/// A level's nodes by their coordinates.
struct fill_top {
  array_view<const morton_code> codes;
  node_id level_begin;
  std::uint32_t level;
  node_id* top;
  WFPG_HD void operator()(std::size_t i) const {
    const uvec3 p = morton_decode(codes[i]);
    top[p.x | p.y << level | p.z << 2 * level] = level_begin + static_cast<node_id>(i);
  }
};

/// Sorted codes to their distinct prefixes: what each element's group is, what the groups' codes and
/// beginnings are.
template <class Exec>
struct code_groups {
  buffer<std::uint32_t, Exec> through;  ///< an element: its group, counted from 1
  buffer<morton_code, Exec> codes;      ///< a group
  buffer<std::uint32_t, Exec> begin;    ///< a group: its first element

  code_groups() = default;
  code_groups(const Exec& exec, array_view<const morton_code> sorted, int shift)
      : through(exec, sorted.size()) {
    exec.for_each(sorted.size(), starts_group{sorted, through.view(), shift});
    ::thrust::inclusive_scan(exec.thrust(), through.data(), through.data() + sorted.size(), through.data());
    const std::size_t n = sorted.empty() ? 0 : read_element(exec, through.data() + sorted.size() - 1);
    codes = buffer<morton_code, Exec>(exec, n);
    begin = buffer<std::uint32_t, Exec>(exec, n);
    exec.for_each(sorted.size(), gather_groups{sorted, through.view(), shift, codes.view(), begin.view()});
  }
};

/// Fragments in the order of their codes; those of one voxel keep their order.
template <class Exec>
void sort_fragments(const Exec& exec, voxel_fragments<Exec>& fragments) {
  ::thrust::stable_sort_by_key(
      exec.thrust(), fragments.codes.data(), fragments.codes.data() + fragments.size(),
      ::thrust::make_zip_iterator(::thrust::make_tuple(fragments.normals.data(), fragments.areas.data())));
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
    leaf_fragments_ = detail::code_groups<Exec>(exec, fragments.codes.view(), 0);
    build_levels(exec);
  }

  sparse_voxel_octree_view view() const { return view_; }
  std::uint32_t resolution() const { return view_.grid_.resolution; }
  std::uint32_t node_count() const { return view_.node_count(); }
  std::uint32_t leaf_count() const { return view_.leaf_count(); }
  std::size_t bytes() const {
    return parents_.bytes() + first_children_.bytes() + child_masks_.bytes() + top_.bytes();
  }

  /// Where each leaf's fragments begin in the sorted order, until release_build_data(); a leaf's index counts
  /// from the first leaf.
  array_view<const std::uint32_t> leaf_fragment_begin() const { return leaf_fragments_.begin.view(); }
  /// Frees what only building the cache needs.
  void release_build_data() { leaf_fragments_ = {}; }

 private:
  void build_levels(const Exec& exec) {
    const std::uint32_t depth = view_.depth_;
    std::vector<detail::code_groups<Exec>> up(depth);  // up[l]: level l + 1 grouped into the nodes of level l
    array_view<const morton_code> codes = leaf_fragments_.codes.view();
    std::vector<array_view<const morton_code>> level_codes(depth + 1);
    level_codes[depth] = codes;
    for (std::uint32_t level = depth; level-- > 0;) {
      up[level] = detail::code_groups<Exec>(exec, level_codes[level + 1], 3);
      level_codes[level] = up[level].codes.view();
    }
    std::uint64_t total = 0;
    for (std::uint32_t level = 0; level <= depth; ++level) {
      view_.level_begin_[level] = static_cast<node_id>(total);
      total += level_codes[level].size();
    }
    detail::require(total < invalid_node, "number of octree nodes", total, "less than 2^32 - 1");
    for (std::uint32_t level = depth + 1; level < sparse_voxel_octree_view::max_depth + 2; ++level)
      view_.level_begin_[level] = static_cast<node_id>(total);
    allocate(exec);
    for (std::uint32_t level = 1; level <= depth; ++level)
      exec.for_each(level_codes[level].size(),
                    detail::link_nodes{level_codes[level], up[level - 1].through.view(),
                                       view_.level_begin_[level], view_.level_begin_[level - 1],
                                       parents_.data(), first_children_.data(), child_masks_.data()});
    const std::uint32_t top = view_.top_level_;
    ::thrust::fill_n(exec.thrust(), top_.data(), top_.size(), invalid_node);
    exec.for_each(level_codes[top].size(),
                  detail::fill_top{level_codes[top], view_.level_begin_[top], top, top_.data()});
  }

  void allocate(const Exec& exec) {
    parents_ = buffer<node_id, Exec>(exec, view_.node_count());
    first_children_ = buffer<node_id, Exec>(exec, view_.first_leaf());
    child_masks_ = buffer<std::uint8_t, Exec>(exec, view_.first_leaf());
    view_.parents_ = parents_.data();
    view_.first_children_ = first_children_.data();
    view_.child_masks_ = child_masks_.data();
    if (view_.node_count() == 0) return;
    // Two levels above the leaves at the deepest, and no larger than a byte a node.
    view_.top_level_ = view_.depth_ > 2 ? view_.depth_ - 2 : 0;
    while (view_.top_level_ > 0 && (4ull << 3 * view_.top_level_) > view_.node_count()) --view_.top_level_;
    top_ = buffer<node_id, Exec>(exec, std::size_t(1) << 3 * view_.top_level_);
    view_.top_ = top_.data();
    const node_id none = invalid_node;
    exec.copy_from_host(parents_.data(), &none, sizeof none);
  }

  buffer<node_id, Exec> parents_;
  buffer<node_id, Exec> first_children_;
  buffer<std::uint8_t, Exec> child_masks_;
  buffer<node_id, Exec> top_;
  detail::code_groups<Exec> leaf_fragments_;
  sparse_voxel_octree_view view_;
};

}  // namespace wfpg
