// Implementation of box_tree.hpp: how a tree is built.
#pragma once

#include <wfpg/base/morton.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/host/geometry.hpp>
#include <wfpg/light/box_tree.hpp>

#include <thrust/copy.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/scan.h>
#include <thrust/sort.h>
#include <thrust/transform_reduce.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace wfpg {
namespace detail {

WFPG_HD inline float half_area(const bounds3& box) {
  const vec3 e = box.extent();
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

/// Whether a tree takes a box: it is not empty, and its corners are valid positions.
WFPG_HD inline bool is_valid_box(const bounds3& box) {
  return is_valid_position(box.lower) && is_valid_position(box.upper) && !box.empty();
}

/// The boxes of a view, by index.
struct stored_boxes {
  array_view<const bounds3> boxes;
  WFPG_HD bounds3 operator()(std::size_t i) const { return boxes[i]; }
};

/// Writes the box of an index, or an empty one if it is skipped.
template <class Boxes>
struct write_box {
  Boxes boxes;
  bounds3* written;
  WFPG_HD void operator()(std::size_t i) const {
    const bounds3 box = boxes(i);
    written[i] = is_valid_box(box) ? box : bounds3{};
  }
};

/// The box of one point, the centre of a box. Empty if that is.
struct box_centre {
  WFPG_HD bounds3 operator()(const bounds3& box) const {
    return box.empty() ? bounds3{} : bounds3{box.centre(), box.centre()};
  }
};

/// Whether the box of an index is taken.
struct is_taken {
  const bounds3* boxes;
  WFPG_HD bool operator()(std::uint32_t index) const { return !boxes[index].empty(); }
};

/// Keys for sorting indices.
struct box_keys {
  const bounds3* boxes;
  const std::uint32_t* indices;
  bounds3 centres;
  std::uint64_t* keys;

  WFPG_HD void operator()(std::size_t i) const { keys[i] = code(boxes[indices[i]].centre()); }

 private:
  WFPG_HD morton_code code(vec3 p) const {
    const vec3 e = centres.extent();
    const float side = max(max(e.x, e.y), max(e.z, 1e-30f));
    const vec3 cell = glm::min((p - centres.lower) * (0x1p21f / side), vec3(0x1.fffffep20f));
    return morton_encode(uvec3(cell));
  }
};

/// Copies boxes in the order of their keys.
struct order_boxes {
  const bounds3* boxes;
  const std::uint32_t* order;
  bounds3* ordered;
  WFPG_HD void operator()(std::size_t i) const { ordered[i] = boxes[order[i]]; }
};

/// Boxes around ranges of the sorted boxes. Level k has those around 2^k boxes each.
struct range_boxes {
  static constexpr std::uint32_t most_levels = 29;
  bounds3* levels[most_levels];
  std::uint32_t sizes[most_levels];

  /// The box around boxes [first, end).
  WFPG_HD bounds3 box(std::uint32_t first, std::uint32_t end) const {
    const bounds_union join;
    bounds3 result;
    for (std::uint32_t level = 0; first < end; ++level) {
      if (first & 1u) result = join(result, levels[level][first++]);
      if (end & 1u) result = join(result, levels[level][--end]);
      first /= 2;
      end /= 2;
    }
    return result;
  }
};

/// Makes a level of range_boxes from the one below.
struct pair_boxes {
  const bounds3* below;
  std::uint32_t count_below;
  bounds3* level;
  WFPG_HD void operator()(std::size_t i) const {
    const std::size_t second = 2 * i + 1;
    level[i] = second < count_below ? bounds_union()(below[2 * i], below[second]) : below[2 * i];
  }
};

/// A node of the binary tree: two boxes or more, or the root.
struct alignas(16) binary_node {
  bounds3 box;           ///< around its boxes
  std::uint32_t other;   ///< its first or last box; the other one has the node's number
  std::uint32_t second;  ///< the first box of its second part
};

/// Makes the nodes of the binary tree, each on its own [Karras 2012, section 4]. Boxes are split at the
/// highest bit that differs between keys, or between places where keys are equal. Node 0 is the root.
struct make_binary_nodes {
  const std::uint64_t* keys;  ///< null: as if all were equal
  range_boxes boxes;
  binary_node* nodes;

  WFPG_HD void operator()(std::size_t node) const {
    // The node begins or ends at its own box, and goes on as long as boxes share more bits than those
    // outside.
    const auto here = static_cast<std::int32_t>(node);
    const int behind = shared_bits(here, here - 1), ahead = shared_bits(here, here + 1);
    const std::int32_t way = ahead > behind ? 1 : -1;
    const int outside = min(behind, ahead);
    std::int32_t beyond = 2;
    while (shared_bits(here, here + beyond * way) > outside) beyond *= 2;
    const std::int32_t other = last_sharing(here, way, beyond / 2, outside);
    const std::int32_t first = min(here, other), last = max(here, other);
    const std::int32_t before = last_sharing(first, 1, beyond / 2, shared_bits(first, last));
    const auto begin = static_cast<std::uint32_t>(first), end = static_cast<std::uint32_t>(last) + 1;
    nodes[node] = {boxes.box(begin, end), static_cast<std::uint32_t>(other),
                   static_cast<std::uint32_t>(before) + 1};
  }

 private:
  /// How many leading bits two boxes share. -1 where there is no second one.
  WFPG_HD int shared_bits(std::int32_t i, std::int32_t j) const {
    if (j < 0 || static_cast<std::uint32_t>(j) >= boxes.sizes[0]) return -1;
    const std::uint64_t differ = keys ? keys[i] ^ keys[j] : 0;
    return differ != 0 ? leading_zeros(differ) : 64 + leading_zeros(static_cast<std::uint64_t>(i ^ j));
  }
  /// The farthest box on the way that shares more than `bits` with box i. `step`: a power of two, and at
  /// least half as far.
  WFPG_HD std::int32_t last_sharing(std::int32_t i, std::int32_t way, std::int32_t step, int bits) const {
    std::int32_t last = i;
    for (; step > 0; step /= 2)
      if (shared_bits(i, last + step * way) > bits) last += step * way;
    return last;
  }
};

/// Sorted boxes [first, end), and the node of them if they are more than one.
struct box_range {
  std::uint32_t first = 0, end = 0;
  std::uint32_t node = 0;
  WFPG_HD std::uint32_t size() const { return end - first; }
};

/// The sorted boxes and their binary tree.
struct binary_tree {
  const bounds3* boxes;
  const binary_node* nodes;
  WFPG_HD const bounds3& box(box_range range) const {
    return range.size() == 1 ? boxes[range.first] : nodes[range.node].box;
  }
  WFPG_HD box_range range(std::uint32_t node) const {
    const std::uint32_t other = nodes[node].other;
    return {min(node, other), max(node, other) + 1, node};
  }
  /// The parts of a range. Each has the number of its box at the split.
  WFPG_HD box_range first_part(box_range range) const {
    const std::uint32_t second = nodes[range.node].second;
    return {range.first, second, second - 1};
  }
  WFPG_HD box_range second_part(box_range range) const {
    const std::uint32_t second = nodes[range.node].second;
    return {second, range.end, second};
  }
};

/// Where the nodes of each level are, which the level before it finds out. One that has none stays empty.
struct box_levels {
  struct level {
    std::uint32_t first, count;
  };
  level levels[box_stack::most_levels + 1];

  /// The root alone, whose children are not known.
  static box_levels with_root() {
    box_levels result{};
    result.levels[0].count = 1;
    return result;
  }
  /// The number of nodes of all levels.
  std::uint32_t nodes() const {
    std::uint32_t end = 0;
    for (const level& each : levels) end = std::max(end, each.first + each.count);
    return end;
  }
};

// A GPU's host waits as long for the number of a level's nodes as kernels take for tens of thousands that are
// not there. It asks for it where there may be more, and after every few levels, since it ends with an empty
// one.
constexpr std::size_t most_uncounted = std::size_t(1) << 16;
constexpr std::uint32_t uncounted_levels = 7;
static_assert(box_stack::most_levels % uncounted_levels == 0,
              "whether there are too many levels must be known");

/// Makes the nodes of one level from binary ones, and lists its children that are nodes for the next level.
/// Called for as many as there may be. The list's order may differ each time. A node's number does not depend
/// on it: in the order of binary nodes, once all are known.
struct make_box_nodes {
  binary_tree tree;
  bool balances;  ///< splits the part of most boxes first, not the largest one
  std::uint32_t leaf_boxes;
  box_levels::level* level;  ///< this one and the next
  std::uint32_t* listed;     ///< binary nodes, level by level
  box_node* nodes;           ///< as they are listed; children that are nodes have the binary node's number
  std::uint32_t* is_node;    ///< by binary node

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t after = level->first + level->count;
    if (i == 0) level[1].first = after;
    if (i >= level->count) return;
    const std::size_t place = level->first + i;
    is_node[listed[place]] = 1;
    parts made;
    made.add(tree.range(listed[place]), tree);
    while (made.count < box_node::width && expand(made)) {
    }
    box_node node = quantised(made, tree.nodes[listed[place]].box);
    std::uint32_t children = 0;
    for (int child = 0; child < made.count; ++child) {
      const box_range range = made.ranges[child];
      const bool is_leaf = range.size() <= leaf_boxes;
      node.children[child] =
          is_leaf ? box_child::leaf(range.first, range.size()) : box_child::node(range.node);
      children += is_leaf ? 0 : 1;
    }
    nodes[place] = node;
    if (children == 0) return;
    std::uint32_t next = after + atomic_add(&level[1].count, children);
    for (const box_child& child : node.children)
      if (!child.is_leaf()) listed[next++] = child.index();
  }

 private:
  /// A node's children while it is split.
  struct parts {
    box_range ranges[box_node::width];
    bounds3 boxes[box_node::width];
    int count = 0;

    WFPG_HD void set(int part, box_range range, const binary_tree& of) {
      ranges[part] = range;
      boxes[part] = of.box(range);
    }
    WFPG_HD void add(box_range range, const binary_tree& of) { set(count++, range, of); }
  };

  /// Splits the largest part. False if none can be split.
  WFPG_HD bool expand(parts& made) const {
    int chosen = -1;
    float largest = -1.0f;
    for (int i = 0; i < made.count; ++i) {
      const std::uint32_t size = made.ranges[i].size();
      const float importance = balances ? static_cast<float>(size) : half_area(made.boxes[i]);
      if (size < 2 || importance <= largest) continue;
      chosen = i;
      largest = importance;
    }
    if (chosen < 0) return false;
    const box_range range = made.ranges[chosen];
    made.set(chosen, tree.first_part(range), tree);
    made.add(tree.second_part(range), tree);
    return true;
  }

  /// Children's boxes, with a margin of an eighth of a step on every side. `around`: the box around them.
  WFPG_HD box_node quantised(const parts& made, const bounds3& around) const {
    // Rays along an axis drift by 1e-18 of their length. Flat boxes are thick enough for it.
    const float least_step = max(largest_of(tree.nodes[0].box) * 0x1p-40f, 1e-30f);
    box_node node;
    for (int axis = 0; axis < 3; ++axis) {
      const float low = around.lower[axis], high = around.upper[axis];
      const float magnitude = max(fabsf(low), fabsf(high));
      const float step = max((high - low) / 253.0f, max(magnitude * 0x1p-18f, least_step));
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

  /// The largest magnitude of a coordinate.
  WFPG_HD static float largest_of(const bounds3& box) {
    const vec3 largest = glm::max(glm::abs(box.lower), glm::abs(box.upper));
    return max(largest.x, max(largest.y, largest.z));
  }

  WFPG_HD static void set_byte(std::uint32_t& word, int i, float value) {
    const auto byte = static_cast<std::uint32_t>(clamp(value, 0.0f, 255.0f));
    word = (word & ~(0xffu << (8 * i))) | byte << (8 * i);
  }
};

/// Copies listed nodes to where their numbers say.
struct order_box_nodes {
  const std::uint32_t* listed;
  const box_node* nodes;
  const std::uint32_t* numbers;  ///< by binary node, from 1 on
  box_node* ordered;

  WFPG_HD void operator()(std::size_t i) const {
    box_node node = nodes[i];
    for (box_child& child : node.children)
      if (!child.is_leaf()) child = box_child::node(numbers[child.index()] - 1);
    ordered[numbers[listed[i]] - 1] = node;
  }
};

/// Nodes of n boxes at most: all but those around two or three boxes have four children.
constexpr std::size_t most_box_nodes(std::size_t n) {
  return n > 1 ? (2 * n - 1) / 3 : n;
}

/// Makes the levels of range_boxes: the first is given, and the others are written to `above`.
template <class Exec>
range_boxes pair_up(const Exec& exec, const buffer<bounds3, Exec>& boxes, bounds3* above) {
  range_boxes ranges;
  ranges.levels[0] = boxes.data();
  ranges.sizes[0] = static_cast<std::uint32_t>(boxes.size());
  std::uint32_t top = 0;
  for (; ranges.sizes[top] > 1; ++top) {
    const std::uint32_t size = (ranges.sizes[top] + 1) / 2;
    exec.for_each(size, pair_boxes{ranges.levels[top], ranges.sizes[top], above});
    ranges.levels[top + 1] = above;
    ranges.sizes[top + 1] = size;
    above += size;
  }
  return ranges;
}

/// Makes the binary tree's nodes. `keys`: sorted as the boxes are, or null to split at places alone.
/// `scratch`: of the boxes' size and range_boxes::most_levels more.
template <class Exec>
void make_binary(const Exec& exec, const buffer<bounds3, Exec>& boxes, const std::uint64_t* keys,
                 bounds3* scratch, binary_node* nodes) {
  const range_boxes ranges = pair_up(exec, boxes, scratch);
  exec.for_each(std::max<std::size_t>(boxes.size() - 1, 1), make_binary_nodes{keys, ranges, nodes});
}

}  // namespace detail

template <class Exec>
void box_tree<Exec>::build(const Exec& exec, array_view<const bounds3> boxes, std::uint32_t leaf_boxes) {
  build(exec, boxes.size(), detail::stored_boxes{boxes}, leaf_boxes);
}

template <class Exec>
template <class Boxes>
void box_tree<Exec>::build(const Exec& exec, std::size_t n, const Boxes& boxes, std::uint32_t leaf_boxes) {
  require(n < detail::box_child::most_boxes, "number of boxes", n, "less than 2^28");
  require(leaf_boxes >= 1 && leaf_boxes <= detail::box_child::largest_leaf, "leaf_boxes", leaf_boxes,
          "in [1, 7]");
  // Empty until all memory is there.
  node_count_ = size_ = skipped_ = 0;
  if (n == 0) return;
  const buffer<bounds3, Exec> given(exec, n + detail::range_boxes::most_levels);
  exec.for_each(n, detail::write_box<Boxes>{boxes, given.data()});
  const array_view<const bounds3> written(given.data(), n);
  const std::uint32_t used = take_valid(exec, written);
  if (used > 0) {
    buffer<std::uint64_t, Exec> keys(exec, used);
    sort(exec, written, used, keys.data());
    const buffer<bounds3, Exec> ordered(exec, used);
    exec.for_each(used, detail::order_boxes{given.data(), order_.data(), ordered.data()});
    const buffer<detail::binary_node, Exec> binary(exec, std::max(used - 1, 1u));
    detail::make_binary(exec, ordered, keys.data(), given.data(), binary.data());
    keys = buffer<std::uint64_t, Exec>();
    if (!build_nodes(exec, ordered, binary.data(), false, leaf_boxes)) {
      detail::make_binary(exec, ordered, nullptr, given.data(), binary.data());
      build_nodes(exec, ordered, binary.data(), true, leaf_boxes);
    }
  }
  size_ = used;
  skipped_ = static_cast<std::uint32_t>(n) - used;
}

template <class Exec>
std::uint32_t box_tree<Exec>::take_valid(const Exec& exec, array_view<const bounds3> boxes) {
  if (order_.size() < boxes.size()) order_ = buffer<std::uint32_t, Exec>(exec, boxes.size());
  const ::thrust::counting_iterator<std::uint32_t> all(0);
  const auto end = ::thrust::copy_if(exec.thrust(), all, all + static_cast<std::uint32_t>(boxes.size()),
                                     order_.data(), detail::is_taken{boxes.data()});
  return static_cast<std::uint32_t>(end - order_.data());
}

template <class Exec>
void box_tree<Exec>::sort(const Exec& exec, array_view<const bounds3> boxes, std::uint32_t used,
                          std::uint64_t* keys) {
  const bounds3 centres = ::thrust::transform_reduce(exec.thrust(), boxes.begin(), boxes.end(),
                                                     detail::box_centre(), bounds3{}, bounds_union());
  exec.for_each(used, detail::box_keys{boxes.data(), order_.data(), centres, keys});
  // Stable, so that boxes with one key keep their order on any policy.
  ::thrust::stable_sort_by_key(exec.thrust(), keys, keys + used, order_.data());
}

template <class Exec>
bool box_tree<Exec>::build_nodes(const Exec& exec, const buffer<bounds3, Exec>& boxes,
                                 const detail::binary_node* binary, bool balances, std::uint32_t leaf_boxes) {
  using detail::box_levels;
  const auto n = static_cast<std::uint32_t>(boxes.size());
  const detail::binary_tree tree{boxes.data(), binary};
  const buffer<detail::box_node, Exec> nodes(exec, detail::most_box_nodes(n));
  const buffer<std::uint32_t, Exec> listed(exec, nodes.size()), numbers(exec, n);
  exec.fill_bytes(listed.data(), 0, sizeof(std::uint32_t));  // the root
  exec.fill_bytes(numbers.data(), 0, numbers.bytes());
  box_levels known = box_levels::with_root();
  const buffer<box_levels, Exec> levels(exec, {known});
  // Below the first, a node has more boxes than a leaf.
  const std::size_t most_in_level = n / (leaf_boxes + 1);
  std::size_t most = 1;  // nodes of the level
  for (std::uint32_t level = 0;; ++level) {
    if (most > detail::most_uncounted || (level > 0 && level % detail::uncounted_levels == 0)) {
      known = read_element(exec, levels.data());
      most = known.levels[level].count;
    }
    if (most == 0) break;
    if (level == detail::box_stack::most_levels) return false;
    exec.for_each(most, detail::make_box_nodes{tree, balances, leaf_boxes, levels.data()->levels + level,
                                               listed.data(), nodes.data(), numbers.data()});
    most = std::min(most * detail::box_node::width, most_in_level);
  }
  ::thrust::inclusive_scan(exec.thrust(), numbers.data(), numbers.data() + n, numbers.data());
  const std::uint32_t made = known.nodes();
  if (nodes_.size() < made) nodes_ = buffer<detail::box_node, Exec>(exec, made);
  exec.for_each(made, detail::order_box_nodes{listed.data(), nodes.data(), numbers.data(), nodes_.data()});
  node_count_ = made;
  return true;
}

}  // namespace wfpg
