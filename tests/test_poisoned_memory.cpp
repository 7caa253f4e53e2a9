// Memory that is not zero: voxelizer, octree and cache write before they read.
#include "support/cached_scene.hpp"
#include "support/poisoning_resource.hpp"
#include "support/policies.hpp"
#include "support/random_meshes.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::morton_code;
using wfpg::vec3;

constexpr unsigned char poisons[] = {0x00, 0xcd, 0xff};

/// Triangles whose corners just touch voxels' faces, so that rounding decides which voxels they touch.
test_mesh undecided_triangles(std::size_t n, std::uint32_t resolution) {
  const float side = 1.0f + 1.0f / static_cast<float>(resolution);  // of the cube around the unit box
  const float voxel = side / static_cast<float>(resolution), origin = 0.5f - 0.5f * side;
  test_mesh mesh = mixed_triangles(n, 1.0e-3f, 1.0f, 61);
  random_numbers random(62);
  for (vec3& p : mesh.positions)
    for (int axis = 0; axis < 3; ++axis) {
      const float off_face = random.below(2) ? 0x1p-10f : -0x1p-10f;
      p[axis] = origin + voxel * (std::floor((p[axis] - origin) / voxel) + off_face);
    }
  mesh.add_quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.add_quad({0, 0, 1}, {0, 1, 0}, {1, 0, 0});
  return mesh;
}

/// A host copy of an octree and its cache.
struct copied_scene {
  std::vector<morton_code> codes;
  std::vector<std::uint32_t> normals;
  std::vector<float> areas, radiance;

  bool operator==(const copied_scene& other) const {
    return codes == other.codes && normals == other.normals && areas == other.areas &&
           radiance == other.radiance;
  }
};

/// Radiance of both sides of a node.
struct radiance_of_sides {
  wfpg::exitance_cache_view cache;
  WFPG_HD float operator()(std::size_t i) const {
    return cache.radiance(static_cast<wfpg::node_id>(i / 2), static_cast<std::uint32_t>(i % 2));
  }
};

template <class Exec>
copied_scene scene_with(unsigned char poison, const test_mesh& mesh, std::uint32_t resolution) {
  poisoning_resource<Exec> resource(poison);
  const Exec exec = Exec().with_resource(&resource);
  wfpg::voxel_fragments<Exec> fragments = voxelized(exec, mesh, resolution);
  copied_scene copied;
  copied.codes = fragments.codes.to_host(exec);
  for (const wfpg::fragment_surface& s : fragments.surfaces.to_host(exec)) {
    copied.normals.push_back(s.normal);
    copied.areas.push_back(s.area);
  }
  const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
  wfpg::exitance_cache<Exec> cache(exec, tree, fragments, 1024);
  std::vector<deposit> deposits;
  for (std::size_t i = 0; i < 1000; ++i)
    deposits.push_back({mesh.positions[i], i % 2 ? vec3(0, 0, 1) : vec3(0, 1, 0), 1.0f});
  deposit_all(exec, cache.view(), deposits);
  cache.update(exec);
  const std::size_t sides = std::size_t(2) * tree.view().node_count();
  copied.radiance = evaluate(exec, sides, radiance_of_sides{cache.view()});
  return copied;
}

WFPG_TEST_CASE("fragments, octree and cache read only memory that they have written", "[poison]") {
  for (const std::uint32_t resolution : {32u, 256u}) {
    const test_mesh mesh = undecided_triangles(1500, resolution);
    const copied_scene first = scene_with<Exec>(poisons[0], mesh, resolution);
    std::size_t outside = 0, without_normal = 0, bright = 0;
    for (const morton_code code : first.codes)
      outside += code >= morton_code(resolution) * resolution * resolution;
    for (const std::uint32_t normal : first.normals)
      without_normal += (normal & 0xffffu) > 65534u || normal >> 16 > 65534u;
    for (const float value : first.radiance) bright += value > 0.0f;
    INFO("resolution " << resolution << ", " << first.codes.size() << " fragments");
    CHECK(first.codes.size() > 20000);
    CHECK(outside == 0);
    CHECK(without_normal == 0);
    CHECK(bright > 100);
    for (const unsigned char poison : poisons) {
      INFO("memory of bytes " << int(poison));
      CHECK((scene_with<Exec>(poison, mesh, resolution) == first));
    }
  }
}

}  // namespace
