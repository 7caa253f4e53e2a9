// The two normals N and -N of each voxel: k-means, k = 2, over the normals of what lies in it (paper,
// section 3.2, figure 2). Leaves cluster their fragments, inner nodes their children. Two bytes a node.
#pragma once

#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/octree/bottom_up.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxelizer.hpp>

namespace wfpg::detail {

/// A unit direction in 16 bits, at most 1 degree away; the axes are exact.
WFPG_HD inline std::uint16_t pack_voxel_normal(vec3 n) {
  const vec2 p = direction_to_octahedron(n);
  const auto x = static_cast<std::uint32_t>(p.x * 127.0f + 127.5f);
  const auto y = static_cast<std::uint32_t>(p.y * 127.0f + 127.5f);
  return static_cast<std::uint16_t>(x | y << 8);
}
/// The direction, of any length.
WFPG_HD inline vec3 unpack_voxel_direction(std::uint16_t packed) {
  return octahedron_to_direction({(static_cast<float>(packed & 0xffu) - 127.0f) * (1.0f / 127.0f),
                                  (static_cast<float>(packed >> 8) - 127.0f) * (1.0f / 127.0f)});
}
WFPG_HD inline vec3 unpack_voxel_normal(std::uint16_t packed) {
  return glm::normalize(unpack_voxel_direction(packed));
}

/// A normal with the area that has it.
struct weighted_normal {
  vec3 normal;
  float area;
};

/// Normals that lie together. Two of these rather than an array: a GPU keeps them in registers.
struct normal_cluster {
  vec3 mean;
  vec3 sum{0.0f};
  float area = 0.0f;

  WFPG_HD explicit normal_cluster(vec3 seed) : mean(seed) {}
  WFPG_HD void begin() {
    sum = vec3(0.0f);
    area = 0.0f;
  }
  WFPG_HD void add(vec3 normal, float weight) {
    sum += normal * weight;
    area += weight;
  }
  /// To the mean of what was added; how far, as 1 - cosine.
  WFPG_HD float move() {
    const vec3 average = sum / max(area, 1.0e-30f);
    const float length = glm::length(average);
    if (!(length > 1.0e-6f)) return 0.0f;
    const vec3 before = mean;
    mean = average / length;
    return 1.0f - glm::dot(mean, before);
  }
};

/// Clusters normals around the first one and its opposite, by area, in at most 8 rounds; the mean of the
/// larger cluster, and the area of both. `members(i)` gives the i-th of n > 0 weighted normals.
template <class Members>
WFPG_HD weighted_normal dominant_normal(const Members& members, std::uint32_t n) {
  constexpr int rounds = 8;
  const vec3 first = members(0).normal;
  normal_cluster ahead{first}, behind{-first};
  for (int round = 0; round < rounds; ++round) {
    float least_turn = 1.0f;
    ahead.begin();
    behind.begin();
    for (std::uint32_t i = 0; i < n; ++i) {
      const weighted_normal m = members(i);
      const bool is_ahead = glm::dot(m.normal, ahead.mean) >= glm::dot(m.normal, behind.mean);
      least_turn = min(least_turn, fabsf(glm::dot(m.normal, first)));
      // A voxel that surfaces only touch has no area, but normals.
      const float weight = max(m.area, 1.0e-30f);
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

struct leaf_normals {
  array_view<const std::uint32_t> fragment_begin;  // a leaf
  array_view<const fragment_surface> fragments;
  node_id first_leaf;
  array_view<std::uint16_t> normals;
  array_view<float> areas;

  WFPG_HD void operator()(std::size_t leaf) const {
    const std::size_t begin = fragment_begin[leaf];
    const std::size_t end = leaf + 1 < fragment_begin.size() ? fragment_begin[leaf + 1] : fragments.size();
    const auto member = [&](std::uint32_t i) {
      const fragment_surface f = fragments[begin + i];
      return weighted_normal{unpack_direction(f.normal), f.area};
    };
    const weighted_normal dominant = dominant_normal(member, static_cast<std::uint32_t>(end - begin));
    normals[first_leaf + leaf] = pack_voxel_normal(dominant.normal);
    areas[first_leaf + leaf] = dominant.area;
  }
};

/// An inner node's normal, and which children's sides are swapped: those whose N faces away from it.
struct inner_normals {
  sparse_voxel_octree_view tree;
  array_view<std::uint16_t> normals;
  array_view<float> areas;
  array_view<std::uint8_t> swapped;

  WFPG_HD void operator()(node_id node) const {
    const node_id first = tree.first_child(node);
    const std::uint32_t n = tree.child_count(node);
    const auto member = [&](std::uint32_t c) {
      return weighted_normal{unpack_voxel_normal(normals[first + c]), areas[first + c]};
    };
    const weighted_normal dominant = dominant_normal(member, n);
    const std::uint16_t packed = pack_voxel_normal(dominant.normal);
    const vec3 normal = unpack_voxel_direction(packed);
    std::uint32_t bits = 0;
    for (std::uint32_t c = 0; c < n; ++c)
      if (glm::dot(normal, unpack_voxel_direction(normals[first + c])) < 0.0f) bits |= 1u << c;
    normals[node] = packed;
    areas[node] = dominant.area;
    swapped[node] = static_cast<std::uint8_t>(bits);
  }
};

/// Fills the normals of all nodes of a tree just built from sorted fragments, and what inner nodes know of
/// their children's sides.
template <class Exec>
void build_voxel_normals(const Exec& exec, const sparse_voxel_octree<Exec>& tree,
                         const voxel_fragments<Exec>& fragments, array_view<std::uint16_t> normals,
                         array_view<std::uint8_t> swapped) {
  const sparse_voxel_octree_view view = tree.view();
  const buffer<float, Exec> areas(exec, view.node_count());
  exec.for_each(view.leaf_count(), leaf_normals{tree.leaf_fragment_begin(), fragments.surfaces.view(),
                                                view.first_leaf(), normals, areas.view()});
  for_each_bottom_up(exec, view, 0, inner_normals{view, normals, areas.view(), swapped});
}

}  // namespace wfpg::detail
