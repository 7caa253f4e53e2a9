// The two normals of a voxel: packing, k-means compared with a naive one, thin walls.
#include "support/cached_scene.hpp"
#include "support/catch.hpp"
#include "support/octree_nodes.hpp"
#include "support/policies.hpp"

#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/octree/voxel_normals.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace {

using namespace wfpg_test;
using glm::dvec3;
using wfpg::invalid_node;
using wfpg::node_id;
using wfpg::uvec3;
using wfpg::vec3;

double degrees_between(dvec3 a, dvec3 b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 57.29577951308232;
}

TEST_CASE("voxel normals in 16 bits are within 1 degree, and axes exact", "[exitance_cache]") {
  const auto round_trip = [](vec3 n) {
    return wfpg::detail::unpack_voxel_normal(wfpg::detail::pack_voxel_normal(n));
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {-1.0f, 1.0f}) {
      vec3 n(0.0f);
      n[axis] = sign;
      CHECK(glm::length(round_trip(n) - n) < 1.0e-6f);
    }
  random_numbers random(1);
  double worst = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const vec3 n = random.direction();
    worst = std::max(worst, degrees_between(n, round_trip(n)));
  }
  CHECK(worst < 1.0);
  CHECK(worst > 0.1);
}

struct weighted {
  dvec3 normal;
  double area;
};

/// Two clusters around the first normal and its opposite, weighted by area, in at most 8 rounds.
dvec3 naive_normal(const std::vector<weighted>& members) {
  dvec3 means[2] = {members[0].normal, -members[0].normal};
  double areas[2];
  for (int round = 0; round < 8; ++round) {
    dvec3 sums[2] = {dvec3(0.0), dvec3(0.0)};
    areas[0] = areas[1] = 0.0;
    for (const weighted& m : members) {
      const int nearest = glm::dot(m.normal, means[0]) >= glm::dot(m.normal, means[1]) ? 0 : 1;
      sums[nearest] += m.normal * m.area;
      areas[nearest] += m.area;
    }
    for (int k = 0; k < 2; ++k)
      if (glm::length(sums[k]) > 0.0) means[k] = glm::normalize(sums[k]);
  }
  return areas[1] > areas[0] ? means[1] : means[0];
}

WFPG_TEST_CASE("normals of voxels equal those of a naive k-means", "[exitance_cache]") {
  random_numbers random(2);
  std::vector<voxel_normal> list;
  for (std::uint32_t v = 0; v < 300; ++v) {
    const uvec3 voxel = wfpg::morton_decode(random.below(512));
    // Flat walls along the axes, so that some nodes' children have one normal, and some all but one.
    if (v % 2 == 0) {
      list.push_back({voxel, random.below(3) ? vec3(0, 0, 1) : vec3(1, 0, 0), random.between(0.1f, 2.0f)});
      continue;
    }
    const vec3 axis = random.direction();
    const float spread = random.unit();
    for (std::uint32_t i = random.below(12); i < 12; ++i) {
      const vec3 n = (random.below(3) ? axis : -axis) + spread * random.point(-0.6f, 0.6f);
      list.push_back({voxel, glm::normalize(n), random.between(0.1f, 2.0f)});
    }
  }
  const cached_scene<Exec> scene(fragments_in_grid<Exec>(list), 1);
  const auto codes = scene.fragments.codes.to_host(scene.exec);
  const auto surfaces = scene.fragments.surfaces.to_host(scene.exec);
  const auto begin = to_host(scene.exec, scene.tree.leaf_fragment_begin());
  const auto tree = scene.octree();
  const std::vector<node_record> nodes = nodes_of(scene.exec, tree);
  const auto view = scene.view();
  const std::vector<vec3> node_normals = evaluate(scene.exec, nodes.size(), [=] WFPG_HD(std::size_t node) {
    return view.normal(static_cast<node_id>(node));
  });
  std::vector<double> node_areas(tree.node_count(), 0.0);
  double worst = 0.0;
  for (node_id node = tree.node_count(); node-- > 0;) {
    std::vector<weighted> members;
    if (tree.is_leaf(node)) {
      const std::size_t leaf = node - tree.first_leaf();
      const std::size_t end = leaf + 1 < begin.size() ? begin[leaf + 1] : codes.size();
      for (std::size_t i = begin[leaf]; i < end; ++i)
        members.push_back({wfpg::unpack_direction(surfaces[i].normal), surfaces[i].area});
    } else {
      for (std::uint32_t c = 0; c < nodes[node].child_count; ++c) {
        const node_id child = nodes[node].first_child + c;
        members.push_back({node_normals[child], node_areas[child]});
      }
    }
    for (const weighted& m : members) node_areas[node] += m.area;
    worst = std::max(worst, degrees_between(node_normals[node], naive_normal(members)));
  }
  CHECK(worst < 1.01);
}

WFPG_TEST_CASE("a thin wall's voxel has one normal for each side", "[exitance_cache]") {
  const vec3 z(0, 0, 1), x(1, 0, 0);
  const cached_scene<Exec> scene(fragments_in_grid<Exec>({
                                     {{0, 0, 0}, z, 3.0f},  // both sides; the first is larger
                                     {{0, 0, 0}, -z, 2.0f},
                                     {{2, 0, 0}, z, 2.0f},  // the second is larger
                                     {{2, 0, 0}, -z, 3.0f},
                                     {{4, 0, 0}, -z, 1.0f},  // equal: the first
                                     {{4, 0, 0}, z, 1.0f},
                                     {{6, 0, 0}, z, 0.0f},  // touched, without area
                                     {{0, 2, 0}, x, 1.0f},  // alone
                                 }),
                                 1);
  const auto normal_at = [&](uvec3 voxel) {
    const node_id leaf = scene.leaf_at(voxel);
    REQUIRE(leaf != invalid_node);
    return scene.normal(leaf);
  };
  CHECK(degrees_between(normal_at({0, 0, 0}), z) < 0.1);
  CHECK(degrees_between(normal_at({2, 0, 0}), -z) < 0.1);
  CHECK(degrees_between(normal_at({4, 0, 0}), -z) < 0.1);
  CHECK(degrees_between(normal_at({6, 0, 0}), z) < 0.1);
  CHECK(degrees_between(normal_at({0, 2, 0}), x) < 0.1);
  const node_id leaf = scene.leaf_at(uvec3(2, 0, 0));
  CHECK(scene.side_facing(leaf, -z) == 0);
  CHECK(scene.side_facing(leaf, glm::normalize(vec3(5, 5, -1))) == 0);
  CHECK(scene.side_facing(leaf, z) == 1);
}

}  // namespace
