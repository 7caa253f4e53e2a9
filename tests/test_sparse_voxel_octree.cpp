// The octree, compared with a naive one in a std::map: nodes, links, levels, look-ups, cones.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/octree_nodes.hpp"
#include "support/policies.hpp"
#include "support/random_meshes.hpp"

#include <wfpg/octree/sparse_voxel_octree.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <vector>

namespace {

using namespace wfpg_test;
using glm::dvec3;
using wfpg::invalid_node;
using wfpg::morton_code;
using wfpg::node_id;
using wfpg::uvec3;
using wfpg::vec3;
using octree_view = wfpg::sparse_voxel_octree_view;

/// The octree by definition: the distinct prefixes of the leaves' codes, ordered by level, then by code.
struct naive_octree {
  std::uint32_t depth = 0;
  std::vector<std::map<morton_code, node_id>> levels;
  node_id count = 0;

  naive_octree(const std::vector<morton_code>& codes, std::uint32_t resolution) {
    while (1u << depth < resolution) ++depth;
    levels.resize(depth + 1);
    for (const morton_code code : codes)
      for (std::uint32_t level = 0; level <= depth; ++level) levels[level][code >> 3 * (depth - level)] = 0;
    for (auto& level : levels)
      for (auto& entry : level) entry.second = count++;
  }
  node_id find(std::uint32_t level, morton_code code) const {
    const auto found = levels[level].find(code);
    return found == levels[level].end() ? invalid_node : found->second;
  }
  node_id leaf(uvec3 voxel) const { return find(depth, wfpg::morton_encode(voxel)); }
};

/// Counts the differences between a node and its record, except for bounds.
int differences(const naive_octree& naive, std::uint32_t level, morton_code code, const node_record& r) {
  int wrong = 0;
  wrong += r.level != level;
  wrong += r.is_leaf != (level == naive.depth ? 1u : 0u);
  wrong += r.parent != (level == 0 ? invalid_node : naive.find(level - 1, code >> 3));
  std::uint32_t children = 0;
  node_id first = invalid_node;
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    const node_id child = level == naive.depth ? invalid_node : naive.find(level + 1, code << 3 | octant);
    wrong += r.child[octant] != child;
    children += child != invalid_node ? 1 : 0;
    first = std::min(first, child);
  }
  wrong += r.child_count != children;
  wrong += r.first_child != first;
  for (std::uint32_t up = 0; up <= level; ++up)
    wrong += r.ancestor[up] != naive.find(up, code >> 3 * (level - up));
  return wrong + (r.coordinates != wfpg::morton_decode(code));
}

/// Whether a box has integer coordinates `at` of a level, up to rounding.
bool is_box_of(const wfpg::bounds3& box, const wfpg::voxel_grid& grid, std::uint32_t level, uvec3 at) {
  const double size = double(grid.side) / (1u << level);
  const dvec3 lower = dvec3(grid.origin) + dvec3(at) * size;
  const double tolerance = 1.0e-6 * (grid.side + glm::length(dvec3(grid.origin)));
  return glm::length(dvec3(box.lower) - lower) < tolerance &&
         glm::length(dvec3(box.upper) - (lower + size)) < tolerance;
}

const wfpg::vec3 grid_origin(-3.0f, 10.0f, 0.5f);

/// Fragments of given codes. Their areas number them in order.
template <class Exec>
wfpg::voxel_fragments<Exec> make_fragments(const Exec& exec, const std::vector<morton_code>& codes,
                                           std::uint32_t resolution) {
  std::vector<wfpg::fragment_surface> surfaces(codes.size());
  for (std::size_t i = 0; i < codes.size(); ++i)
    surfaces[i] = {static_cast<std::uint32_t>(7 * i), static_cast<float>(i)};
  wfpg::voxel_fragments<Exec> fragments;
  fragments.codes = wfpg::buffer<morton_code, Exec>(exec, codes);
  fragments.surfaces = wfpg::buffer<wfpg::fragment_surface, Exec>(exec, surfaces);
  fragments.grid = {grid_origin, 2.5f, resolution};
  return fragments;
}

/// Codes of n random voxels in small clusters. Some are repeated.
std::vector<morton_code> random_codes(std::size_t n, std::uint32_t resolution, std::uint64_t seed) {
  random_numbers random(seed);
  std::vector<morton_code> codes;
  while (codes.size() < n) {
    uvec3 p(random.below(resolution), random.below(resolution), random.below(resolution));
    for (std::uint32_t i = random.below(8); i < 8 && codes.size() < n; ++i) {
      codes.push_back(wfpg::morton_encode(p));
      p = glm::min(p + uvec3(random.below(2), random.below(2), random.below(2)), uvec3(resolution - 1));
    }
  }
  return codes;
}

