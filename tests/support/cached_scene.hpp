// A scene with an octree and an exitance cache. A policy deposits into it.
#pragma once

#include "support/deposits.hpp"
#include "support/evaluate.hpp"
#include "support/policies.hpp"
#include "support/random_meshes.hpp"

#include <wfpg/octree/exitance_cache.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace wfpg_test {

/// Fragments, their octree and its cache.
template <class Exec>
struct cached_scene {
  Exec exec;
  wfpg::voxel_fragments<Exec> fragments;
  wfpg::sparse_voxel_octree<Exec> tree;
  wfpg::exitance_cache<Exec> cache;

  cached_scene(wfpg::voxel_fragments<Exec> from, std::size_t capacity)
      : fragments(std::move(from)), tree(exec, fragments), cache(exec, tree, fragments, capacity) {}
  cached_scene(const test_mesh& mesh, std::uint32_t resolution, std::size_t capacity)
      : cached_scene(voxelized(Exec(), mesh, resolution), capacity) {}

  wfpg::sparse_voxel_octree_view octree() const { return tree.view(); }
  wfpg::exitance_cache_view view() const { return cache.view(); }

  // Queries of the views for one place or node.
  wfpg::node_id leaf_at(wfpg::vec3 p) const {
    const auto tree = octree();
    return evaluate(exec, [=] WFPG_HD() { return tree.leaf_at(p); });
  }
  wfpg::node_id leaf_at(wfpg::uvec3 voxel) const {
    const auto tree = octree();
    return evaluate(exec, [=] WFPG_HD() { return tree.leaf_at(voxel); });
  }
  wfpg::node_id parent(wfpg::node_id node) const {
    const auto tree = octree();
    return evaluate(exec, [=] WFPG_HD() { return tree.parent(node); });
  }
  wfpg::vec3 normal(wfpg::node_id node) const {
    const auto of = view();
    return evaluate(exec, [=] WFPG_HD() { return of.normal(node); });
  }
  std::uint32_t side_facing(wfpg::node_id node, wfpg::vec3 direction) const {
    const auto of = view();
    return evaluate(exec, [=] WFPG_HD() { return of.side_facing(node, direction); });
  }
  float radiance(wfpg::node_id node, std::uint32_t side) const {
    const auto of = view();
    return evaluate(exec, [=] WFPG_HD() { return of.radiance(node, side); });
  }
  float read(wfpg::node_id node, wfpg::vec3 toward) const {
    const auto of = view();
    return evaluate(exec, [=] WFPG_HD() { return of.read(node, toward); });
  }
};

/// Fragments at the centres of voxels of a grid of 8³ unit voxels from the origin.
struct voxel_normal {
  wfpg::uvec3 voxel;
  wfpg::vec3 normal;
  float area;
};
template <class Exec>
wfpg::voxel_fragments<Exec> fragments_in_grid(const std::vector<voxel_normal>& list) {
  const Exec exec;
  std::vector<wfpg::morton_code> codes;
  std::vector<wfpg::fragment_surface> surfaces;
  for (const voxel_normal& f : list) {
    codes.push_back(wfpg::morton_encode(f.voxel));
    surfaces.push_back({wfpg::pack_direction(f.normal), f.area});
  }
  wfpg::voxel_fragments<Exec> fragments;
  fragments.codes = wfpg::buffer<wfpg::morton_code, Exec>(exec, codes);
  fragments.surfaces = wfpg::buffer<wfpg::fragment_surface, Exec>(exec, surfaces);
  fragments.grid = {wfpg::vec3(0.0f), 8.0f, 8};
  return fragments;
}

template <class Exec>
void deposit_all(const cached_scene<Exec>& scene, const std::vector<deposit>& deposits) {
  deposit_all(scene.exec, scene.view(), deposits);
}

}  // namespace wfpg_test
