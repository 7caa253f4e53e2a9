// The two normals N and -N of each voxel. They come from k-means with k = 2 over the normals of what lies in
// the voxel (paper, section 3.2, Figure 2). Leaves cluster their fragments, inner nodes their children. The
// paper starts from a random normal; here it is the first one, so that builds repeat to the bit.
//
// Cost: O(fragments + nodes), at most 8 rounds each. Memory: 2 bytes a node and 1 an inner node; 4 more a
// node while it runs.
#pragma once

#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxelizer.hpp>

namespace wfpg::detail {

/// Packs a unit direction into 16 bits, two octahedral coordinates of 8 bits. The error is at most 1 degree;
/// the axes are exact.
WFPG_HD inline std::uint16_t pack_voxel_normal(vec3 n) {
  const vec2 p = direction_to_octahedron(n);
  // Coordinates from -1 to 1 become 0 to 254, so that 0, and with it each axis, is exact.
  const auto x = static_cast<std::uint32_t>(p.x * 127.0f + 127.5f);
  const auto y = static_cast<std::uint32_t>(p.y * 127.0f + 127.5f);
  return static_cast<std::uint16_t>(x | y << 8);
}
/// Unpacks a packed direction, without making its length 1. Signs of dot products need no more.
WFPG_HD inline vec3 unpack_voxel_direction(std::uint16_t packed) {
  return octahedron_to_direction({(static_cast<float>(packed & 0xffu) - 127.0f) * (1.0f / 127.0f),
                                  (static_cast<float>(packed >> 8) - 127.0f) * (1.0f / 127.0f)});
}
/// Unpacks a packed direction to unit length.
WFPG_HD inline vec3 unpack_voxel_normal(std::uint16_t packed) {
  return glm::normalize(unpack_voxel_direction(packed));
}

/// A normal and the area of surface that has it.
struct weighted_normal {
  vec3 normal;  ///< unit length
  float area;   ///< square scene units; may be 0
};

/// One of the two clusters of k-means. Two objects rather than an array: a GPU keeps them in registers.
struct normal_cluster {
  vec3 mean;          ///< unit length
  vec3 sum{0.0f};     ///< of the normals in this round, by area
  float area = 0.0f;  ///< of the members so far, square scene units

  /// Starts at a unit normal.
  WFPG_HD explicit normal_cluster(vec3 seed) : mean(seed) {}
  /// Begins a round: the cluster has no members.
  WFPG_HD void begin() {
    sum = vec3(0.0f);
    area = 0.0f;
  }
  /// Adds a member. A weight of 0 leaves the cluster as it is.
  WFPG_HD void add(vec3 normal, float weight) {
    sum += normal * weight;
    area += weight;
  }
  /// Moves the mean to the members' direction. Returns how far it turned, as 1 - cosine. Without members, or
  /// where they cancel out, it stays.
  WFPG_HD float move() {
    // Neither an empty cluster nor one whose normals cancel out has a direction.
    const vec3 average = sum / max(area, 1.0e-30f);
    const float length = glm::length(average);
    if (!(length > 1.0e-6f)) return 0.0f;
    const vec3 before = mean;
    // The mean of unit normals is shorter than 1, and is made a direction again.
    mean = average / length;
    return 1.0f - glm::dot(mean, before);
  }
};

/// Clusters normals around the first one and its opposite, by area, in at most 8 rounds. Returns the mean of
/// the larger cluster and the area of both. `members(i)` is the i-th of n > 0 weighted normals.
template <class Members>
WFPG_HD weighted_normal dominant_normal(const Members& members, std::uint32_t n) {
  // Rounds end sooner where the means no longer move.
  // The bound keeps the time of a voxel with many fragments in hand.
  constexpr int rounds = 8;
  // Opposite normals do not cancel out: each has a cluster of its own.
  // One member is its own cluster: that is so in most leaves.
  const weighted_normal only = members(0);
  if (n == 1) return only;
  const vec3 first = only.normal;
  normal_cluster ahead{first}, behind{-first};
  for (int round = 0; round < rounds; ++round) {
    float least_turn = 1.0f;
    ahead.begin();
    behind.begin();
    for (std::uint32_t i = 0; i < n; ++i) {
      const weighted_normal m = members(i);
      // A normal belongs to the cluster whose mean is nearer.
      const bool is_ahead = glm::dot(m.normal, ahead.mean) >= glm::dot(m.normal, behind.mean);
      least_turn = min(least_turn, fabsf(glm::dot(m.normal, first)));
      // A voxel that surfaces only touch has no area, but normals.
      const float weight = max(m.area, 1.0e-30f);
      // Both clusters add, one of them nothing: threads of a warp do not diverge.
      ahead.add(m.normal, is_ahead ? weight : 0.0f);
      behind.add(m.normal, is_ahead ? 0.0f : weight);
    }
    const float moved = max(ahead.move(), behind.move());
    // Where all lie within 45 degrees of the line that the first one is on, so do the means, and no other
    // round sorts them otherwise.
    if (moved < 1.0e-6f || least_turn > 0.7072f) break;
  }
  return {behind.area > ahead.area ? behind.mean : ahead.mean, ahead.area + behind.area};
}

/// Computes the normal and area of a leaf from its fragments. Most leaves have one, whose normal and area
/// they take.
struct leaf_normals {
  array_view<const std::uint32_t> fragment_begin;  ///< a leaf: its first fragment
  array_view<const fragment_surface> fragments;    ///< in the order of their Morton codes
  node_id first_leaf;                              ///< of the octree
  array_view<std::uint16_t> normals;               ///< a node: packed
  array_view<float> areas;                         ///< a node: square scene units

