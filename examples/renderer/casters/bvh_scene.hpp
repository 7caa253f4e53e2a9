// Builds the BVH of bvh_caster.hpp on any policy. Triangles are sorted by the Morton codes of their centroids
// and split where codes do. This follows Karras 2012, "Maximizing Parallelism in the Construction of BVHs,
// Octrees, and k-d Trees". From the root down each node splits its range of triangles, then the part with the
// largest surface, until it has four parts. The same scene gives the same BVH.
//
// Cost: one sort, and O(log n) box look-ups a node. Memory while it builds: 150 bytes a triangle.
#pragma once

#include "casters/bvh_caster.hpp"

#include <wfpg/base/morton.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <thrust/binary_search.h>
#include <thrust/copy.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/scan.h>
#include <thrust/sequence.h>
#include <thrust/sort.h>
#include <thrust/transform_reduce.h>

#include <vector>

namespace render {

struct bvh_options {
  std::uint32_t leaf_triangles = 1;  ///< most triangles of a leaf, in [1, 7]
};

namespace detail {

using wfpg::array_view;
using wfpg::bounds3;

WFPG_HD inline bounds3 box_around(vec3 a, vec3 b, vec3 c) {
  return {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
}
WFPG_HD inline bounds3 box_around(const bounds3& a, const bounds3& b) {
  return {glm::min(a.lower, b.lower), glm::max(a.upper, b.upper)};
}
WFPG_HD inline float half_area(const bounds3& box) {
  const vec3 e = box.extent();
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

/// A mesh's triangles. The BVH leaves out those that no ray can hit.
struct bvh_mesh {
  wfpg::triangle_mesh_view mesh;

  WFPG_HD vec3 corner(std::size_t triangle, int i) const {
    return mesh.positions[mesh.triangles[triangle][i]];
  }

  WFPG_HD bool is_usable(std::size_t triangle) const {
    const uvec3 corners = mesh.triangles[triangle];
    const std::size_t n = mesh.positions.size();
    if (corners.x >= n || corners.y >= n || corners.z >= n) return false;
    const vec3 a = mesh.positions[corners.x], b = mesh.positions[corners.y], c = mesh.positions[corners.z];
    if (!wfpg::is_valid_position(a) || !wfpg::is_valid_position(b) || !wfpg::is_valid_position(c))
      return false;
    const vec3 u = b - a, v = c - a;
    return difference_of_products(u.y, v.z, u.z, v.y) != 0.0f ||
           difference_of_products(u.z, v.x, u.x, v.z) != 0.0f ||
           difference_of_products(u.x, v.y, u.y, v.x) != 0.0f;
  }
  WFPG_HD bounds3 box(std::size_t triangle) const {
    return box_around(corner(triangle, 0), corner(triangle, 1), corner(triangle, 2));
  }
  /// The box that contains only the triangle's centre.
  WFPG_HD bounds3 operator()(std::size_t triangle) const {
    if (!is_usable(triangle)) return {};
    const vec3 centre = box(triangle).centre();
    return {centre, centre};
  }
};

struct box_union {
  WFPG_HD bounds3 operator()(const bounds3& a, const bounds3& b) const { return box_around(a, b); }
};

/// Keys for sorting. Skipped triangles have the largest key.
struct morton_keys {
  static constexpr std::uint64_t left_out = ~std::uint64_t(0);
  bvh_mesh mesh;
  bounds3 centres;
  array_view<std::uint64_t> keys;

  WFPG_HD void operator()(std::size_t i) const {
    keys[i] = mesh.is_usable(i) ? code(mesh.box(i).centre()) : left_out;
  }

 private:
  WFPG_HD wfpg::morton_code code(vec3 p) const {
    const vec3 e = centres.extent();
    const float side = glm::max(glm::max(e.x, e.y), glm::max(e.z, 1e-30f));
    const vec3 cell = glm::min((p - centres.lower) * (0x1p21f / side), vec3(0x1.fffffep20f));
    return wfpg::morton_encode(uvec3(cell));
  }
};

/// Writes the sorted triangles for the caster, and their boxes.
struct order_triangles {
  bvh_mesh mesh;
  array_view<const std::uint32_t> order;
  array_view<bvh_triangle> triangles;
  bounds3* boxes;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t t = order[i];
    triangles[i] = {mesh.corner(t, 0), t, mesh.corner(t, 1), 0.0f, mesh.corner(t, 2), 0.0f};
    boxes[i] = mesh.box(t);
  }
};

/// Boxes of ranges of the sorted triangles. Level k has the boxes of 2^k triangles each.
struct range_boxes {
  static constexpr std::uint32_t most_levels = 29;
  bounds3* levels[most_levels];
  std::uint32_t sizes[most_levels];
  std::uint32_t level_count = 0;

  /// The box of triangles [first, end).
  WFPG_HD bounds3 box(std::uint32_t first, std::uint32_t end) const {
    bounds3 result;
    for (std::uint32_t level = 0; first < end; ++level) {
      if (first & 1u) result = box_around(result, levels[level][first++]);
      if (end & 1u) result = box_around(result, levels[level][--end]);
      first /= 2;
      end /= 2;
    }
    return result;
  }
};

struct pair_boxes {
  const bounds3* below;
  std::uint32_t count_below;
  bounds3* level;
  WFPG_HD void operator()(std::size_t i) const {
    const std::size_t second = 2 * i + 1;
    level[i] = second < count_below ? box_around(below[2 * i], below[second]) : below[2 * i];
  }
};

/// Sorted triangles [first, end).
struct bvh_range {
  std::uint32_t first = 0, end = 0;
  WFPG_HD std::uint32_t size() const { return end - first; }
};

/// Splits ranges at the highest bit that differs between keys, or in the middle.
struct bvh_splitter {
  array_view<const std::uint64_t> keys;
  range_boxes boxes;
  bool balanced;  ///< always in the middle

  /// The first triangle of the second part. Precondition: two or more triangles.
  WFPG_HD std::uint32_t split(bvh_range range) const {
    const std::uint64_t low = keys[range.first], high = keys[range.end - 1];
    if (balanced || low == high) return range.first + range.size() / 2;
    std::uint64_t changed = low ^ high;
    while (changed & (changed - 1)) changed &= changed - 1;
    std::uint32_t before = range.first, after = range.end - 1;
    while (after - before > 1) {
      const std::uint32_t middle = before + (after - before) / 2;
      (keys[middle] & changed ? after : before) = middle;
    }
    return after;
  }
};

/// Makes the nodes of one level from their ranges. Counts children that are nodes; they get their number
/// later.
struct make_nodes {
  bvh_splitter splitter;
  std::uint32_t leaf_triangles;
  const bvh_range* ranges;
  bvh_node* nodes;
  bvh_range* child_ranges;  ///< four per node; empty for children that are not nodes
  std::uint32_t* child_nodes;

  WFPG_HD void operator()(std::size_t i) const {
    parts made;
    made.add(ranges[i], splitter.boxes);
    while (made.count < bvh_node::width && expand(made)) {
    }
    nodes[i] = quantised(made);
    child_nodes[i] = 0;
    for (int child = 0; child < bvh_node::width; ++child) {
      const bvh_range range = child < made.count ? made.ranges[child] : bvh_range{};
      const bool is_leaf = range.size() <= leaf_triangles;
      if (is_leaf && range.size() > 0) nodes[i].children[child] = bvh_child::leaf(range.first, range.size());
      child_ranges[i * bvh_node::width + child] = is_leaf ? bvh_range{} : range;
      child_nodes[i] += is_leaf ? 0 : 1;
    }
  }

 private:
  /// A node's children while it is split.
  struct parts {
    bvh_range ranges[bvh_node::width];
    bounds3 boxes[bvh_node::width];
    int count = 0;

    WFPG_HD void add(bvh_range range, const range_boxes& all) {
      ranges[count] = range;
      boxes[count++] = all.box(range.first, range.end);
    }
  };

  /// Splits the largest part. False if none can be split.
  WFPG_HD bool expand(parts& made) const {
    int chosen = -1;
    float largest = -1.0f;
    for (int i = 0; i < made.count; ++i) {
      const std::uint32_t size = made.ranges[i].size();
      const float importance = splitter.balanced ? static_cast<float>(size) : half_area(made.boxes[i]);
      if (size < 2 || importance <= largest) continue;
      chosen = i;
      largest = importance;
    }
    if (chosen < 0) return false;
    const bvh_range range = made.ranges[chosen];
    const std::uint32_t at = splitter.split(range);
    made.ranges[chosen] = {range.first, at};
    made.boxes[chosen] = splitter.boxes.box(range.first, at);
    made.add({at, range.end}, splitter.boxes);
    return true;
  }

  /// Adds a margin of an eighth of a step on every side.
  WFPG_HD static bvh_node quantised(const parts& made) {
    bounds3 whole;
    for (int i = 0; i < made.count; ++i) whole = box_around(whole, made.boxes[i]);
    bvh_node node;
    for (int axis = 0; axis < 3; ++axis) {
      const float low = whole.lower[axis], high = whole.upper[axis];
      const float magnitude = fmaxf(fabsf(low), fabsf(high));
      const float step = fmaxf((high - low) / 253.0f, fmaxf(magnitude * 0x1p-18f, 1e-30f));
      node.step[axis] = step;
      node.origin[axis] = low - step;
      for (int i = 0; i < made.count; ++i) {
        const float first = std::floor((made.boxes[i].lower[axis] - node.origin[axis]) / step - 0.125f);
        const float last = std::ceil((made.boxes[i].upper[axis] - node.origin[axis]) / step + 0.125f);
        set_byte(node.lower[axis], i, first);
        set_byte(node.upper[axis], i, last);
      }
    }
    return node;
  }

  WFPG_HD static void set_byte(std::uint32_t& word, int i, float value) {
    const auto byte = static_cast<std::uint32_t>(glm::clamp(value, 0.0f, 255.0f));
    word = (word & ~(0xffu << (8 * i))) | byte << (8 * i);
  }
};

/// Numbers the children of a level's nodes, and sets the next level's ranges.
struct number_children {
  const bvh_range* child_ranges;
  const std::uint32_t* prefix;  ///< child nodes of the nodes up to this one
  std::uint32_t next_level;     ///< number of its first node
  bvh_node* nodes;
  bvh_range* next_ranges;

  WFPG_HD void operator()(std::size_t i) const {
    std::uint32_t next = i > 0 ? prefix[i - 1] : 0;
    for (int child = 0; child < bvh_node::width; ++child) {
      const bvh_range range = child_ranges[i * bvh_node::width + child];
      if (range.size() == 0) continue;
      nodes[i].children[child] = bvh_child::node(next_level + next);
      next_ranges[next++] = range;
    }
  }
};

}  // namespace detail

/// Owns the BVH over a mesh's triangles, in a policy's memory. Leaves out triangles without area, or with
/// vertices that are not finite or beyond 1e15. No ray hits them.
template <class Exec>
class bvh_scene {
 public:
  static constexpr const char* name = "bvh";

