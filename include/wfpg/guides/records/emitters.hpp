// Rays from emitters, and what they leave in the voxels that they meet: what finds directly lit voxels, where
// the paper has reflective shadow maps (Jhang & Chang, section 2.2). Triangles are drawn by their power,
// directions by the cosine, so that each ray carries the same power, and sums are integers.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/guides/records/detail/voxel_light.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/triangle_voxel.hpp>

namespace wfpg {

/// A triangle that emits alike in all directions above its front: a, b, c counter-clockwise as seen from
/// there, world space.
struct emitting_triangle {
  vec3 a{0.0f};            ///< a corner
  vec3 b{0.0f};            ///< the next
  vec3 c{0.0f};            ///< the last
  float radiance = 0.0f;   ///< that it emits, luminance, W/(m² sr); one that emits nothing is passed over
  bool two_sided = false;  ///< it emits behind it, too
};

/// How light goes on at a surface.
struct smooth_bounce {
  bool goes_on = false;     ///< false: it does not; the surface is rough, and lit
  vec3 direction{0.0f};     ///< where it goes on, unit length
  float throughput = 1.0f;  ///< what is left of it, over the direction's probability; in [0, 1]
};

/// Light ends at every surface.
struct no_smooth_surfaces {
  /// It does not go on.
  WFPG_HD smooth_bounce operator()(std::uint32_t, const ray&, float, vec2) const { return {}; }
};

namespace detail {

/// A triangle's radiance times its area, on both sides; 0 of one that is not sound.
struct power_of_emitter {
  array_view<const emitting_triangle> emitters;
  WFPG_HD float operator()(std::size_t i) const {
    const emitting_triangle& e = emitters[i];
    const float sides = e.two_sided ? 2.0f : 1.0f;
    const float power = 0.5f * glm::length(glm::cross(e.b - e.a, e.c - e.a)) * e.radiance * sides;
    return is_finite(power) && power > 0.0f && e.radiance > 0.0f ? power : 0.0f;
  }
};

/// The same in integers: 2²⁴ is the greatest.
struct weigh_emitters {
  power_of_emitter power;
  float greatest;
  std::uint64_t* weights;
  WFPG_HD void operator()(std::size_t i) const {
    const float share = power(i) / greatest * 0x1p24f;
    weights[i] = share > 0.0f ? static_cast<std::uint64_t>(max(share, 1.0f)) : 0u;
  }
};

/// What emitters' rays are drawn from.
struct emitter_set {
  array_view<const emitting_triangle> emitters;
  array_view<const std::uint64_t> weights_through;
  std::uint64_t total = 0;       // of weights
  float power_of_weight = 0.0f;  // radiance times area of a weight of one

  bool empty() const { return total == 0; }
};

/// Light on its way: of a ray's power what is left, 2¹⁶ being all of it, and 0 where it has ended.
inline constexpr std::uint32_t whole_ray = 1u << 16;

/// Rays from `first` on of so many: stratified over the emitters' power.
struct emit_rays {
  emitter_set from;
  float off_surface;  // scene units
  std::uint64_t first, count, seed;
  ray* rays;
  std::uint32_t* powers;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t n = first + i, bits = hash(seed, n);
    const std::uint64_t place = hash(bits, 1) % from.total;
    // Where the n-th of `count` equal parts begins, and how far into it, without a product of 2⁶⁴ or more.
    const std::uint64_t part = from.total / count, left = from.total % count;
    const std::uint64_t target =
        min(n * part + n * left / count + place % max<std::uint64_t>(part, 1), from.total - 1);
    const emitting_triangle& e = from.emitters[find(target)];
    const vec2 u = unit_vec2(hash(bits, 2)), v = unit_vec2(hash(bits, 3));
    const float root = sqrtf(u.x);
    const vec3 point = e.a + root * ((e.b - e.a) * (1.0f - u.y) + (e.c - e.a) * u.y);
    vec3 normal = unit_normal(e.a, e.b, e.c);
    if (e.two_sided && (bits & 1u)) normal = -normal;
    rays[i].origin = point + normal * off_surface;
    rays[i].t_min = 0.0f;
    rays[i].direction = cosine_direction(normal, v);
    rays[i].t_max = 3.0e38f;
    powers[i] = whole_ray;
  }

