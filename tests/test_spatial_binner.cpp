// The spatial binner, compared with a literal transcription of Algorithm 2.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/octree_nodes.hpp"
#include "support/policies.hpp"
#include "support/random_meshes.hpp"

#include <wfpg/bins/spatial_binner.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

namespace {

using namespace wfpg_test;
using wfpg::binning_options;
using wfpg::invalid_node;
using wfpg::node_id;
using wfpg::ray_to_bin;
using wfpg::vec3;
using octree_view = wfpg::sparse_voxel_octree_view;

constexpr std::uint32_t none = 0xffffffffu;

/// A ray as the algorithm sees it, read from an array.
struct read_rays {
  wfpg::array_view<const ray_to_bin> rays;
  WFPG_HD ray_to_bin operator()(std::size_t i) const { return rays[i]; }
};

/// A bin as a view reports it.
struct bin_record {
  node_id node;
  std::uint32_t orientation, begin, size;
};

template <class Exec>
std::vector<bin_record> records(const Exec& exec, const wfpg::bins_view& bins) {
  return evaluate(exec, wfpg::read_element(exec, bins.count), [=] WFPG_HD(std::size_t bin) {
    return bin_record{bins.node(bin), bins.orientation(bin), bins.begin(bin), bins.size(bin)};
  });
}

struct leaf_of_ray {
  octree_view tree;
  WFPG_HD node_id operator()(const ray_to_bin& ray) const { return tree.nearest_leaf(ray.position); }
};

/// Algorithm 2: rays of each bin, bins by node and orientation, in order.
struct naive_bins {
  std::map<std::uint32_t, std::vector<std::uint32_t>> rays_of;
  std::vector<std::uint32_t> key_of;
  std::uint32_t unbinned = 0;

  template <class Exec>
  naive_bins(const Exec& exec, const octree_view& tree, const std::vector<ray_to_bin>& rays,
             binning_options options) {
    const std::vector<node_record> nodes = nodes_of(exec, tree);
    const std::vector<node_id> leaves = evaluate(exec, rays, leaf_of_ray{tree});
    const std::uint32_t l_min = std::min(options.min_level, tree.depth());
    std::map<node_id, std::uint32_t> counts;
    std::set<node_id> marked;
    std::vector<node_id> bins;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const ray_to_bin& ray = rays[i];
      const node_id leaf = ray.active ? leaves[i] : invalid_node;
      bins.push_back(leaf);
      if (leaf != invalid_node) ++counts[leaf];
      unbinned += ray.active && leaf == invalid_node ? 1 : 0;
    }
    for (std::uint32_t level = tree.depth() + 1; level-- > l_min;)
      for (node_id node = tree.level_begin(level); node < tree.level_begin(level + 1); ++node) {
        if (level < tree.depth())
          for (std::uint32_t octant = 0; octant < 8; ++octant)
            if (nodes[node].child[octant] != invalid_node) counts[node] += counts[nodes[node].child[octant]];
        if (counts[node] >= options.rays_per_bin || level == l_min) marked.insert(node);
      }
    for (std::uint32_t i = 0; i < rays.size(); ++i) {
      key_of.push_back(none);
      node_id node = bins[i];
      if (node == invalid_node) continue;
      while (!marked.count(node)) node = nodes[node].parent;
      key_of[i] = node * wfpg::orientations + rays[i].orientation;
      rays_of[key_of[i]].push_back(i);
    }
  }
};

template <class Exec>
void check_bins(const Exec& exec, wfpg::spatial_binner<Exec>& binner, const octree_view& tree,
                const std::vector<ray_to_bin>& rays, binning_options options) {
  const wfpg::buffer<ray_to_bin, Exec> device(exec, rays);
  const wfpg::bins_view bins = binner.bin(exec, rays.size(), read_rays{device.view()});
  const naive_bins naive(exec, tree, rays, options);

  REQUIRE(wfpg::read_element(exec, bins.count) == naive.rays_of.size());
  CHECK(wfpg::read_element(exec, binner.unbinned()) == naive.unbinned);
  CHECK((to_host(exec, bins.ray_keys) == naive.key_of));
  const std::vector<bin_record> host = records(exec, bins);
  const std::vector<std::uint32_t> permutation = to_host(exec, bins.permutation);
  std::size_t wrong = 0, bin = 0;
  for (const auto& [key, members] : naive.rays_of) {
    const bin_record& b = host[bin++];
    wrong += b.node != key / wfpg::orientations || b.orientation != key % wfpg::orientations;
    wrong += b.size != members.size();
    for (std::size_t i = 0; i < members.size() && i < b.size; ++i)
      wrong += permutation[b.begin + i] != members[i] ? 1 : 0;
  }
  CHECK(wrong == 0);
}