  /// `environment` is the luminance of rays that miss. Reads the mesh only here. Throws out_of_memory, and
  /// std::invalid_argument for options out of range or 2^28 triangles or more.
  bvh_scene(const Exec& exec, const wfpg::triangle_mesh_view& mesh, float environment,
            const bvh_options& options = {})
      : environment_(vec3(environment)) {
    using wfpg::require;
    require(options.leaf_triangles >= 1 && options.leaf_triangles <= bvh_child::largest_leaf,
            "leaf_triangles", options.leaf_triangles, "in [1, 7]");
    require(mesh.triangles.size() < bvh_child::most_triangles, "number of triangles", mesh.triangles.size(),
            "less than 2^28");
    if (!mesh.triangles.empty()) build(exec, {mesh}, options);
  }

  /// Over a scene whose arrays are already in the policy's memory.
  bvh_scene(const Exec& exec, const scene& host, const scene_view& arrays)
      : bvh_scene(exec, {arrays.positions, arrays.triangles}, 0.0f) {
    environment_ = arrays.environment;
    if (has_cut_outs(host)) cut_outs_ = wfpg::buffer<scene_view, Exec>(exec, std::vector<scene_view>{arrays});
  }

  bvh_caster caster() const { return {nodes_.data(), triangles_.data(), cut_outs_.data(), environment_}; }
  std::size_t bytes() const { return nodes_.bytes() + triangles_.bytes(); }
  std::size_t node_count() const { return nodes_.size(); }