struct octree_case {
  std::vector<morton_code> codes;
  std::uint32_t resolution;
};

std::vector<octree_case> cases() {
  std::vector<octree_case> all;
  for (const std::uint32_t resolution : {1u, 2u, 4u, 32u, 128u})
    all.push_back({random_codes(700, resolution, resolution), resolution});
  all.push_back({random_codes(3000, 1024, 5), 1024});
  all.push_back({random_codes(500, 4096, 6), 4096});
  all.push_back({{0}, 1024});
  all.push_back({{(1u << 30) - 1}, 1024});
  std::vector<morton_code> full(512);
  for (std::size_t i = 0; i < 512; ++i) full[i] = 511 - i;
  all.push_back({full, 8});
  return all;
}

template <class Exec>
void check_nodes(const Exec& exec, const octree_view& view, const naive_octree& naive) {
  REQUIRE(view.node_count() == naive.count);
  CHECK(view.depth() == naive.depth);
  CHECK(view.leaf_count() == naive.levels.back().size());
  const std::vector<node_record> host = nodes_of(exec, view);
  int wrong = 0, wrong_boxes = 0;
  node_id begin = 0;
  for (std::uint32_t level = 0; level <= naive.depth; ++level) {
    CHECK(view.level_begin(level) == begin);
    begin += static_cast<node_id>(naive.levels[level].size());
    for (const auto& [code, node] : naive.levels[level]) {
      wrong += differences(naive, level, code, host[node]);
      wrong_boxes += is_box_of(host[node].bounds, view.grid(), level, wfpg::morton_decode(code)) ? 0 : 1;
    }
  }
  CHECK(view.level_begin(naive.depth + 1) == begin);
  CHECK(wrong == 0);
  CHECK(wrong_boxes == 0);
}

WFPG_TEST_CASE("nodes and links equal a naive octree's", "[sparse_voxel_octree]") {
  const Exec exec;
  for (const octree_case& c : cases()) {
    auto fragments = make_fragments(exec, c.codes, c.resolution);
    const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
    const naive_octree naive(c.codes, c.resolution);
    INFO("resolution " << c.resolution);
    CHECK(tree.resolution() == c.resolution);
    CHECK(tree.node_count() == naive.count);
    const wfpg::sparse_voxel_octree_view view = tree.view();
    std::size_t every_other =
        0;  // nodes of the levels at which descents stop; at least the 8 of the first table
    for (std::uint32_t level = view.depth(); level >= 2; level -= 2)
      every_other += view.level_begin(level - 1) - view.level_begin(level - 2);
    CHECK(tree.bytes() <=
          5 * tree.leaf_count() + 10 * (tree.node_count() - tree.leaf_count()) + 16 * every_other + 4 * 8);
    check_nodes(exec, tree.view(), naive);
  }
}

WFPG_TEST_CASE("the build sorts fragments by voxel and keeps their order inside", "[sparse_voxel_octree]") {
  const Exec exec;
  for (const octree_case& c : cases()) {
    auto fragments = make_fragments(exec, c.codes, c.resolution);
    wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
    std::vector<std::size_t> order(c.codes.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return c.codes[a] < c.codes[b]; });
    const auto codes = fragments.codes.to_host(exec);
    const auto surfaces = fragments.surfaces.to_host(exec);
    std::vector<std::uint32_t> begin;
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      wrong += codes[i] != c.codes[order[i]] || surfaces[i].area != static_cast<float>(order[i]) ||
               surfaces[i].normal != 7 * order[i];
      if (i == 0 || codes[i] != codes[i - 1]) begin.push_back(static_cast<std::uint32_t>(i));
    }
    CHECK(wrong == 0);
    CHECK((to_host(exec, tree.leaf_fragment_begin()) == begin));
    tree.release_build_data();
    CHECK(tree.leaf_fragment_begin().empty());
  }
}

