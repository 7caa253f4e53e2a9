// A tree over boxes, built anew for each iteration: which boxes hold a point, overlap a box, or are crossed
// by a ray. Photons and beams are found with it, and the renderer's triangles.
//
//   box_tree<Exec> tree;
//   tree.build(exec, n, boxes);                   // boxes(i) is the box with index i, in a kernel
//   const box_tree_view view = tree.view();       // for kernels
//   view.overlaps(point, [&](std::uint32_t i) { ... });
//
// Boxes are sorted by the Morton codes of their centres and split where codes do. Each node then has its
// range split, and the part with the largest surface, until it has four parts.
//
// Sources: Karras 2012, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees". Nodes
// are those of Ylitie et al. 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs".
// Cost: a build is one sort, and O(log n) looks at boxes a node. A query is O(log n + found) where boxes
// overlap little.
// Memory: 4 bytes a box and 64 a node, 34 a box in all. Boxes themselves are not kept.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/light/detail/box_tree_nodes.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

namespace detail {
struct binary_node;
}  // namespace detail

/// A tree as kernels see it. Trivially copyable, 24 bytes. Valid until its owner is built again or destroyed.
///
/// Queries find every box that they should, once each. They also find a few others: those in one leaf with
/// it, and those that are near. Boxes are quantised outwards, by at most 1% of their node's size. What must
/// be exact is to be tested in f, as it mostly is anyway: the distance of a photon, the crossing of a
/// triangle.
///
/// A box has an index, which the host gave it, and a place, its position in the tree's order. Boxes that are
/// found together have places next to each other. What f reads is best stored by place.
///
/// No query recurses. A stack has 64 entries of 4 bytes, or of 8 for rays, and no tree needs more.
class box_tree_view {
 public:
  /// A tree without boxes.
  box_tree_view() = default;
  /// For box_tree. Not for hosts.
  box_tree_view(const detail::box_node* nodes, const std::uint32_t* order, std::uint32_t size)
      : nodes_(nodes), order_(order), size_(size) {}

  /// Returns the number of boxes, without skipped ones. Places are below it.
  WFPG_HD std::uint32_t size() const { return size_; }
  /// Returns the index of the box at a place. Precondition: place < size().
  WFPG_HD std::uint32_t index(std::uint32_t place) const { return order_[place]; }

  /// Calls f(index) for each box that holds `point`, surfaces included. None holds a point that is not
  /// finite.
  template <class F>
  WFPG_HD void overlaps(vec3 point, const F& f) const {
    overlaps(bounds3{point, point}, f);
  }
  /// Calls f(index) for each box that has a point in common with `box`. An empty box, or one that is not
  /// finite, has none.
  template <class F>
  WFPG_HD void overlaps(const bounds3& box, const F& f) const {
    const auto all = [](std::uint32_t) { return true; };
    for_each_place(box, all, [&](std::uint32_t place) { f(order_[place]); });
  }
  /// Calls f(index) for each box that a ray crosses between t_min and t_max. Rays may begin inside a box.
  /// Nearer boxes tend to come first. Nothing is found where origin or direction is not finite.
  template <class F>
  WFPG_HD void overlaps(const ray& along, const F& f) const {
    nearest_first(along, [&](std::uint32_t place, float&) {
      f(order_[place]);
      return false;
    });
  }

  /// Calls f(place) for each box that has a point in common with `box`, and for which holds(place) is true.
  /// The order depends on the tree alone. Calls of f wait until up to 32 places were found, so that the lanes
  /// of a warp make them together. A long f thus takes less time on a GPU than if each lane called it at
  /// once.
  template <class Test, class F>
  WFPG_HD void for_each_place(const bounds3& box, const Test& holds, const F& f) const {
    if (is_query(box)) find_then_call(detail::box_query{box}, holds, f);
  }
  /// Likewise for each box that a ray crosses between t_min and t_max.
  template <class Test, class F>
  WFPG_HD void for_each_place_along(const ray& along, const Test& holds, const F& f) const {
    if (is_query(along)) find_then_call(detail::box_line{{along, one_}}, holds, f);
  }
  /// Calls f(place, t_max) for boxes that a ray crosses between t_min and t_max, nearer nodes first. f may
  /// lower t_max, a float&, to the distance of what it has found: boxes beyond are then left out. The search
  /// ends where f returns true.
  template <class F>
  WFPG_HD void nearest_first(const ray& along, const F& f) const {
    if (!is_query(along)) return;
    detail::box_ray query(along, one_);
    detail::box_walk<detail::box_ray> walk(nodes_, size_);
    while (walk.next(query)) {
      const std::uint32_t end = walk.leaf().first() + walk.leaf().count();
      for (std::uint32_t place = walk.leaf().first(); place < end; ++place)
        if (f(place, query.t_max)) return;
    }
  }