 private:
  void build(const Exec& exec, const detail::bvh_mesh& mesh, const bvh_options& options) {
    const std::size_t all = mesh.mesh.triangles.size();
    wfpg::buffer<std::uint64_t, Exec> keys(exec, all);
    wfpg::buffer<std::uint32_t, Exec> order(exec, all);
    const ::thrust::counting_iterator<std::size_t> first(0);
    const wfpg::bounds3 centres = ::thrust::transform_reduce(exec.thrust(), first, first + all, mesh,
                                                             wfpg::bounds3{}, detail::box_union());
    exec.for_each(all, detail::morton_keys{mesh, centres, keys.view()});
    ::thrust::sequence(exec.thrust(), order.data(), order.data() + all);
    ::thrust::stable_sort_by_key(exec.thrust(), keys.data(), keys.data() + all, order.data());
    const auto n = static_cast<std::uint32_t>(
        ::thrust::lower_bound(exec.thrust(), keys.data(), keys.data() + all, detail::morton_keys::left_out) -
        keys.data());
    if (n == 0) return;

    wfpg::buffer<wfpg::bounds3, Exec> boxes(exec, 2 * std::size_t(n) + detail::range_boxes::most_levels);
    triangles_ = wfpg::buffer<bvh_triangle, Exec>(exec, n);
    exec.for_each(n, detail::order_triangles{mesh, order.view(), triangles_.view(), boxes.data()});
    detail::bvh_splitter splitter{{keys.data(), n}, pair_up(exec, boxes, n), false};
    if (build_nodes(exec, splitter, options)) return;
    splitter.balanced = true;
    build_nodes(exec, splitter, options);
  }