/// Points in and around a grid. They include corners of voxels, and points that no voxel can hold.
std::vector<vec3> query_points(const wfpg::voxel_grid& grid, const std::vector<morton_code>& codes) {
  random_numbers random(9);
  std::vector<vec3> points;
  const float voxel = grid.voxel_size();
  for (int i = 0; i < 1500; ++i) {
    const uvec3 at = wfpg::morton_decode(codes[random.below(static_cast<std::uint32_t>(codes.size()))]);
    points.push_back(grid.origin + voxel * (vec3(at) + random.point(-1.5f, 2.5f)));
    points.push_back(grid.origin + grid.side * random.point(-0.2f, 1.2f));
  }
  const float odd[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity(), 3.0e38f, -3.0e38f};
  for (const float value : odd)
    for (int axis = 0; axis < 3; ++axis) {
      points.push_back(grid.origin + 0.5f * grid.side);
      points.back()[axis] = value;
    }
  return points;
}

struct find_leaves {
  octree_view tree;
  wfpg::array_view<const vec3> points;
  wfpg::array_view<node_id> at, nearest;
  WFPG_HD void operator()(std::size_t i) const {
    at[i] = tree.leaf_at(points[i]);
    nearest[i] = tree.nearest_leaf(points[i]);
  }
};

/// Square distance from a point to the nearest centre of the leaves in the 27 voxels around it. Point in grid
/// units, distance in voxels. Negative if there is no leaf.
double nearest_square_distance(const naive_octree& naive, dvec3 g, std::uint32_t resolution) {
  double best = -1.0;
  for (int i = 0; i < 27; ++i) {
    const dvec3 voxel = glm::floor(g) + dvec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (glm::any(glm::lessThan(voxel, dvec3(0))) || glm::any(glm::greaterThanEqual(voxel, dvec3(resolution))))
      continue;
    if (naive.leaf(uvec3(voxel)) == invalid_node) continue;
    const dvec3 d = voxel + 0.5 - g;
    if (best < 0.0 || glm::dot(d, d) < best) best = glm::dot(d, d);
  }
  return best;
}

WFPG_TEST_CASE("points find their leaf, or the nearest of the 26 around", "[sparse_voxel_octree]") {
  const Exec exec;
  for (const octree_case& c : cases()) {
    auto fragments = make_fragments(exec, c.codes, c.resolution);
    const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
    const naive_octree naive(c.codes, c.resolution);
    const wfpg::voxel_grid grid = tree.view().grid();
    const std::vector<vec3> points = query_points(grid, c.codes);
    const wfpg::buffer<vec3, Exec> device(exec, points);
    const wfpg::buffer<node_id, Exec> at(exec, points.size()), nearest(exec, points.size());
    exec.for_each(points.size(), find_leaves{tree.view(), device.view(), at.view(), nearest.view()});
    const auto at_host = at.to_host(exec), nearest_host = nearest.to_host(exec);
    const std::vector<node_record> nodes = nodes_of(exec, tree.view());

    int wrong = 0, found = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool odd = !(glm::length(dvec3(points[i])) < 1.0e6);
      const dvec3 g = (dvec3(points[i]) - dvec3(grid.origin)) * (double(c.resolution) / grid.side);
      const dvec3 from_face = glm::abs(g - glm::round(g));
      if (!odd && glm::any(glm::lessThan(from_face, dvec3(1.0e-2)))) continue;  // rounding decides
      const bool in_grid =
          !odd && glm::all(glm::greaterThan(g, dvec3(0))) && glm::all(glm::lessThan(g, dvec3(c.resolution)));
      const node_id here = in_grid ? naive.leaf(uvec3(g)) : invalid_node;
      wrong += at_host[i] != here;
      const double expected = odd ? -1.0 : nearest_square_distance(naive, g, c.resolution);
      if (nearest_host[i] == invalid_node || here != invalid_node) {
        wrong += nearest_host[i] != here || (here == invalid_node && expected >= 0.0);
        continue;
      }
      ++found;
      const dvec3 d = dvec3(nodes[nearest_host[i]].coordinates) + 0.5 - g;
      wrong += !tree.view().is_leaf(nearest_host[i]) || std::abs(glm::dot(d, d) - expected) > 1.0e-2;
    }
    INFO("resolution " << c.resolution);
    CHECK(wrong == 0);
    CHECK((found > 0 || c.resolution == 8));
  }
}

