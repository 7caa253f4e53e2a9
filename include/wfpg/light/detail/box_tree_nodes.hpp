// Nodes of box_tree.hpp, and how rays and boxes meet them. Four children a node, with quantised boxes: 64
// bytes. They follow Ylitie et al. 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
// BVHs".
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>
#include <cstdint>

namespace wfpg::detail {

// --- GPU instructions that compilers do not choose by themselves, and plain C++ elsewhere ---

/// 1 + q / 2^15 for byte number `i` of a word, a float that needs no conversion. `one` is byte_float_base,
/// best from memory, so that the compiler does not know its value.
inline constexpr std::uint32_t byte_float_base = 0x3f800000u;
WFPG_HD inline float byte_float(std::uint32_t word, int i, std::uint32_t one) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(__byte_perm(word, one, 0x7604u | static_cast<unsigned>(i) << 4));
#else
  return bits_float((word >> (8 * i) & 0xffu) << 8 | one);
#endif
}

/// The largest of four floats, of which the last is not negative. Compares them as integers, which have the
/// same order except for negative floats.
WFPG_HD inline float largest_of(float a, float b, float c, float not_negative) {
#if defined(__CUDA_ARCH__)
  return fmaxf(__int_as_float(__vimax3_s32(__float_as_int(a), __float_as_int(b), __float_as_int(c))),
               not_negative);
#else
  return max(not_negative, max(max(a, b), c));  // fmaxf() would be a call
#endif
}

/// The smallest of four floats, or any negative one if there is one.
WFPG_HD inline float smallest_of(float a, float b, float c, float d) {
#if defined(__CUDA_ARCH__)
  return __int_as_float(
      min(__vimin3_s32(__float_as_int(a), __float_as_int(b), __float_as_int(c)), __float_as_int(d)));
#else
  return min(min(a, b), min(c, d));
#endif
}

/// The number of active lanes of the warp.
WFPG_HD inline int lanes_here() {
#if defined(__CUDA_ARCH__)
  return __popc(__activemask());
#else
  return 32;
#endif
}

/// Bit 7 of each byte: whether a's byte is at least b's. Other bits are 0.
WFPG_HD inline std::uint32_t bytes_at_least(std::uint32_t a, std::uint32_t b) {
  constexpr std::uint32_t high = 0x80808080u;
  const std::uint32_t low_bits = (a | high) - (b & ~high);  // bit 7: compares the lower seven bits
  return ((a & ~b) | (~(a ^ b) & low_bits)) & high;
}

// --- nodes ---

/// A child of a node: another node, or up to seven consecutive boxes in the tree's order.
class box_child {
 public:
  box_child() = default;
  WFPG_HD explicit box_child(std::uint32_t word) : word_(word) {}
  WFPG_HD static box_child none() { return box_child(leaf_bit); }
  WFPG_HD static box_child node(std::uint32_t index) { return box_child(index); }
  WFPG_HD static box_child leaf(std::uint32_t first, std::uint32_t count) {
    return box_child(leaf_bit | count << count_shift | first);
  }
  static constexpr std::uint32_t largest_leaf = 7;
  static constexpr std::uint32_t most_boxes = 1u << 28;

  WFPG_HD bool is_leaf() const { return (word_ & leaf_bit) != 0; }
  WFPG_HD std::uint32_t word() const { return word_; }
  WFPG_HD std::uint32_t index() const { return word_; }
  WFPG_HD std::uint32_t first() const { return word_ & (most_boxes - 1); }
  WFPG_HD std::uint32_t count() const { return word_ >> count_shift & largest_leaf; }

 private:
  static constexpr std::uint32_t leaf_bit = 1u << 31;
  static constexpr std::uint32_t count_shift = 28;

  std::uint32_t word_;
};

/// Four children and their boxes. A box is 0 to 255 steps from an origin, a byte per child. Missing children
/// come last and have empty boxes.
struct alignas(16) box_node {
  static constexpr int width = 4;

  vec3 origin{0.0f};
  vec3 step{0.0f};
  std::uint32_t lower[3] = {~0u, ~0u, ~0u};
  std::uint32_t upper[3] = {0, 0, 0};
  box_child children[width] = {box_child::none(), box_child::none(), box_child::none(), box_child::none()};

  // Indexing registers would put them into memory.
  WFPG_HD box_child child(std::uint32_t i) const {
    const box_child even = i & 2u ? children[2] : children[0];
    const box_child odd = i & 2u ? children[3] : children[1];
    return i & 1u ? odd : even;
  }
};