  static detail::range_boxes pair_up(const Exec& exec, const wfpg::buffer<wfpg::bounds3, Exec>& boxes,
                                     std::uint32_t n) {
    detail::range_boxes ranges;
    wfpg::bounds3* level = boxes.data();
    for (std::uint32_t size = n;; size = (size + 1) / 2) {
      if (ranges.level_count > 0)
        exec.for_each(size, detail::pair_boxes{ranges.levels[ranges.level_count - 1],
                                               ranges.sizes[ranges.level_count - 1], level});
      ranges.levels[ranges.level_count] = level;
      ranges.sizes[ranges.level_count++] = size;
      level += size;
      if (size == 1) return ranges;
    }
  }

  /// False if there are more levels than the caster's stack allows.
  bool build_nodes(const Exec& exec, const detail::bvh_splitter& splitter, const bvh_options& options) {
    const auto n = static_cast<std::uint32_t>(splitter.keys.size());
    const wfpg::buffer<bvh_node, Exec> nodes(exec, n);  // each splits its triangles
    wfpg::buffer<detail::bvh_range, Exec> ranges(exec, {detail::bvh_range{0, n}});
    std::uint32_t begin = 0, count = 1, levels = 0;
    for (; count > 0; ++levels) {
      if (levels == bvh_caster::most_levels) return false;
      const wfpg::buffer<detail::bvh_range, Exec> child_ranges(exec, std::size_t(count) * bvh_node::width);
      const wfpg::buffer<std::uint32_t, Exec> prefix(exec, count);
      exec.for_each(count, detail::make_nodes{splitter, options.leaf_triangles, ranges.data(),
                                              nodes.data() + begin, child_ranges.data(), prefix.data()});
      ::thrust::inclusive_scan(exec.thrust(), prefix.data(), prefix.data() + count, prefix.data());
      const std::uint32_t next = wfpg::read_element(exec, prefix.data() + count - 1);
      ranges = wfpg::buffer<detail::bvh_range, Exec>(exec, next);
      exec.for_each(count, detail::number_children{child_ranges.data(), prefix.data(), begin + count,
                                                   nodes.data() + begin, ranges.data()});
      begin += count;
      count = next;
    }
    nodes_ = wfpg::buffer<bvh_node, Exec>(exec, begin);
    ::thrust::copy_n(exec.thrust(), nodes.data(), begin, nodes_.data());
    return true;
  }

  wfpg::buffer<bvh_node, Exec> nodes_;
  wfpg::buffer<bvh_triangle, Exec> triangles_;
  wfpg::buffer<scene_view, Exec> cut_outs_;  // one, or none
  environment_view environment_;
};

}  // namespace render
