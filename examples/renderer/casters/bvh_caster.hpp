// Casts rays through a BVH, inside kernels of any policy. The BVH is a box_tree over the triangles' boxes.
// Triangles are in its order.
//
// No ray passes between two triangles that share an edge or a corner. As in Woop et al. 2013, "Watertight
// Ray/Triangle Intersection", each corner is projected along the ray alone. Edges are then decided with exact
// signs. The tree's boxes are enlarged by more than the rounding errors.
#pragma once

#include "casters/cut_outs.hpp"
#include "scene/frame.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/light/box_tree.hpp>

#include <cmath>

namespace render {

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

/// A ray prepared for triangles.
struct projecting_ray {
  vec3 origin;
  float t_min;
  vec3 direction;
  vec3 tangent, bitangent;

  WFPG_HD explicit projecting_ray(const wfpg::ray& ray)
      : origin(ray.origin), t_min(wfpg::max(0.0f, ray.t_min)), direction(ray.direction) {
    const frame axes(direction);
    tangent = axes.x;
    bitangent = axes.y;
  }
};

}  // namespace detail

/// Casts rays, from any kernel. Trivially copyable. Valid while its bvh_scene lives.
class bvh_caster {
 public:
  bvh_caster() = default;
  bvh_caster(const wfpg::box_tree_view& tree, const bvh_triangle* triangles, const scene_view* cut_outs,
             const environment_view& environment)
      : tree_(tree), triangles_(triangles), cut_outs_(cut_outs), environment_(environment) {}

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

  WFPG_HD hit nearest(const wfpg::ray& ray) const {
    return cast_through_cut_outs(cut_outs_, ray, [this](const wfpg::ray& r) { return cast<false>(r); });
  }

  /// The nearest hit, or any.
  template <bool Any>
  WFPG_HD hit cast(const wfpg::ray& asked) const {
    hit found;
    const detail::projecting_ray ray(asked);
    tree_.nearest_first(asked, [&](std::uint32_t place, float& t_max) {
      return meet(bvh_triangle(triangles_[place]), ray, t_max, found) && Any;
    });
    return found;
  }

  /// Whether the triangle is the nearest hit so far. If so, it becomes the hit.
  WFPG_HD static bool meet(const bvh_triangle& t, const detail::projecting_ray& ray, float& t_max,
                           hit& found) {
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
    if (!(distance > ray.t_min && distance < t_max)) return false;
    t_max = distance;
    found = {{t.index, v * inverse, w * inverse}, distance};
    return true;
  }

  WFPG_HD static vec2 projected(vec3 p, const detail::projecting_ray& ray) {
    return {along(p, ray.tangent), along(p, ray.bitangent)};
  }
  // Written out, so that compilers round a corner equally in each of its triangles.
  WFPG_HD static float along(vec3 p, vec3 axis) {
    return std::fma(p.x, axis.x, std::fma(p.y, axis.y, p.z * axis.z));
  }

  wfpg::box_tree_view tree_;
  const bvh_triangle* triangles_ = nullptr;
  const scene_view* cut_outs_ = nullptr;
  environment_view environment_;
};

}  // namespace render