  /// Writes the packed normal and the area of all fragments of one leaf.
  WFPG_HD void operator()(std::size_t leaf) const {
    // Fragments were sorted by voxel, so that those of a leaf lie in a row.
    const std::size_t begin = fragment_begin[leaf];
    // The last leaf's fragments end with the array.
    const std::size_t end = leaf + 1 < fragment_begin.size() ? fragment_begin[leaf + 1] : fragments.size();
    const auto member = [&](std::uint32_t i) {
      // A fragment counts by its area inside the voxel.
      const fragment_surface f = fragments[begin + i];
      return weighted_normal{unpack_direction(f.normal), f.area};
    };
    const weighted_normal dominant = dominant_normal(member, static_cast<std::uint32_t>(end - begin));
    normals[first_leaf + leaf] = pack_voxel_normal(dominant.normal);
    areas[first_leaf + leaf] = dominant.area;
  }
};

/// Computes the normal of an inner node from its children's. It also finds the children whose sides are
/// swapped: those whose N faces away from the node's. Children are clustered by the area of all surface below
/// them.
struct inner_normals {
  sparse_voxel_octree_view tree;      ///< the nodes' structure
  array_view<std::uint16_t> normals;  ///< a node: packed; children's are known
  array_view<float> areas;            ///< a node: of all surface below it
  array_view<std::uint8_t> swapped;   ///< an inner node: a bit a child

  /// Writes normal, area and swapped sides of one inner node, and reads those of its children.
  WFPG_HD void operator()(node_id node) const {
    const node_id first = tree.first_child(node);
    const std::uint32_t n = tree.child_count(node);
    const auto member = [&](std::uint32_t c) {
      return weighted_normal{unpack_voxel_normal(normals[first + c]), areas[first + c]};
    };
    // Most nodes lie on flat surfaces. Their children have one packed normal, so that clusters would be that
    // normal, and no child has its sides swapped.
    if (is_flat(first, n)) {
      normals[node] = normals[first];
      areas[node] = area_of(first, n);
      swapped[node] = 0;
      return;
    }
    // Up to eight children, each with all of its area at its own N.
    const weighted_normal dominant = dominant_normal(member, n);
    // Sides are compared by the packed normal, since it is what readers of the cache see.
    const std::uint16_t packed = pack_voxel_normal(dominant.normal);
    const vec3 normal = unpack_voxel_direction(packed);
    // Bit c is set where side 0 of child c belongs to side 1 of the node.
    std::uint32_t bits = 0;
    for (std::uint32_t c = 0; c < n; ++c)
      if (glm::dot(normal, unpack_voxel_direction(normals[first + c])) < 0.0f) bits |= 1u << c;
    normals[node] = packed;
    // Both clusters count: a parent weighs this node by all of its surface.
    areas[node] = dominant.area;
    swapped[node] = static_cast<std::uint8_t>(bits);
  }

 private:
  /// Whether n nodes from `first` on have one normal, so that there is nothing to cluster. Packed normals are
  /// compared: they are equal to the bit on one wall.
  WFPG_HD bool is_flat(node_id first, std::uint32_t n) const {
    for (std::uint32_t c = 1; c < n; ++c)
      if (normals[first + c] != normals[first]) return false;
    return true;
  }
  /// Area of surface below n nodes from `first` on, square scene units.
  WFPG_HD float area_of(node_id first, std::uint32_t n) const {
    float sum = 0.0f;
    for (std::uint32_t c = 0; c < n; ++c) sum += areas[first + c];
    return sum;
  }
};

/// Computes the normals of all nodes of an octree, and the children's swapped sides of inner nodes.
/// `fragments` are those that the octree was built from and sorted. `normals` has an entry a node, `swapped`
/// one an inner node. Precondition: release_build_data() has not been called. Throws out_of_memory.
template <class Exec>
void build_voxel_normals(const Exec& exec, const sparse_voxel_octree<Exec>& tree,
                         const voxel_fragments<Exec>& fragments, array_view<std::uint16_t> normals,
                         array_view<std::uint8_t> swapped) {
  const sparse_voxel_octree_view view = tree.view();
  // Areas weigh children against each other; only this build needs them.
  const buffer<float, Exec> areas(exec, view.node_count());
  exec.for_each(view.leaf_count(), leaf_normals{tree.leaf_fragment_begin(), fragments.surfaces.view(),
                                                view.first_leaf(), normals, areas.view()});
  // Deepest level first, so that children are clustered before their parents.
  for_each_bottom_up(exec, view, 0, inner_normals{view, normals, areas.view(), swapped});
}

}  // namespace wfpg::detail