/// Rays on a unit sphere around the origin, denser near the pole. Some are inactive, some far outside.
std::vector<ray_to_bin> random_rays(std::size_t n, bool oriented, std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<ray_to_bin> rays;
  for (std::size_t i = 0; i < n; ++i) {
    const float spread = std::pow(10.0f, random.between(-2.0f, 1.0f));
    const vec3 normal = glm::normalize(vec3(0, 0, 1) + spread * random.direction());
    ray_to_bin ray{normal, wfpg::orientation_any, random.below(10) != 0};
    if (oriented)
      ray.orientation = random.below(8) ? wfpg::dominant_axis(normal) : wfpg::orientation_transmits;
    if (random.below(20) == 0) ray.position *= random.between(0.3f, 1.5f);
    if (random.below(200) == 0) ray.position = vec3(1.0e4f, std::numeric_limits<float>::quiet_NaN(), 0.0f);
    rays.push_back(ray);
  }
  return rays;
}

/// An octree of a unit sphere.
template <class Exec>
struct sphere_tree {
  Exec exec;
  wfpg::voxel_fragments<Exec> fragments;
  wfpg::sparse_voxel_octree<Exec> tree;

  explicit sphere_tree(std::uint32_t resolution)
      : fragments(voxelized(exec, sphere_mesh(40), resolution)), tree(exec, fragments) {}
};

WFPG_TEST_CASE("bins equal those of Algorithm 2", "[spatial_binner]") {
  const sphere_tree<Exec> scene(32);
  for (const bool oriented : {false, true}) {
    const std::vector<ray_to_bin> rays = random_rays(4000, oriented, oriented ? 1 : 2);
    for (const binning_options options :
         {binning_options{3, 64}, binning_options{0, 64}, binning_options{2, 1}, binning_options{1, 300},
          binning_options{4, 16}, binning_options{5, 8}, binning_options{0, 1000000},
          binning_options{0, 0xffffffffu}}) {
      wfpg::spatial_binner<Exec> binner(scene.exec, scene.tree.view(), options, 4000);
      INFO("oriented " << oriented << ", l_min " << options.min_level << ", c_ray " << options.rays_per_bin);
      check_bins(scene.exec, binner, scene.tree.view(), rays, options);
    }
  }
}

WFPG_TEST_CASE("a least level below the leaves makes every leaf a bin", "[spatial_binner]") {
  const sphere_tree<Exec> scene(16);
  const std::vector<ray_to_bin> rays = random_rays(1500, false, 3);
  for (const std::uint32_t min_level : {4u, 5u, 12u, 13u, 0xffffffffu}) {
    const binning_options options{min_level, 1000000};
    wfpg::spatial_binner<Exec> binner(scene.exec, scene.tree.view(), options, rays.size());
    check_bins(scene.exec, binner, scene.tree.view(), rays, options);
    const wfpg::buffer<ray_to_bin, Exec> device(scene.exec, rays);
    const wfpg::bins_view bins = binner.bin(scene.exec, rays.size(), read_rays{device.view()});
    for (const bin_record& bin : records(scene.exec, bins)) REQUIRE(scene.tree.view().is_leaf(bin.node));
  }
}

WFPG_TEST_CASE("the leaf level takes part in marking", "[spatial_binner]") {
  const sphere_tree<Exec> scene(16);
  const octree_view tree = scene.tree.view();
  const std::vector<node_record> nodes = nodes_of(scene.exec, tree);
  const vec3 crowded = nodes[tree.first_leaf()].bounds.centre(), lonely = nodes.back().bounds.centre();
  std::vector<ray_to_bin> rays(64, ray_to_bin{crowded, wfpg::orientation_any, true});
  rays.push_back({lonely, wfpg::orientation_any, true});
  wfpg::spatial_binner<Exec> binner(scene.exec, tree, {1, 64}, 100);
  const wfpg::buffer<ray_to_bin, Exec> device(scene.exec, rays);
  const wfpg::bins_view bins = binner.bin(scene.exec, rays.size(), read_rays{device.view()});
  const std::vector<bin_record> host = records(scene.exec, bins);
  REQUIRE(host.size() == 2);
  CHECK(tree.level_of(host[0].node) == 1);  // by node, hence by level
  CHECK(host[0].size == 1);
  CHECK(host[1].node == tree.first_leaf());
  CHECK(host[1].size == 64);
}

