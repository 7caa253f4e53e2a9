// Casts rays through a BVH, inside kernels of any policy. Nodes have four children with quantised boxes (64
// bytes). They follow Ylitie et al. 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
// BVHs". Triangles are in the order of the leaves.
//
// No ray passes between two triangles that share an edge or a corner. As in Woop et al. 2013, "Watertight
// Ray/Triangle Intersection", each corner is projected along the ray alone. Edges are then decided with exact
// signs. Boxes are enlarged by more than the rounding errors.
#pragma once

#include "casters/cut_outs.hpp"
#include "casters/warp_hints.hpp"
#include "scene/frame.hpp"

#include <wfpg/base/math.hpp>

#include <cmath>

namespace render {

/// A child of a node: another node, or up to seven consecutive triangles.
class bvh_child {
 public:
  bvh_child() = default;
  WFPG_HD explicit bvh_child(std::uint32_t word) : word_(word) {}
  WFPG_HD static bvh_child none() { return bvh_child(leaf_bit); }
  WFPG_HD static bvh_child node(std::uint32_t index) { return bvh_child(index); }
  WFPG_HD static bvh_child leaf(std::uint32_t first, std::uint32_t count) {
    return bvh_child(leaf_bit | count << count_shift | first);
  }
  static constexpr std::uint32_t largest_leaf = 7;
  static constexpr std::uint32_t most_triangles = 1u << 28;

  WFPG_HD bool is_leaf() const { return (word_ & leaf_bit) != 0; }
  WFPG_HD std::uint32_t word() const { return word_; }
  WFPG_HD std::uint32_t index() const { return word_; }
  WFPG_HD std::uint32_t first() const { return word_ & (most_triangles - 1); }
  WFPG_HD std::uint32_t count() const { return word_ >> count_shift & largest_leaf; }

 private:
  static constexpr std::uint32_t leaf_bit = 1u << 31;
  static constexpr std::uint32_t count_shift = 28;

  std::uint32_t word_;
};

/// Four children and their boxes. A box is 0 to 255 steps from an origin, a byte per child. Missing children
/// come last and have empty boxes.
struct alignas(16) bvh_node {
  static constexpr int width = 4;

  vec3 origin{0.0f};
  vec3 step{0.0f};
  std::uint32_t lower[3] = {~0u, ~0u, ~0u};
  std::uint32_t upper[3] = {0, 0, 0};
  bvh_child children[width] = {bvh_child::none(), bvh_child::none(), bvh_child::none(), bvh_child::none()};
};

/// A triangle of the BVH.
struct alignas(16) bvh_triangle {
  vec3 a;
  std::uint32_t index;  ///< in the scene
  vec3 b;
  float unused_b;
  vec3 c;
  float unused_c;
};

namespace detail {

/// a b - c d, exact enough for the right sign (Jeannerod et al. 2013, on Kahan's algorithm).
WFPG_HD inline float difference_of_products(float a, float b, float c, float d) {
  const float cd = c * d;
  const float error = std::fma(c, d, -cd);
  return std::fma(a, b, -cd) - error;
}

/// A ray prepared for boxes and triangles.
struct bvh_ray {
  vec3 origin;
  float t_min;
  vec3 direction;
  float t_max;  ///< of the nearest hit so far
  vec3 inverse;
  vec3 tangent, bitangent;
  std::uint32_t one;  ///< byte_float_base

  WFPG_HD bvh_ray(const wfpg::ray& ray, std::uint32_t one)
      : origin(ray.origin),
        t_min(glm::max(ray.t_min, 0.0f)),
        direction(ray.direction),
        t_max(ray.t_max),
        one(one) {
    inverse = {inverse_of(direction.x), inverse_of(direction.y), inverse_of(direction.z)};
    const frame axes(direction);
    tangent = axes.x;
    bitangent = axes.y;
  }

 private:
  // Finite for every direction, so that no slab's distance is NaN.
  WFPG_HD static float inverse_of(float x) { return 1.0f / (fabsf(x) > 1e-18f ? x : copysignf(1e-18f, x)); }
};

/// One axis of a node's boxes, in distances along a ray. The face of byte q is at q' slope + near or + far,
/// with q' = byte_float().
struct bvh_slabs {
  float slope, near, far;
  std::uint32_t one;
  std::uint32_t first, last;  ///< bytes of the faces that the ray enters and leaves by

