// The sparse voxel octree: voxels that hold surface, and their ancestors, level by level in contiguous arrays
// (paper, section 3.2; built from sorted Morton codes after Karras 2012, "Maximizing Parallelism in the
// Construction of BVHs, Octrees, and k-d Trees"). Structure only; what light leaves a node is
// exitance_cache.hpp's.
//
// Memory: 4 bytes a leaf, 9 an inner node, and for descents 16 for each node of every other level and at most
// 1 a node where they begin. Build: a sort of the fragments and O(leaves · depth), with a quarter byte for
// each of those.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/morton.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <cmath>

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
  /// Nodes of a level, 0 <= level <= depth().
  WFPG_HD std::uint32_t level_size(std::uint32_t level) const {
    return level_begin_[level + 1] - level_begin_[level];
  }

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
  WFPG_HD node_id leaf_at(uvec3 voxel) const { return empty() ? invalid_node : descend(voxel, depth_); }
  /// The node of a level, at most depth(), that a voxel lies in, by its coordinates below resolution, or
  /// invalid_node. O(depth).
  WFPG_HD node_id node_at(uvec3 voxel, std::uint32_t level) const {
    if (empty()) return invalid_node;
    std::uint32_t at_level = 0;
    node_id node = 0;
    if (level >= top_level_) {
      at_level = level - (level - top_level_) % 2;
      const std::uint32_t at = descend(voxel, at_level);
      node = at == invalid_node ? at : node_of_step(at, at_level);
    }
    while (at_level < level && node != invalid_node) {
      const uvec3 p = voxel >> (depth_ - ++at_level);
      node = child(node, (p.x & 1u) | (p.y & 1u) << 1 | (p.z & 1u) << 2);
    }
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
    const std::uint32_t exponent = ((float_bits(ratio) - 1u) >> 23) - 127u;
    return depth_ - min(exponent / 2 + 1, depth_);
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

  /// The step of the node that a voxel lies in on a level an even number of levels above the leaves and not
  /// above the top, or the leaf; invalid_node where there is none. Precondition: not empty.
  WFPG_HD std::uint32_t descend(uvec3 voxel, std::uint32_t level) const {
    const std::uint32_t end = depth_ - level;
    std::uint32_t below = depth_ - top_level_;
    std::uint32_t at = top_[top_index(voxel >> below, top_level_)];
    for (; below > end && at != invalid_node; below -= 2) at = steps_[at].at(voxel >> (below - 2));
    return at;
  }
  /// Whose step of a level descend() found.
  WFPG_HD node_id node_of_step(std::uint32_t at, std::uint32_t level) const {
    if (level == depth_) return at;
    for (std::uint32_t above = top_level_; above < level; above += 2) at -= level_size(above);
    return level_begin_[level] + at;
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
    const vec3 from_border = g + 1.0f;
    for (int axis = 0; axis < 3; ++axis)
      if (!is_in_range(from_border[axis], last + 2.0f)) return invalid_node;
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
struct node_numbers;
}

/// Owns an octree in the memory of `Exec`. Without fragments it is empty and answers invalid_node.
template <class Exec>
class sparse_voxel_octree {
 public:
  sparse_voxel_octree() = default;

  /// Builds the octree whose leaves are the fragments' voxels, and sorts the fragments by Morton code (the
  /// cache is built from them next). Throws out_of_memory, std::invalid_argument where the fragments' grid
  /// has no resolution that is a power of two in [1, 4096], and where there are 2³² - 1 nodes or more, or
  /// leaves times levels are.
  sparse_voxel_octree(const Exec& exec, voxel_fragments<Exec>& fragments);

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

  leaves_of_build find_leaves(const Exec& exec, const voxel_fragments<Exec>& fragments);
  void build_levels(const Exec& exec, const leaves_of_build& leaves);
  void find_level_ends(const Exec& exec, const detail::node_numbers& inner, std::size_t leaves);
  void allocate(const Exec& exec);
  void build_descents(const Exec& exec, const buffer<morton_code, Exec>& leaf_codes,
                      const buffer<std::uint32_t, Exec>& first_leaf_of);

  buffer<node_id, Exec> parents_;
  buffer<node_id, Exec> first_children_;
  buffer<std::uint8_t, Exec> child_masks_;
  buffer<std::uint32_t, Exec> top_;
  buffer<detail::two_levels, Exec> steps_;
  buffer<std::uint32_t, Exec> leaf_fragment_begin_;
  sparse_voxel_octree_view view_;
};

}  // namespace wfpg

#include <wfpg/octree/detail/sparse_voxel_octree_impl.hpp>
