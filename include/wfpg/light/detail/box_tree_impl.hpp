// Implementation of box_tree.hpp: how a tree is built.
#pragma once

#include <wfpg/base/morton.hpp>
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
  std::uint32_t level_count = 0;

  /// The box around all of them.
  WFPG_HD const bounds3& whole() const { return levels[level_count - 1][0]; }
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

/// Sorted boxes [first, end).
struct box_range {
  std::uint32_t first = 0, end = 0;
  WFPG_HD std::uint32_t size() const { return end - first; }
};

/// Splits ranges at the highest bit that differs between keys, or in the middle.
struct box_splitter {
  array_view<const std::uint64_t> keys;
  range_boxes boxes;
  bool balanced;  ///< always in the middle

  /// The first box of the second part. Precondition: two or more boxes.
  WFPG_HD std::uint32_t split(box_range range) const {
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

/// Makes the nodes of one level from their ranges. Counts children that are nodes; they get their number
/// later. Called for as many as there may be.
struct make_box_nodes {
  box_splitter splitter;
  std::uint32_t leaf_boxes;
  const box_range* ranges;
  const box_levels::level* level;
  box_node* nodes;          ///< of all levels
  box_range* child_ranges;  ///< four per node; empty for children that are not nodes
  std::uint32_t* child_nodes;

  WFPG_HD void operator()(std::size_t i) const {
    child_nodes[i] = 0;
    if (i >= level->count) return;
    parts made;
    made.add(ranges[i], splitter.boxes);
    while (made.count < box_node::width && expand(made)) {
    }
    box_node node = quantised(made);
    for (int child = 0; child < box_node::width; ++child) {
      const box_range range = child < made.count ? made.ranges[child] : box_range{};
      const bool is_leaf = range.size() <= leaf_boxes;
      if (is_leaf && range.size() > 0) node.children[child] = box_child::leaf(range.first, range.size());
      child_ranges[i * box_node::width + static_cast<std::size_t>(child)] = is_leaf ? box_range{} : range;
      child_nodes[i] += is_leaf ? 0 : 1;
    }
    nodes[level->first + i] = node;
  }

 private:
  /// A node's children while it is split.
  struct parts {
    box_range ranges[box_node::width];
    bounds3 boxes[box_node::width];
    int count = 0;

    WFPG_HD void add(box_range range, const range_boxes& all) {
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
    const box_range range = made.ranges[chosen];
    const std::uint32_t at = splitter.split(range);
    made.ranges[chosen] = {range.first, at};
    made.boxes[chosen] = splitter.boxes.box(range.first, at);
    made.add({at, range.end}, splitter.boxes);
    return true;
  }

  /// Adds a margin of an eighth of a step on every side.
  WFPG_HD box_node quantised(const parts& made) const {
    // Rays along an axis drift by 1e-18 of their length. Flat boxes are thick enough for it.
    const float least_step = max(largest_of(splitter.boxes.whole()) * 0x1p-40f, 1e-30f);
    bounds3 whole;
    for (int i = 0; i < made.count; ++i) whole = bounds_union()(whole, made.boxes[i]);
    box_node node;
    for (int axis = 0; axis < 3; ++axis) {
      const float low = whole.lower[axis], high = whole.upper[axis];
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

/// Numbers the children of a level's nodes, and sets the next level and its ranges.
struct number_children {
  const box_range* child_ranges;
  const std::uint32_t* prefix;  ///< child nodes of the nodes up to this one
  const box_levels::level* level;
  box_levels::level* next_level;
  box_node* nodes;  ///< of all levels
  box_range* next_ranges;

  WFPG_HD void operator()(std::size_t i) const {
    const box_levels::level here = *level;
    const std::uint32_t after = here.first + here.count;
    std::uint32_t next = i > 0 ? prefix[i - 1] : 0;
    if (i + 1 == here.count) *next_level = {after, prefix[i]};
    box_node& node = nodes[here.first + i];
    for (int child = 0; child < box_node::width; ++child) {
      const box_range range = child_ranges[i * box_node::width + static_cast<std::size_t>(child)];
      if (range.size() == 0) continue;
      node.children[child] = box_child::node(after + next);
      next_ranges[next++] = range;
    }
  }
};

/// Nodes of n boxes at most: all but those around two or three boxes have four children.
constexpr std::size_t most_box_nodes(std::size_t n) {
  return n > 1 ? (2 * n - 1) / 3 : n;
}

/// Makes the levels of range_boxes above the first, which `boxes` begins with.
template <class Exec>
range_boxes pair_up(const Exec& exec, bounds3* boxes, std::uint32_t n) {
  range_boxes ranges;
  bounds3* level = boxes;
  for (std::uint32_t size = n;; size = (size + 1) / 2) {
    if (ranges.level_count > 0)
      exec.for_each(size, pair_boxes{ranges.levels[ranges.level_count - 1],
                                     ranges.sizes[ranges.level_count - 1], level});
    ranges.levels[ranges.level_count] = level;
    ranges.sizes[ranges.level_count++] = size;
    level += size;
    if (size == 1) return ranges;
  }
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
  buffer<bounds3, Exec> given(exec, n);
  exec.for_each(n, detail::write_box<Boxes>{boxes, given.data()});
  const std::uint32_t used = take_valid(exec, given.view());
  if (used > 0) {
    const buffer<std::uint64_t, Exec> keys(exec, used);
    sort(exec, given.view(), used, keys.data());
    const buffer<bounds3, Exec> ordered(exec, 2 * std::size_t(used) + detail::range_boxes::most_levels);
    exec.for_each(used, detail::order_boxes{given.data(), order_.data(), ordered.data()});
    given = buffer<bounds3, Exec>();
    detail::box_splitter splitter{keys.view(), detail::pair_up(exec, ordered.data(), used), false};
    if (!build_nodes(exec, splitter, leaf_boxes)) {
      splitter.balanced = true;
      build_nodes(exec, splitter, leaf_boxes);
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
bool box_tree<Exec>::build_nodes(const Exec& exec, const detail::box_splitter& splitter,
                                 std::uint32_t leaf_boxes) {
  using detail::box_levels;
  const auto n = static_cast<std::uint32_t>(splitter.keys.size());
  const buffer<detail::box_node, Exec> nodes(exec, detail::most_box_nodes(n));
  box_levels known = box_levels::with_root();
  const buffer<box_levels, Exec> levels(exec, {known});
  buffer<detail::box_range, Exec> ranges(exec, {detail::box_range{0, n}});
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
    const box_levels::level* here = levels.data()->levels + level;
    const buffer<detail::box_range, Exec> child_ranges(exec, most * detail::box_node::width);
    const buffer<std::uint32_t, Exec> prefix(exec, most);
    exec.for_each(most, detail::make_box_nodes{splitter, leaf_boxes, ranges.data(), here, nodes.data(),
                                               child_ranges.data(), prefix.data()});
    ::thrust::inclusive_scan(exec.thrust(), prefix.data(), prefix.data() + most, prefix.data());
    const exec::device_count count{&here->count, most};
    most = std::min(most * detail::box_node::width, most_in_level);
    ranges = buffer<detail::box_range, Exec>(exec, most);
    exec.for_each(count,
                  detail::number_children{child_ranges.data(), prefix.data(), here,
                                          levels.data()->levels + level + 1, nodes.data(), ranges.data()});
  }
  const std::uint32_t made = known.nodes();
  if (nodes_.size() < made) nodes_ = buffer<detail::box_node, Exec>(exec, made);
  ::thrust::copy_n(exec.thrust(), nodes.data(), made, nodes_.data());
  node_count_ = made;
  return true;
}

}  // namespace wfpg