WFPG_TEST_CASE("thresholds of thousands of rays decide exactly which leaf is a bin", "[spatial_binner]") {
  const sphere_tree<Exec> scene(16);
  const octree_view tree = scene.tree.view();
  const std::vector<node_record> nodes = nodes_of(scene.exec, tree);
  const vec3 crowded = nodes[tree.first_leaf()].bounds.centre(), other = nodes.back().bounds.centre();
  std::vector<ray_to_bin> rays(70000, ray_to_bin{crowded, wfpg::orientation_any, true});
  for (const std::uint32_t enough : {4096u, 10000u, 65536u, 70000u}) {
    rays.resize(70000);
    rays.resize(70000 + enough - 1, {other, wfpg::orientation_any, true});
    wfpg::spatial_binner<Exec> binner(scene.exec, tree, {1, enough}, rays.size());
    check_bins(scene.exec, binner, tree, rays, {1, enough});
  }
}

WFPG_TEST_CASE("rays without a bin are counted, and buffers are reused correctly", "[spatial_binner]") {
  const sphere_tree<Exec> scene(16);
  const octree_view tree = scene.tree.view();
  wfpg::spatial_binner<Exec> binner(scene.exec, tree, {3, 4}, 100);
  const vec3 surface(0, 0, 1), far(50, 0, 0), inside(0.0f);
  const vec3 odd(std::numeric_limits<float>::infinity(), 0, std::numeric_limits<float>::quiet_NaN());
  const auto any = wfpg::orientation_any;
  check_bins(scene.exec, binner, tree, {}, {3, 4});
  check_bins(scene.exec, binner, tree, std::vector<ray_to_bin>(50, {surface, any, false}), {3, 4});
  check_bins(scene.exec, binner, tree, std::vector<ray_to_bin>(50, {far, any, true}), {3, 4});
  check_bins(
      scene.exec, binner, tree,
      {{surface, any, true}, {far, any, true}, {far, any, false}, {inside, any, true}, {odd, any, true}},
      {3, 4});
  CHECK(wfpg::read_element(scene.exec, binner.unbinned()) == 3);
  check_bins(scene.exec, binner, tree, {{surface, any, true}}, {3, 4});  // nothing is left of earlier calls
}

WFPG_TEST_CASE("an octree without nodes has no bins", "[spatial_binner]") {
  const Exec exec;
  const std::vector<ray_to_bin> rays = random_rays(100, true, 4);
  for (const std::uint32_t resolution : {1u, 64u}) {
    auto fragments = voxelized(exec, test_mesh(), resolution);
    const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
    wfpg::spatial_binner<Exec> binner(exec, tree.view(), {3, 16}, 100);
    check_bins(exec, binner, tree.view(), rays, {3, 16});
  }
  const sphere_tree<Exec> scene(1);
  wfpg::spatial_binner<Exec> binner(exec, scene.tree.view(), {3, 16}, 100);
  check_bins(exec, binner, scene.tree.view(), rays, {3, 16});
}

WFPG_TEST_CASE("invalid arguments are refused", "[spatial_binner]") {
  const sphere_tree<Exec> scene(16);
  const octree_view tree = scene.tree.view();
  using binner_type = wfpg::spatial_binner<Exec>;
  CHECK_THROWS_AS(binner_type(scene.exec, tree, {3, 0}, 100), std::invalid_argument);
  CHECK_THROWS_AS(binner_type(scene.exec, tree, {3, 1}, 0xffffffffu), std::invalid_argument);
  binner_type binner(scene.exec, tree, {3, 8}, 100);
  const std::vector<ray_to_bin> rays = random_rays(101, false, 5);
  const wfpg::buffer<ray_to_bin, Exec> device(scene.exec, rays);
  CHECK_THROWS_AS(binner.bin(scene.exec, 101, read_rays{device.view()}), std::invalid_argument);
  check_bins(scene.exec, binner, tree, random_rays(100, false, 6), {3, 8});
}

TEST_CASE("dominant_axis() returns the axis nearest to a direction", "[spatial_binner]") {
  for (std::uint32_t axis = 0; axis < 6; ++axis) {
    vec3 n(0.1f, -0.2f, 0.3f);
    n[static_cast<int>(axis / 2)] = axis % 2 ? -0.9f : 0.9f;
    CHECK(wfpg::dominant_axis(n) == axis);
  }
  CHECK(wfpg::dominant_axis({0, 0, -1}) == 5);
  CHECK(wfpg::dominant_axis({0.5f, 0.5f, 0.5f}) == 0);
  CHECK(wfpg::dominant_axis({0, -0.5f, 0.5f}) == 3);
  random_numbers random(7);
  for (int i = 0; i < 1000; ++i) {
    const vec3 n = random.direction();
    const std::uint32_t axis = wfpg::dominant_axis(n);
    vec3 unit(0.0f);
    unit[static_cast<int>(axis / 2)] = axis % 2 ? -1.0f : 1.0f;
    REQUIRE(glm::dot(n, unit) >= 0.577f);
  }
}

}  // namespace
