// The sparse voxel octree: voxels that hold surface, and their ancestors, in contiguous arrays level by level
// (paper, section 3.2). It is built from sorted Morton codes after Karras 2012, "Maximizing Parallelism in
// the Construction of BVHs, Octrees, and k-d Trees". It is structure alone: exitance_cache.hpp keeps the
// radiance that leaves each node.
//
// Memory: 4 bytes a leaf and 9 an inner node. For descents, 16 more for each node of every other level, and
// at most 1 byte a node for the table where they begin. Build: a sort of the fragments and O(leaves · depth),
// with a quarter byte of memory for each leaf and level.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/morton.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <cmath>

namespace wfpg {

namespace detail {

/// A step of a descent over two levels at once. It says which of the 4³ nodes two levels below a node exist,
/// in Morton order. One read of 16 bytes replaces two of a child.
struct alignas(16) two_levels {
  std::uint64_t present = 0;  ///< a bit for each of the 64 nodes
  std::uint32_t first = 0;    ///< of those: its own two_levels, or the leaf that it is

  /// Returns the step, or the leaf, of the node at the last two bits of coordinates `p`; invalid_node if it
  /// is absent.
  WFPG_HD std::uint32_t at(uvec3 p) const {
    const std::uint32_t i = spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2;
    if (!(present >> i & 1u)) return invalid_node;
    // Nodes that exist lie in a row, so the bits before a node's own count its place.
    return first + popcount(present & ((std::uint64_t(1) << i) - 1u));
  }

 private:
  /// Moves bits 0 and 1 to 0 and 3, as Morton codes have them.
  WFPG_HD static std::uint32_t spread(std::uint32_t x) { return (x & 1u) | (x & 2u) << 2; }
};

}  // namespace detail

/// An octree as kernels see it; trivially copyable, valid while its owner lives. Level 0 is the root, level
/// depth() the leaves. Node ids grow with the level, and inside a level with the Morton code.
class sparse_voxel_octree_view {
 public:
  /// The deepest level that leaves can have. Resolutions are therefore at most 2¹² = 4096.
  static constexpr std::uint32_t max_depth = 12;

  /// Whether the octree has no nodes; then only counts and lookups may be asked for.
  WFPG_HD bool empty() const { return node_count() == 0; }
  /// Level of the leaves, 0 to max_depth; 2^depth() is the resolution.
  WFPG_HD std::uint32_t depth() const { return depth_; }
  /// The cube that the root covers, and its resolution.
  WFPG_HD const voxel_grid& grid() const { return grid_; }
  /// Number of nodes on all levels. Node ids are below it.
  WFPG_HD std::uint32_t node_count() const { return level_begin_[depth_ + 1]; }
  /// Number of leaves, which have the last ids.
  WFPG_HD std::uint32_t leaf_count() const { return node_count() - first_leaf(); }
  /// Id of the first leaf, and so the number of inner nodes.
  WFPG_HD node_id first_leaf() const { return level_begin_[depth_]; }
  /// Whether a node is on the last level. O(1).
  WFPG_HD bool is_leaf(node_id node) const { return node >= first_leaf(); }
  /// First node of a level, 0 <= level <= depth() + 1. It is one past the last node of the level above.
  WFPG_HD node_id level_begin(std::uint32_t level) const { return level_begin_[level]; }
  /// Number of nodes on a level, 0 <= level <= depth().
  WFPG_HD std::uint32_t level_size(std::uint32_t level) const {
    return level_begin_[level + 1] - level_begin_[level];
  }

  /// Level of a node. O(depth).
  WFPG_HD std::uint32_t level_of(node_id node) const {
    std::uint32_t level = depth_;
    while (node < level_begin_[level]) --level;
    return level;
  }
  /// Parent of a node; invalid_node for the root.
  WFPG_HD node_id parent(node_id node) const { return parents_[node]; }
  /// First child of an inner node. It has child_count() children with successive ids, in the order of their
  /// octants.
  WFPG_HD node_id first_child(node_id node) const { return first_children_[node]; }
  /// Number of children of an inner node, 1 to 8.
  WFPG_HD std::uint32_t child_count(node_id node) const { return detail::popcount(child_masks_[node]); }
  /// Octants in which an inner node has children: bit i for octant i.
  WFPG_HD std::uint32_t child_mask(node_id node) const { return child_masks_[node]; }
  /// Child of an inner node in an octant, or invalid_node. Bit 0 of the octant means the upper half in x, bit
  /// 1 in y, bit 2 in z.
  WFPG_HD node_id child(node_id node, std::uint32_t octant) const {
    const std::uint32_t mask = child_masks_[node];
    if (!(mask >> octant & 1u)) return invalid_node;
    return first_children_[node] + detail::popcount(mask & ((1u << octant) - 1u));
  }

  /// Ancestor of a node on a level that is not deeper than the node's own. On its own level it is the node.
  /// O(levels).
  WFPG_HD node_id ancestor(node_id node, std::uint32_t level) const {
    while (node >= level_begin_[level + 1]) node = parents_[node];
    return node;
  }