  WFPG_HD bvh_slabs(const bvh_node& node, const bvh_ray& ray, int axis) {
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

/// The children of a node that a ray hits, nearest first. Each is its entry distance as bits of a float,
/// whose last two bits are the child's number. `none` follows the last.
struct bvh_entries {
  static constexpr std::uint32_t none = ~0u;
  std::uint32_t keys[bvh_node::width];

  WFPG_HD bvh_entries(const bvh_node& node, const bvh_ray& ray) {
    const bvh_slabs x(node, ray, 0), y(node, ray, 1), z(node, ray, 2);
    for (int i = 0; i < bvh_node::width; ++i) {
      const float entry = largest_of(x.entry(i), y.entry(i), z.entry(i), ray.t_min);
      const float exit = smallest_of(x.exit(i), y.exit(i), z.exit(i), ray.t_max);
      const std::uint32_t bits = wfpg::float_bits(entry);
      keys[i] = entry <= exit ? (bits & ~3u) | static_cast<std::uint32_t>(i) : none;
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

}  // namespace detail

/// Casts rays, from any kernel. Trivially copyable. Valid while its bvh_scene lives.
class bvh_caster {
 public:
  /// Children waiting on the stack: three per level.
  static constexpr std::uint32_t stack_size = 64;
  static constexpr std::uint32_t most_levels = stack_size / (bvh_node::width - 1);

  bvh_caster() = default;
  bvh_caster(const bvh_node* nodes, const bvh_triangle* triangles, const scene_view* cut_outs,
             const environment_view& environment)
      : nodes_(nodes), triangles_(triangles), cut_outs_(cut_outs), environment_(environment) {}

  /// The guider's interface: distance, or the environment's luminance.
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& ray) const {
    const hit found = nearest(ray);
    if (!found.triangle.is_hit()) return {-1.0f, wfpg::luminance(environment_.radiance(ray.direction))};
    return {found.distance, 0.0f};
  }

  WFPG_HD triangle_hit intersect(const wfpg::ray& ray) const { return nearest(ray).triangle; }

  /// Whether anything is hit inside (t_min, t_max).
  WFPG_HD bool occluded(const wfpg::ray& ray) const {
    return (cut_outs_ ? nearest(ray) : cast<true>(ray)).triangle.is_hit();
  }

 private:
  struct hit {
    triangle_hit triangle;
    float distance = 0.0f;
  };

  /// A child on the stack, and the bits of the ray's entry distance.
  struct waiting {
    std::uint32_t child, entry;
  };

  /// If fewer lanes are still descending, the lanes at leaves do not wait for them.
  static constexpr int least_company = 24;

  WFPG_HD hit nearest(const wfpg::ray& ray) const {
    return cast_through_cut_outs(cut_outs_, ray, [this](const wfpg::ray& r) { return cast<false>(r); });
  }

  /// The nearest hit, or any.
  template <bool Any>
  WFPG_HD hit cast(const wfpg::ray& asked) const {
    hit found;
    // An invalid ray would hit every box.
    if (!nodes_ || !wfpg::is_finite(asked.origin) || !wfpg::is_finite(asked.direction)) return found;
    detail::bvh_ray ray(asked, one_);
    waiting stack[stack_size];
    std::uint32_t depth = 0;
    bvh_child at = bvh_child::node(0);
    for (;;) {
      if (!at.is_leaf()) {
        do at = descend(at, ray, stack, depth);
        while (!at.is_leaf() && detail::lanes_here() >= least_company);
        if (!at.is_leaf()) continue;
      }
      const std::uint32_t end = at.first() + at.count();
      for (std::uint32_t i = at.first(); i < end; ++i)
        if (meet(bvh_triangle(triangles_[i]), ray, found) && Any) return found;
      do {
        if (depth == 0) return found;
        --depth;
      } while (wfpg::bits_float(stack[depth].entry) > ray.t_max);
      at = bvh_child(stack[depth].child);
    }
  }

  /// Returns the nearest child that the ray hits, and pushes the others onto the stack.
  WFPG_HD bvh_child descend(bvh_child at, const detail::bvh_ray& ray, waiting* stack,
                            std::uint32_t& depth) const {
    const bvh_node node = nodes_[at.index()];
    const detail::bvh_entries entries(node, ray);
    for (int i = bvh_node::width - 1; i > 0; --i) {
      const std::uint32_t key = entries.keys[i];
      if (key != detail::bvh_entries::none) stack[depth++] = {child_of(node, key).word(), key & ~3u};
    }
    return entries.keys[0] != detail::bvh_entries::none ? child_of(node, entries.keys[0]) : bvh_child::none();
  }

  // Indexing registers would put them into memory.
  WFPG_HD static bvh_child child_of(const bvh_node& node, std::uint32_t key) {
    const bvh_child even = key & 2u ? node.children[2] : node.children[0];
    const bvh_child odd = key & 2u ? node.children[3] : node.children[1];
    return key & 1u ? odd : even;
  }

  /// Whether the triangle is the nearest hit so far. If so, it becomes the hit.
  WFPG_HD static bool meet(const bvh_triangle& t, detail::bvh_ray& ray, hit& found) {
    const vec3 a = t.a - ray.origin, b = t.b - ray.origin, c = t.c - ray.origin;
    const vec2 pa = projected(a, ray), pb = projected(b, ray), pc = projected(c, ray);
    const float u = detail::difference_of_products(pc.x, pb.y, pc.y, pb.x);
    const float v = detail::difference_of_products(pa.x, pc.y, pa.y, pc.x);
    const float w = detail::difference_of_products(pb.x, pa.y, pb.y, pa.x);
    const float least = glm::min(u, glm::min(v, w)), largest = glm::max(u, glm::max(v, w));
    const float sum = u + v + w;
    if ((least < 0.0f && largest > 0.0f) || sum == 0.0f) return false;
    const float inverse = 1.0f / sum;
    const float distance =
        (u * glm::dot(a, ray.direction) + v * glm::dot(b, ray.direction) + w * glm::dot(c, ray.direction)) *
        inverse;
    if (!(distance > ray.t_min && distance < ray.t_max)) return false;
    ray.t_max = distance;
    found = {{t.index, v * inverse, w * inverse}, distance};
    return true;
  }

  WFPG_HD static vec2 projected(vec3 p, const detail::bvh_ray& ray) {
    return {along(p, ray.tangent), along(p, ray.bitangent)};
  }
  // Written out, so that compilers round a corner equally in each of its triangles.
  WFPG_HD static float along(vec3 p, vec3 axis) {
    return std::fma(p.x, axis.x, std::fma(p.y, axis.y, p.z * axis.z));
  }

  const bvh_node* nodes_ = nullptr;
  const bvh_triangle* triangles_ = nullptr;
  const scene_view* cut_outs_ = nullptr;
  environment_view environment_;
  std::uint32_t one_ = detail::byte_float_base;  // hides the value from compilers
};

}  // namespace render