/// Children waiting on a traversal's stack: three a level, and one of the last.
struct box_stack {
  static constexpr std::uint32_t size = 64;
  static constexpr std::uint32_t most_levels = size / (box_node::width - 1);
};

// --- rays ---

/// A ray that visits the boxes that it crosses, nearest first.
struct box_ray {
  /// A child on the stack, and the bits of the ray's entry distance.
  struct waiting {
    std::uint32_t child, entry;
  };

  vec3 origin;
  float t_min;
  float t_max;  ///< boxes beyond it are left out
  vec3 inverse;
  std::uint32_t one;  ///< byte_float_base

  WFPG_HD box_ray(const ray& given, std::uint32_t base)
      : origin(given.origin), t_min(max(0.0f, given.t_min)), t_max(given.t_max), one(base) {
    inverse = {inverse_of(given.direction.x), inverse_of(given.direction.y), inverse_of(given.direction.z)};
  }

  /// Returns the nearest child that the ray crosses, and pushes the others onto the stack.
  WFPG_HD box_child descend(const box_node& node, waiting* stack, std::uint32_t& depth) const;
  /// Whether a child that has waited is still near enough.
  WFPG_HD bool wants(const waiting& child) const { return !(bits_float(child.entry) > t_max); }
  WFPG_HD static box_child child_of(const waiting& child) { return box_child(child.child); }

 private:
  // Finite for every direction, so that no slab's distance is NaN.
  WFPG_HD static float inverse_of(float x) { return 1.0f / (fabsf(x) > 1e-18f ? x : copysignf(1e-18f, x)); }
};

/// One axis of a node's boxes, in distances along a ray. The face of byte q is at q' slope + near or + far,
/// with q' = byte_float().
struct box_slabs {
  float slope, near, far;
  std::uint32_t one;
  std::uint32_t first, last;  ///< bytes of the faces that the ray enters and leaves by

  WFPG_HD box_slabs(const box_node& node, const box_ray& ray, int axis) {
    one = ray.one;
    const float inverse = ray.inverse[axis];
    const float distance = (node.origin[axis] - ray.origin[axis]) * inverse;
    slope = node.step[axis] * inverse * 0x1p15f;
    // Covers the subtraction, the product and the inverse. The rest is below the boxes' own margin.
    const float error = fabsf(distance) * 0x1p-21f;
    near = distance - slope - error;
    far = distance - slope + error;
    const bool ascending = inverse >= 0.0f;
    first = ascending ? node.lower[axis] : node.upper[axis];
    last = ascending ? node.upper[axis] : node.lower[axis];
  }
  WFPG_HD float entry(int child) const { return byte_float(first, child, one) * slope + near; }
  WFPG_HD float exit(int child) const { return byte_float(last, child, one) * slope + far; }
};

/// Where a ray crosses a node's children: those that it enters before it leaves them.
struct box_crossings {
  box_slabs x, y, z;
  float t_min, t_max;

  WFPG_HD box_crossings(const box_node& node, const box_ray& ray)
      : x(node, ray, 0), y(node, ray, 1), z(node, ray, 2), t_min(ray.t_min), t_max(ray.t_max) {}
  WFPG_HD float entry(int child) const {
    return largest_of(x.entry(child), y.entry(child), z.entry(child), t_min);
  }
  WFPG_HD float exit(int child) const {
    return smallest_of(x.exit(child), y.exit(child), z.exit(child), t_max);
  }
};

/// The children of a node that a ray crosses, nearest first. Each is its entry distance as bits of a float,
/// whose last two bits are the child's number. `none` follows the last.
struct box_entries {
  static constexpr std::uint32_t none = ~0u;
  std::uint32_t keys[box_node::width];

  WFPG_HD box_entries(const box_node& node, const box_ray& ray) {
    const box_crossings crossings(node, ray);
    for (int i = 0; i < box_node::width; ++i) {
      const float entry = crossings.entry(i);
      keys[i] = entry <= crossings.exit(i) ? (float_bits(entry) & ~3u) | static_cast<std::uint32_t>(i) : none;
    }
    order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
  }

 private:
  WFPG_HD void order(int i, int j) {
    const std::uint32_t a = keys[i], b = keys[j];
    keys[i] = a < b ? a : b;
    keys[j] = a < b ? b : a;
  }
};

WFPG_HD inline box_child box_ray::descend(const box_node& node, waiting* stack, std::uint32_t& depth) const {
  const box_entries entries(node, *this);
  for (int i = box_node::width - 1; i > 0; --i) {
    const std::uint32_t key = entries.keys[i];
    if (key != box_entries::none) stack[depth++] = {node.child(key).word(), key & ~3u};
  }
  return entries.keys[0] != box_entries::none ? node.child(entries.keys[0]) : box_child::none();
}