 private:
  // Places that wait for f. On an H200, 16 take a tenth more time for ten photons a query. Among clusters, 16
  // take a third more, and 24 a twentieth.
  static constexpr std::uint32_t most_waiting = 32;

  WFPG_HD static bool is_query(const bounds3& box) {
    return is_finite(box.lower) && is_finite(box.upper) && !box.empty();
  }
  // An invalid ray would cross every box.
  WFPG_HD static bool is_query(const ray& along) {
    return is_finite(along.origin) && is_finite(along.direction);
  }

  /// Finds the places in leaves that the query reaches for which `holds` is true, and then calls f for them.
  template <class Query, class Test, class F>
  WFPG_HD void find_then_call(const Query& query, const Test& holds, const F& f) const {
    detail::box_walk<Query> walk(nodes_, size_);
    std::uint32_t found[most_waiting];
    for (bool more = true; more;) {
      std::uint32_t n = 0;
      while (n + detail::box_child::largest_leaf <= most_waiting && (more = walk.next(query))) {
        const std::uint32_t end = walk.leaf().first() + walk.leaf().count();
        for (std::uint32_t place = walk.leaf().first(); place < end; ++place)
          if (holds(place)) found[n++] = place;
      }
      for (std::uint32_t i = 0; i < n; ++i) f(found[i]);
    }
  }

  const detail::box_node* nodes_ = nullptr;
  const std::uint32_t* order_ = nullptr;
  std::uint32_t size_ = 0;
  std::uint32_t one_ = detail::byte_float_base;  // hides the value from compilers
};

/// Owns a tree over boxes, in a policy's memory. Movable. Equal boxes give the same tree on every policy.
template <class Exec>
class box_tree {
 public:
  /// A tree without boxes or memory.
  box_tree() = default;

  /// Builds the tree over boxes 0 to n - 1. `boxes`: a functor that kernels call, boxes(i) is a bounds3. It
  /// is called once a box. Boxes without a point, or with coordinates that are not finite or beyond
  /// largest_coordinate, are skipped.
  ///
  /// `leaf_boxes`: most boxes of a leaf, in [1, 7], which queries find together. More take less memory: 34
  /// bytes a box with 1, 15 with 4, 11 with 7.
  ///
  /// Memory of the tree before is used again if it suffices. While it builds, a tree takes 164 bytes a box of
  /// the policy's memory, which a retaining_resource keeps for the next build. Waits for the policy's work.
  ///
  /// Throws out_of_memory, after which the tree has no boxes. Throws std::invalid_argument for 2^28 boxes or
  /// more, and for leaf_boxes out of range.
  template <class Boxes>
  void build(const Exec& exec, std::size_t n, const Boxes& boxes, std::uint32_t leaf_boxes = 1);
  /// Builds it over boxes in the policy's memory, which are not kept.
  void build(const Exec& exec, array_view<const bounds3> boxes, std::uint32_t leaf_boxes = 1);

  /// Returns the tree for kernels. O(1).
  box_tree_view view() const { return {nodes_.data(), order_.data(), size_}; }
  /// Returns how many boxes the last build left out.
  std::uint32_t skipped() const { return skipped_; }
  /// Returns the number of nodes, 64 bytes each.
  std::size_t node_count() const { return node_count_; }
  /// Returns the bytes held: those of the largest tree so far.
  std::size_t bytes() const { return nodes_.bytes() + order_.bytes(); }

 private:
  /// Sets the order to the indices of boxes that are not empty, and returns their number.
  std::uint32_t take_valid(const Exec& exec, array_view<const bounds3> boxes);
  /// Sorts the order, of `used` indices, by keys of their boxes.
  void sort(const Exec& exec, array_view<const bounds3> boxes, std::uint32_t used, std::uint64_t* keys);
  /// Makes nodes from sorted boxes and their binary tree. `balances`: by the numbers of boxes, not by
  /// surfaces. Returns false if there are more levels than the stack allows.
  bool build_nodes(const Exec& exec, const buffer<bounds3, Exec>& boxes, const detail::binary_node* binary,
                   bool balances, std::uint32_t leaf_boxes);

  buffer<detail::box_node, Exec> nodes_;
  buffer<std::uint32_t, Exec> order_;  // of places
  std::size_t node_count_ = 0;
  std::uint32_t size_ = 0, skipped_ = 0;
};

}  // namespace wfpg

#include <wfpg/light/detail/box_tree_impl.hpp>