WFPG_TEST_CASE("look-ups of all voxels agree with the map on every level", "[sparse_voxel_octree]") {
  const Exec exec;
  struct dense {
    std::uint32_t resolution, leaves;
  };
  for (const dense c : {dense{1, 1}, dense{2, 3}, dense{16, 60}, dense{16, 600}, dense{32, 5000}}) {
    const auto codes = random_codes(c.leaves, c.resolution, 77);
    auto fragments = make_fragments(exec, codes, c.resolution);
    const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
    const naive_octree naive(codes, c.resolution);
    const octree_view view = tree.view();
    const std::size_t n = std::size_t(c.resolution) * c.resolution * c.resolution;
    int wrong = 0;
    const auto leaves =
        evaluate(exec, n, [=] WFPG_HD(std::size_t code) { return view.leaf_at(wfpg::morton_decode(code)); });
    for (std::size_t code = 0; code < n; ++code) wrong += leaves[code] != naive.find(naive.depth, code);
    for (std::uint32_t level = 0; level <= naive.depth; ++level) {
      const auto nodes = evaluate(
          exec, n, [=] WFPG_HD(std::size_t code) { return view.node_at(wfpg::morton_decode(code), level); });
      for (std::size_t code = 0; code < n; ++code)
        wrong += nodes[code] != naive.find(level, code >> 3 * (naive.depth - level));
    }
    INFO("resolution " << c.resolution << ", leaves " << c.leaves);
    CHECK(wrong == 0);
  }
}

/// The ratio between the face of a node of a level and a cone's base.
double mismatch(const octree_view& view, std::uint32_t level, double area) {
  const double size = double(view.grid().side) / (1u << level);
  return std::abs(std::log(size * size / area));
}

struct cone {
  node_id leaf;
  float distance, solid_angle;
};

struct level_of_cone {
  octree_view tree;
  WFPG_HD std::uint32_t operator()(const cone& c) const {
    return tree.level_for_cone(c.distance, c.solid_angle);
  }
};

WFPG_TEST_CASE("a cone reads the level whose face is nearest to its base", "[sparse_voxel_octree]") {
  const Exec exec;
  for (const std::uint32_t resolution : {1u, 2u, 128u, 1024u}) {
    const auto codes = random_codes(50, resolution, 3);
    auto fragments = make_fragments(exec, codes, resolution);
    const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
    const octree_view view = tree.view();
    random_numbers random(4);
    std::vector<cone> cones;
    for (int i = 0; i < 2000; ++i) {
      const float distance = std::pow(10.0f, random.between(-5.0f, 3.0f));
      const float solid_angle = std::pow(10.0f, random.between(-5.0f, 1.0f));
      cones.push_back({view.first_leaf() + random.below(view.leaf_count()), distance, solid_angle});
    }
    const auto levels = evaluate(exec, cones, level_of_cone{view});
    const auto nodes = evaluate(exec, cones, [=] WFPG_HD(const cone& c) {
      return view.node_for_cone(c.leaf, c.distance, c.solid_angle);
    });
    const std::vector<node_record> records = nodes_of(exec, view);
    for (std::size_t i = 0; i < cones.size(); ++i) {
      const auto& [leaf, distance, solid_angle] = cones[i];
      REQUIRE(levels[i] <= view.depth());
      double best = 1.0e30;
      for (std::uint32_t l = 0; l <= view.depth(); ++l)
        best = std::min(best, mismatch(view, l, double(distance) * distance * solid_angle));
      REQUIRE(mismatch(view, levels[i], double(distance) * distance * solid_angle) <= best + 1.0e-4);
      REQUIRE(nodes[i] == records[leaf].ancestor[levels[i]]);
    }
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto odd = evaluate(
        exec,
        std::vector<cone>{
            {0, 0.0f, 1.0f}, {0, 1.0f, 0.0f}, {0, 1.0e30f, 1.0f}, {0, 3.0e38f, 12.0f}, {0, nan, 1.0f}},
        level_of_cone{view});
    CHECK(odd[0] == view.depth());
    CHECK(odd[1] == view.depth());
    CHECK(odd[2] == 0);
    CHECK(odd[3] == 0);
    CHECK(odd[4] <= view.depth());
  }
}

struct finds_nothing {
  octree_view tree;
  vec3 point;
  WFPG_HD bool operator()() const {
    return tree.leaf_at(point) == invalid_node && tree.nearest_leaf(point) == invalid_node &&
           tree.leaf_at(uvec3(0u)) == invalid_node;
  }
};