// --- queries that visit all ---

/// Returns the first child of those to visit, and pushes the others onto the stack. `children`: bit 7 of each
/// one's byte.
WFPG_HD inline box_child first_of(const box_node& node, std::uint32_t children, std::uint32_t* stack,
                                  std::uint32_t& depth) {
  box_child first = box_child::none();
  for (std::uint32_t i = box_node::width; i-- > 0; children <<= 8) {
    if ((children & 0x80000000u) == 0) continue;
    // The last one found is the first: it is returned, and those before it wait.
    if (first.word() != box_child::none().word()) stack[depth++] = first.word();
    first = node.child(i);
  }
  return first;
}

/// A ray that visits all boxes that it crosses, in the tree's order.
struct box_line {
  using waiting = std::uint32_t;  ///< a child on the stack

  box_ray along;

  /// Returns the first child that the ray crosses, and pushes the others onto the stack.
  WFPG_HD box_child descend(const box_node& node, waiting* stack, std::uint32_t& depth) const {
    const box_crossings crossings(node, along);
    std::uint32_t children = 0;
    for (int i = 0; i < box_node::width; ++i)
      if (crossings.entry(i) <= crossings.exit(i)) children |= 0x80u << 8 * i;
    return first_of(node, children, stack, depth);
  }
  WFPG_HD bool wants(waiting) const { return true; }
  WFPG_HD static box_child child_of(waiting child) { return box_child(child); }
};

/// A box that visits the boxes that it overlaps, in the tree's order. A point is a box of one point.
struct box_query {
  using waiting = std::uint32_t;  ///< a child on the stack

  bounds3 box;

  /// Returns the first child that the box overlaps, and pushes the others onto the stack.
  WFPG_HD box_child descend(const box_node& node, waiting* stack, std::uint32_t& depth) const {
    return first_of(node, overlapped(node), stack, depth);
  }
  WFPG_HD bool wants(waiting) const { return true; }
  WFPG_HD static box_child child_of(waiting child) { return box_child(child); }

 private:
  /// Bit 7 of each child's byte: whether the box overlaps it.
  WFPG_HD std::uint32_t overlapped(const box_node& node) const {
    std::uint32_t found = 0x80808080u;
    for (int axis = 0; axis < 3; ++axis) {
      const float steps = 1.0f / node.step[axis];
      const float first = (box.lower[axis] - node.origin[axis]) * steps;
      const float last = (box.upper[axis] - node.origin[axis]) * steps;
      // Children's faces are whole steps, so their comparison needs no fraction.
      found &=
          bytes_at_least(four_of(last), node.lower[axis]) & ~bytes_at_least(four_of(first), node.upper[axis]);
      if (last < 0.0f) found = 0;
    }
    return found;
  }
  /// A number of steps, cut to a byte, in each byte.
  WFPG_HD static std::uint32_t four_of(float steps) {
    return static_cast<std::uint32_t>(min(max(steps, 0.0f), 255.0f)) * 0x01010101u;
  }
};

// --- traversals ---

/// A traversal that stops at each leaf. `Query`: box_ray, box_line or box_query.
template <class Query>
class box_walk {
 public:
  /// Begins at the root of a tree of `size` boxes.
  WFPG_HD box_walk(const box_node* nodes, std::uint32_t size)
      : nodes_(nodes), at_(size > 0 ? box_child::node(0) : box_child::none()) {}

  /// Moves on towards the next leaf. Returns false after the last one.
  WFPG_HD bool next(const Query& query) {
    if (at_.is_leaf()) {
      do {
        if (depth_ == 0) return false;
        --depth_;
      } while (!query.wants(stack_[depth_]));
      at_ = query.child_of(stack_[depth_]);
    }
    while (!at_.is_leaf()) {
      at_ = query.descend(box_node(nodes_[at_.index()]), stack_, depth_);
      if (lanes_here() < least_company) break;
    }
    return true;
  }
  /// Where it has come to: a leaf, or a node while lanes of its warp are at leaves. A node has a count of 0.
  WFPG_HD box_child leaf() const { return at_; }

 private:
  // If fewer lanes are still descending, the lanes at leaves do not wait for them.
  static constexpr int least_company = 24;

  const box_node* nodes_;
  box_child at_;
  std::uint32_t depth_ = 0;
  typename Query::waiting stack_[box_stack::size];
};

}  // namespace wfpg::detail