 private:
  /// The first emitter whose weight and those before it exceed a number.
  WFPG_HD std::size_t find(std::uint64_t target) const {
    std::size_t low = 0, size = from.weights_through.size();
    while (size > 1) {
      const std::size_t half = size / 2;
      const bool above = from.weights_through[low + half - 1] > target;
      low += above ? 0 : half;
      size = above ? half : size - half;
    }
    return low;
  }
  WFPG_HD static vec3 cosine_direction(vec3 normal, vec2 u) {
    const float z = sqrtf(1.0f - u.x), r = sqrtf(u.x), turn = 4.0f * u.y;
    const vec2 p = r * quarter_turn(turn - floorf(turn));
    const auto quadrant = static_cast<int>(turn);
    const vec2 q = quadrant % 2 == 0 ? p : vec2(-p.y, p.x);
    return glm::normalize(frame(normal).to_world({quadrant < 2 ? q.x : -q.x, quadrant < 2 ? q.y : -q.y, z}));
  }
};

/// Rays at the surfaces that they meet: light goes on, or ends in a voxel.
template <class Smooth>
struct land_rays {
  Smooth smooth;
  sparse_voxel_octree_view tree;
  const std::uint16_t* normals;  // a node
  float off_surface;
  std::uint64_t seed;
  const ray_hit* hits;
  ray* rays;
  std::uint32_t* powers;
  leaf_light* light;
  std::uint32_t* on_their_way;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t power = powers[i];
    if (power == 0) return;
    ray& r = rays[i];
    const float distance = hits[i].distance;
    powers[i] = 0;
    const vec3 p = r.origin + distance * r.direction;
    if (hits[i].is_hit() && is_finite(p)) {
      const smooth_bounce bounce =
          smooth(static_cast<std::uint32_t>(i), r, distance, unit_vec2(hash(seed, i)));
      if (bounce.goes_on)
        powers[i] = go_on(r, p, bounce, power);
      else
        arrive(p, r.direction, power);
    }
    if (powers[i] > 0)
      atomic_add(on_their_way, 1);
    else
      r.t_max = 0.0f;  // it has ended, and is cast no more
  }

 private:
  WFPG_HD std::uint32_t go_on(ray& r, vec3 p, const smooth_bounce& bounce, std::uint32_t power) const {
    const float throughput = bounce.throughput;
    const bool sound = is_finite(throughput) && throughput > 0.0f && is_finite(bounce.direction);
    const std::uint32_t left =
        sound ? static_cast<std::uint32_t>(static_cast<float>(power) * min(throughput, 1.0f)) : 0u;
    const node_id leaf = tree.nearest_leaf(p);
    if (leaf != invalid_node && left > 0 && side(leaf, r.direction) == side(leaf, bounce.direction))
      atomic_add(&light[leaf - tree.first_leaf()].crossed, std::uint64_t(left));
    r.origin = p + off_surface * bounce.direction;
    r.direction = bounce.direction;
    return left;
  }
  WFPG_HD void arrive(vec3 p, vec3 direction, std::uint32_t power) const {
    const node_id leaf = tree.nearest_leaf(p);
    if (leaf == invalid_node) return;
    atomic_add(&light[leaf - tree.first_leaf()].arrived[side(leaf, -direction)], std::uint64_t(power));
  }
  WFPG_HD std::uint32_t side(node_id leaf, vec3 direction) const {
    return lit_nodes{nullptr, normals}.side_facing(leaf, direction);
  }
};

/// What emitters leave in the leaves that they lie in, a triangle a block.
struct emit_in_leaves {
  emitter_set from;
  sparse_voxel_octree_view tree;
  const std::uint16_t* normals;  // a node
  float unit;                    // radiance times faces that counts as one
  leaf_light* light;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    if (!(power_of_emitter{from.emitters}(i) > 0.0f)) return;
    const emitting_triangle& e = from.emitters[i];
    const voxel_grid& grid = tree.grid();
    const grid_triangle t{grid.to_grid(e.a), grid.to_grid(e.b), grid.to_grid(e.c)};
    const lit_nodes sides{nullptr, normals};
    const triangle_columns columns(t, grid.resolution, column_axis(t));
    const column_box box = columns.box();
    const vec3 normal = unit_normal(e.a, e.b, e.c);
    block.for_each(static_cast<int>(box.count()), [&](int i) {
      const glm::uvec2 column = box.column(static_cast<std::uint64_t>(i));
      const voxel_run run = columns.run(box, column);
      for (std::uint32_t along = run.first; along < run.first + run.count; ++along) {
        const uvec3 voxel = box.voxel(column, along);
        const node_id leaf = tree.leaf_at(voxel);
        const float area = area_inside(t.relative_to(vec3(voxel) + 0.5f));
        if (leaf == invalid_node || !(area > 0.0f)) continue;
        const auto power = static_cast<std::uint64_t>(ceilf(area * e.radiance / unit));
        const std::uint32_t side = sides.side_facing(leaf, normal);
        std::uint64_t* const emitted = light[leaf - tree.first_leaf()].emitted;
        atomic_add(emitted + side, power);
        if (e.two_sided) atomic_add(emitted + (side ^ 1u), power);
      }
    });
  }
};

/// The first n rays through a caster of either form.
template <class Exec, class Caster>
void cast_rays(const Exec& exec, const Caster& caster, const buffer<ray, Exec>& rays,
               const buffer<ray_hit, Exec>& hits, std::size_t n) {
  if constexpr (is_inline_caster_v<Caster>)
    exec.for_each(n, cast_each<Caster>{caster, rays.view(), hits.view()});
  else
    caster.cast(exec, array_view<const ray>(rays.data(), n), array_view<ray_hit>(hits.data(), n));
}

}  // namespace detail
}  // namespace wfpg