WFPG_TEST_CASE("an empty scene is a valid octree", "[sparse_voxel_octree]") {
  const Exec exec;
  const auto check_empty = [](const wfpg::sparse_voxel_octree<Exec>& tree) {
    const octree_view view = tree.view();
    CHECK(view.empty());
    CHECK(tree.node_count() == 0);
    CHECK(tree.leaf_count() == 0);
    CHECK(tree.bytes() == 0);
    for (const vec3 p : {vec3(0.0f), vec3(0.5f), vec3(-7.0f)})
      CHECK(evaluate(Exec(), finds_nothing{view, p}));
    CHECK(view.level_for_cone(1.0f, 1.0f) <= view.depth());
  };
  check_empty(wfpg::sparse_voxel_octree<Exec>());
  for (const std::uint32_t resolution : {1u, 64u, 1024u}) {
    auto fragments = voxelized(exec, test_mesh(), resolution);
    check_empty(wfpg::sparse_voxel_octree<Exec>(exec, fragments));
  }
}

TEST_CASE("fragments of an invalid resolution are refused", "[sparse_voxel_octree]") {
  const one_policy exec;
  for (const std::uint32_t resolution : {0u, 3u, 8192u, 16384u}) {
    wfpg::voxel_fragments<one_policy> fragments;
    fragments.grid.resolution = resolution;
    using octree = wfpg::sparse_voxel_octree<one_policy>;
    CHECK_THROWS_AS(octree(exec, fragments), std::invalid_argument);
  }
}

WFPG_TEST_CASE("an octree of a mesh covers its surface", "[sparse_voxel_octree]") {
  const Exec exec;
  const test_mesh mesh = sphere_mesh(20, {5, 6, 7}, 2.0f);
  auto fragments = voxelized(exec, mesh, 64);
  const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
  check_nodes(exec, tree.view(), naive_octree(fragments.codes.to_host(exec), 64));
  random_numbers random(8);
  std::vector<vec3> points;
  for (int i = 0; i < 3000; ++i) {
    const std::size_t t = random.below(static_cast<std::uint32_t>(mesh.triangles.size()));
    const float u = random.unit(), v = random.unit() * (1.0f - u);
    const vec3 a = mesh.vertex(t, 0), b = mesh.vertex(t, 1), c = mesh.vertex(t, 2);
    points.push_back(a + u * (b - a) + v * (c - a));
  }
  const octree_view view = tree.view();
  const auto found = evaluate(exec, points, [=] WFPG_HD(vec3 p) { return view.nearest_leaf(p); });
  CHECK(std::count(found.begin(), found.end(), invalid_node) == 0);
}

/// Whether the node nearest to a point is an ancestor of its leaf, or holds it.
struct nearest_nodes_agree {
  octree_view tree;
  std::uint32_t level;
  WFPG_HD bool operator()(vec3 p) const {
    const wfpg::node_id node = tree.nearest_node(p, level), leaf = tree.leaf_at(p);
    if (leaf != invalid_node) return node == tree.ancestor(leaf, level);
    if (node != invalid_node) return tree.level_of(node) == level;
    return tree.nearest_leaf(p) == invalid_node;
  }
};

WFPG_TEST_CASE("the node of a level nearest to a point is that of its leaf", "[sparse_voxel_octree]") {
  const Exec exec;
  auto fragments = voxelized(exec, sphere_mesh(20, {5, 6, 7}, 2.0f), 64);
  const wfpg::sparse_voxel_octree<Exec> tree(exec, fragments);
  random_numbers random(9);
  std::vector<vec3> points{vec3(NAN), vec3(1e30f), vec3(-1e30f)};
  for (int i = 0; i < 3000; ++i)
    points.push_back(vec3(5, 6, 7) + (1.8f + 0.4f * random.unit()) * random.direction());
  for (std::uint32_t level = 0; level <= tree.view().depth(); ++level) {
    const auto agree = evaluate(exec, points, nearest_nodes_agree{tree.view(), level});
    INFO("level " << level);
    CHECK(std::count(agree.begin(), agree.end(), false) == 0);
  }
  // Empty voxels beside the surface have a node above.
  const octree_view view = tree.view();
  const auto leaves = evaluate(exec, points, [=] WFPG_HD(vec3 p) { return view.nearest_leaf(p); });
  const auto nodes = evaluate(exec, points, [=] WFPG_HD(vec3 p) { return view.nearest_node(p, 3); });
  const auto none_of = [](const std::vector<wfpg::node_id>& found) {
    return std::count(found.begin(), found.end(), invalid_node);
  };
  CHECK(none_of(nodes) + 100 < none_of(leaves));
}

}  // namespace
