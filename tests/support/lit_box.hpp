// The unit box with light on its walls, its octree and its cache.
#pragma once

#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <cstdint>

namespace wfpg_test {

template <class Exec>
struct lit_box {
  Exec exec;
  wfpg::sparse_voxel_octree<Exec> tree;
  wfpg::exitance_cache<Exec> cache;

  /// `radiance` is a function (std::uint32_t face, float u, float v) -> float.
  template <class Radiance>
  explicit lit_box(const Radiance& radiance, std::uint32_t resolution = 32) {
    const box_mesh<Exec> mesh(exec);
    auto fragments = wfpg::voxelize(exec, mesh.view(), resolution);
    tree = wfpg::sparse_voxel_octree<Exec>(exec, fragments);
    cache = wfpg::exitance_cache<Exec>(exec, tree, fragments, 6 * 64 * 64);
    shine(radiance);
  }

  /// Deposits light in 64² points a wall.
  template <class Radiance>
  void shine(const Radiance& radiance) {
    deposit_on_walls(exec, cache.view(), 64, radiance);
    cache.update(exec);
  }
};

}  // namespace wfpg_test