  /// Leaf at voxel coordinates below the resolution, or invalid_node where the voxel is empty. O(depth).
  WFPG_HD node_id leaf_at(uvec3 voxel) const { return empty() ? invalid_node : descend(voxel, depth_); }
  /// Node of a level, at most depth(), that holds a voxel; invalid_node where there is none. The voxel's
  /// coordinates are below the resolution. O(depth).
  WFPG_HD node_id node_at(uvec3 voxel, std::uint32_t level) const {
    if (empty()) return invalid_node;
    std::uint32_t at_level = 0;
    node_id node = 0;
    if (level >= top_level_) {
      // Steps go down two levels at a time from the top level, and a child the odd one.
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
  /// Node of a level, at most depth(), that holds a world-space point. Where there is none, it is the
  /// ancestor of nearest_leaf(), or invalid_node. O(level): most empty voxels beside a surface have a node on
  /// the levels above.
  WFPG_HD node_id nearest_node(vec3 p, std::uint32_t level) const {
    uvec3 voxel;
    const node_id here = grid_.voxel_of(p, voxel) ? node_at(voxel, level) : invalid_node;
    if (here != invalid_node) return here;
    const node_id leaf = nearest_leaf(p);
    return leaf == invalid_node ? invalid_node : ancestor(leaf, level);
  }
  /// Leaf that holds a world-space point. It is invalid_node for points in empty voxels, outside the cube, or
  /// not finite. O(depth).
  WFPG_HD node_id leaf_at(vec3 p) const {
    uvec3 voxel;
    return grid_.voxel_of(p, voxel) ? leaf_at(voxel) : invalid_node;
  }
  /// Leaf that holds a world-space point, or else the nearest of the 26 voxels around it, by distance to
  /// their centres. It is invalid_node where none of the 27 holds surface. Rounding puts one hit point in ten
  /// thousand next door. O(depth), and 27 times as much where the point's own voxel is empty.
  WFPG_HD node_id nearest_leaf(vec3 p) const {
    const node_id here = leaf_at(p);
    return here != invalid_node ? here : nearest_neighbour(p);
  }

  /// Node whose face area is nearest, in ratio, to that of a cone's base: A = r² ω (paper, Eq. 6). The node
  /// is on the path from `leaf` to the root. `distance`: r, scene units. `solid_angle`: ω, steradians.
  /// O(depth).
  WFPG_HD node_id node_for_cone(node_id leaf, float distance, float solid_angle) const {
    node_id node = leaf;
    for (std::uint32_t level = level_for_cone(distance, solid_angle); level < depth_; ++level)
      node = parents_[node];
    return node;
  }
  /// Level of node_for_cone()'s node; depth() where the cone is narrower than a voxel, or where r² ω is NaN.
  WFPG_HD std::uint32_t level_for_cone(float distance, float solid_angle) const {
    const float face = grid_.voxel_size() * grid_.voxel_size();
    const float ratio = distance * distance * solid_angle * (0.5f / face);  // 2: halfway to 4, in ratio
    if (!(ratio > 1.0f)) return depth_;
    // A level up for each power of 4 below the ratio, by its exponent.
    const std::uint32_t exponent = ((float_bits(ratio) - 1u) >> 23) - 127u;
    return depth_ - min(exponent / 2 + 1, depth_);
  }

  /// Coordinates of a node among the 2^level cells a side of its own level. O(level).
  WFPG_HD uvec3 coordinates(node_id node) const {
    uvec3 c(0u);
    for (std::uint32_t shift = 0; node != 0; ++shift) {
      // Each level adds a bit to the coordinates, the lowest first.
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
  /// World-space middle of a node's box. O(level).
  WFPG_HD vec3 centre(node_id node) const { return bounds(node).centre(); }
  /// Side of the cubes of a level's nodes, scene units.
  WFPG_HD float node_size(std::uint32_t level) const { return grid_.side / static_cast<float>(1u << level); }

 private:
  template <class Exec>
  friend class sparse_voxel_octree;

  /// Place of a node of the top level in the table where descents begin, by its coordinates.
  WFPG_HD static std::uint32_t top_index(uvec3 p, std::uint32_t level) {
    return p.x | p.y << level | p.z << 2 * level;
  }

  /// Returns the step of the node of a level that holds a voxel. On the last level it is the leaf. It is
  /// invalid_node where there is none. The level is an even number of levels above the leaves, and not above
  /// the top level. Precondition: not empty.
  WFPG_HD std::uint32_t descend(uvec3 voxel, std::uint32_t level) const {
    const std::uint32_t end = depth_ - level;
    std::uint32_t below = depth_ - top_level_;
    std::uint32_t at = top_[top_index(voxel >> below, top_level_)];
    for (; below > end && at != invalid_node; below -= 2) at = steps_[at].at(voxel >> (below - 2));
    return at;
  }
  /// Node whose step of a level descend() found.
  WFPG_HD node_id node_of_step(std::uint32_t at, std::uint32_t level) const {
    if (level == depth_) return at;
    for (std::uint32_t above = top_level_; above < level; above += 2) at -= level_size(above);
    return level_begin_[level] + at;
  }
  /// Octant of a node in its parent `up`: the bit of the parent's mask at the node's place among its
  /// children.
  WFPG_HD std::uint32_t octant_of(node_id node, node_id up) const {
    std::uint32_t mask = child_masks_[up];
    for (node_id before = first_children_[up]; before < node; ++before) mask &= mask - 1u;
    std::uint32_t o = 0;
    while (!(mask >> o & 1u)) ++o;
    return o;
  }
  /// Leaf with the nearest centre among the 27 voxels around a point, or invalid_node.
  WFPG_HD node_id nearest_neighbour(vec3 p) const {
    const vec3 g = grid_.to_grid(p);
    const auto last = static_cast<float>(grid_.resolution);
    // Points more than a voxel outside the cube have no neighbour in it, nor have those that are not finite.
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
  node_id level_begin_[max_depth + 2] = {};    ///< a level: its first node; unused levels: node_count()
  const node_id* parents_ = nullptr;           ///< a node: its parent
  const node_id* first_children_ = nullptr;    ///< an inner node
  const std::uint8_t* child_masks_ = nullptr;  ///< an inner node
  // Descents begin in a table of one level's nodes, by their coordinates. An entry is the node's first step,
  // or the leaf that the node is; invalid_node where there is no node.
  std::uint32_t top_level_ = 0;
  const std::uint32_t* top_ = nullptr;         ///< 8^top_level_ entries
  const detail::two_levels* steps_ = nullptr;  ///< nodes of every other level, from the top one on
};

namespace detail {
struct node_numbers;
}

/// Owns an octree in the memory of `Exec`. Without fragments the octree is empty: lookups return
/// invalid_node.
template <class Exec>
class sparse_voxel_octree {
 public:
  /// An empty octree without memory.
  sparse_voxel_octree() = default;

  /// Builds the octree whose leaves are the fragments' voxels. It sorts `fragments` by Morton code, since the
  /// cache is built from them next. Throws std::invalid_argument where the resolution is no power of two in
  /// [1, 4096]. Throws it too where there are 2³² - 1 nodes or more, or leaves times levels reach that
  /// number. Throws out_of_memory.
  sparse_voxel_octree(const Exec& exec, voxel_fragments<Exec>& fragments);

  /// The octree for kernels; valid while this object lives and is not moved from.
  sparse_voxel_octree_view view() const { return view_; }
  /// Number of voxels along a side of the cube.
  std::uint32_t resolution() const { return view_.grid_.resolution; }
  /// Total of inner nodes and leaves, without a read from the device.
  std::uint32_t node_count() const { return view_.node_count(); }
  /// Number of voxels that hold surface.
  std::uint32_t leaf_count() const { return view_.leaf_count(); }
  /// Bytes of the octree itself, without leaf_fragment_begin().
  std::size_t bytes() const {
    return parents_.bytes() + first_children_.bytes() + child_masks_.bytes() + top_.bytes() + steps_.bytes();
  }

  /// Where each leaf's fragments begin in the sorted order. Indices count from the first leaf. Empty after
  /// release_build_data().
  array_view<const std::uint32_t> leaf_fragment_begin() const {
    return {leaf_fragment_begin_.data(), leaf_fragment_begin_.size() > 0 ? leaf_count() : 0};
  }
  /// Frees what only the building of the cache reads: 4 bytes a fragment.
  void release_build_data() { leaf_fragment_begin_ = {}; }

 private:
  /// What is known of the leaves before there are nodes.
  struct leaves_of_build {
    buffer<morton_code, Exec> codes;          ///< a leaf
    buffer<std::uint8_t, Exec> first_levels;  ///< a leaf, see describe_leaves
  };

  /// Finds the distinct codes among sorted fragments.
  leaves_of_build find_leaves(const Exec& exec, const voxel_fragments<Exec>& fragments);
  /// Builds all levels above the leaves at once, and the steps of descents.
  void build_levels(const Exec& exec, const leaves_of_build& leaves);
  /// Sets the view's level_begin_; waits for the device once.
  void find_level_ends(const Exec& exec, const detail::node_numbers& inner, std::size_t leaves);
  /// Allocates the arrays for the counts that are known by then.
  void allocate(const Exec& exec);
  /// Fills the table where descents begin, and the steps of every other level.
  void build_descents(const Exec& exec, const buffer<morton_code, Exec>& leaf_codes,
                      const buffer<std::uint32_t, Exec>& first_leaf_of);

  buffer<node_id, Exec> parents_;                    ///< a node: its parent
  buffer<node_id, Exec> first_children_;             ///< an inner node: its first child
  buffer<std::uint8_t, Exec> child_masks_;           ///< an inner node: its octants
  buffer<std::uint32_t, Exec> top_;                  ///< where descents begin
  buffer<detail::two_levels, Exec> steps_;           ///< of every other level
  buffer<std::uint32_t, Exec> leaf_fragment_begin_;  ///< sized for one leaf a fragment
  sparse_voxel_octree_view view_;                    ///< of the buffers above
};

}  // namespace wfpg

#include <wfpg/octree/detail/sparse_voxel_octree_impl.hpp>
