// Casts rays from emitters and adds their power to the voxels that they meet, which finds the directly lit
// voxels. Triangles are sampled by their power and directions by the cosine, so that all rays carry equal
// power. Sums are integers: their order does not change a bit.
//
// Source: Jhang & Chang, "An Unbiased Hybrid Rendering Approach to Path Guiding", section 2.2. Its reflective
// shadow maps are replaced by rays, which is wfpg's own.
// Cost: a ray takes a search in the emitters' prefix sums, the host's cast and a descent of the octree.
// Memory: 44 bytes a ray in flight, 8 an emitter and 40 a leaf, while records are built.
#pragma once

#include <wfpg/base/prefix_search.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/guides/records/detail/voxel_light.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/triangle_voxel.hpp>

namespace wfpg {

/// A triangle that emits constant radiance into the hemisphere before its front. The corners are
/// counter-clockwise as seen from the front, in world space. Triangles without area, or that are not finite,
/// emit nothing.
struct emitting_triangle {
  vec3 a{0.0f};  ///< first corner, world space
  vec3 b{0.0f};  ///< second corner
  vec3 c{0.0f};  ///< third corner
  /// Emitted radiance, as a luminance, W/(m² sr). Triangles with 0, less, or a value that is not finite are
  /// skipped.
  float radiance = 0.0f;
  bool two_sided = false;  ///< whether it emits from its back, too, as much again
};

/// What happens to light at a surface: it continues in one direction, or it ends there and lights the
/// surface.
struct smooth_bounce {
  bool goes_on = false;  ///< whether light continues; false for rough surfaces, which are lit
  vec3 direction{0.0f};  ///< direction in which it continues, world space, unit length
  /// Fraction of the light that continues, divided by the probability of choosing the direction; in [0, 1].
  /// Larger values count as 1. Light ends at values that are not positive or not finite.
  float throughput = 1.0f;
};

/// The default for scenes: light ends at every surface, so that mirrors and glass count as rough.
struct no_smooth_surfaces {
  /// Returns a bounce that does not go on.
  WFPG_HD smooth_bounce operator()(std::uint32_t, const ray&, float, vec2) const { return {}; }
};

namespace detail {

/// Radiance of a triangle times its area, twice that if it is two-sided: its power divided by pi. 0 for a
/// triangle that emits nothing or is not finite.
struct power_of_emitter {
  array_view<const emitting_triangle> emitters;  ///< of the scene

  /// Power of emitter `i`, over pi; at least 0 and finite.
  WFPG_HD float operator()(std::size_t i) const {
    // The conditions below are false for NaN, so that a triangle with one has no power.
    const emitting_triangle& e = emitters[i];
    const float sides = e.two_sided ? 2.0f : 1.0f;
    const float power = 0.5f * glm::length(glm::cross(e.b - e.a, e.c - e.a)) * e.radiance * sides;
    return is_finite(power) && power > 0.0f && e.radiance > 0.0f ? power : 0.0f;
  }
};

/// Converts emitters' powers to integer weights, whose prefix sums do not depend on their order. The largest
/// weight is 2²⁴. An emitter with any power has at least 1.
struct weigh_emitters {
  power_of_emitter power;  ///< of an emitter
  float greatest;          ///< the largest power of an emitter, above 0
  std::uint64_t* weights;  ///< output, one an emitter

  WFPG_HD void operator()(std::size_t i) const {
    // 2²⁴ is the last power of two up to which a float holds all integers.
    const float share = power(i) / greatest * 0x1p24f;
    weights[i] = share > 0.0f ? static_cast<std::uint64_t>(max(share, 1.0f)) : 0u;
  }
};

/// The discrete distribution of emitters by power, which rays are sampled from.
struct emitter_set {
  array_view<const emitting_triangle> emitters;
  array_view<const std::uint64_t> weights_prefix;  ///< of an emitter: its weight and those before it
  std::uint64_t total = 0;                         ///< sum of the weights
  float power_of_weight = 0.0f;                    ///< radiance times area that a weight of 1 stands for

  /// Whether nothing emits.
  bool empty() const { return total == 0; }
};

/// Power of a ray as it leaves its emitter. Bounces lower it, and a ray of power 0 has ended.
inline constexpr std::uint32_t whole_ray = 1u << 16;

/// Samples rays [first, first + n) of `count` rays from the emitters. The rays are stratified: ray n gets an
/// emitter from the n-th of `count` equal parts of the power. Its point is uniform on the triangle, and its
/// direction is distributed by the cosine.
struct emit_rays {
  emitter_set from;   ///< not empty
  float off_surface;  ///< distance from the triangle to the ray's origin, scene units
  /// First ray of this launch, rays of all launches, and a seed for all of them.
  std::uint64_t first, count, seed;
  ray* rays;              ///< output
  std::uint32_t* powers;  ///< output: whole_ray for each

  WFPG_HD void operator()(std::size_t i) const {
    // All random numbers of a ray follow from its number, however rays are spread over launches.
    const std::uint64_t n = first + i, bits = hash(seed, n);
    const std::uint64_t place = hash(bits, 1) % from.total;
    // Where the n-th of `count` equal parts begins, and how far into it, without a product of 2⁶⁴ or more.
    const std::uint64_t part = from.total / count, left = from.total % count;
    const std::uint64_t target =
        min(n * part + n * left / count + place % max<std::uint64_t>(part, 1), from.total - 1);
    const emitting_triangle& e = from.emitters[find(target)];
    // A uniform point of the triangle, by the square root of one number.
    const vec2 u = unit_vec2(hash(bits, 2)), v = unit_vec2(hash(bits, 3));
    const float root = sqrtf(u.x);
    const vec3 point = e.a + root * ((e.b - e.a) * (1.0f - u.y) + (e.c - e.a) * u.y);
    // Both sides count in the power of a two-sided emitter, and each gets half of its rays.
    vec3 normal = unit_normal(e.a, e.b, e.c);
    if (e.two_sided && (bits & 1u)) normal = -normal;
    // The origin is off the surface already, so that t_min is 0. The largest float bounds no hit.
    rays[i].origin = point + normal * off_surface;
    rays[i].t_min = 0.0f;
    rays[i].direction = cosine_direction(normal, v);
    rays[i].t_max = 3.0e38f;
    powers[i] = whole_ray;
  }

 private:
  /// Index of the emitter that a number in [0, total) falls on: the first whose prefix sum exceeds it.
  WFPG_HD std::size_t find(std::uint64_t target) const {
    const auto sums = [&](std::uint32_t i) { return from.weights_prefix[i]; };
    return search_prefix(sums, static_cast<std::uint32_t>(from.weights_prefix.size()), std::uint64_t(0),
                         from.total, target)
        .index;
  }
  /// A unit direction by the cosine to `normal`, from u in [0,1)². quarter_turn() computes sines of one
  /// quadrant, which signs and swaps carry to the others.
  WFPG_HD static vec3 cosine_direction(vec3 normal, vec2 u) {
    const float z = sqrtf(1.0f - u.x), r = sqrtf(u.x), turn = 4.0f * u.y;
    // Its radius on the disk is the root of a uniform number, as for a uniform point of the disk.
    const vec2 p = r * quarter_turn(turn - floorf(turn));
    const auto quadrant = static_cast<int>(turn);
    const vec2 q = quadrant % 2 == 0 ? p : vec2(-p.y, p.x);
    return glm::normalize(frame(normal).to_world({quadrant < 2 ? q.x : -q.x, quadrant < 2 ? q.y : -q.y, z}));
  }
};

/// Continues or ends each ray at the surface that it met. Light that continues overwrites the ray. Light that
/// ends is added to the voxel there, and the ray's power becomes 0. Rays that met nothing end, too.
template <class Smooth>
struct land_rays {
  Smooth smooth;                  ///< the host's; see lit_scene
  sparse_voxel_octree_view tree;  ///< its leaves receive light
  const std::uint16_t* normals;   ///< of a node, packed
  float off_surface;              ///< distance from a surface to a continued ray's origin, scene units
  std::uint64_t seed;             ///< differs between launches
  const ray_hit* hits;            ///< of the rays, as the caster returned them
  ray* rays;                      ///< cast, and overwritten where light continues
  std::uint32_t* powers;          ///< what is left of whole_ray
  leaf_light* light;              ///< of a leaf; atomic sums
  std::uint32_t* on_their_way;    ///< counts rays that continue

  WFPG_HD void operator()(std::size_t i) const {
    // Rays that ended earlier stay in the arrays, with a power of 0.
    const std::uint32_t power = powers[i];
    if (power == 0) return;
    ray& r = rays[i];
    const float distance = hits[i].distance;
    powers[i] = 0;
    // A point that is not finite, such as that of a wrong distance, ends the ray too.
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
  /// Continues a ray and returns the power that is left. Counts light that crosses a voxel from one side to
  /// the other, since cones see through such voxels.
  WFPG_HD std::uint32_t go_on(ray& r, vec3 p, const smooth_bounce& bounce, std::uint32_t power) const {
    const float throughput = bounce.throughput;
    // Rounding down means that power never grows, and that weak light ends after some bounces.
    const bool sound = is_finite(throughput) && throughput > 0.0f && is_finite(bounce.direction);
    const std::uint32_t left =
        sound ? static_cast<std::uint32_t>(static_cast<float>(power) * min(throughput, 1.0f)) : 0u;
    const node_id leaf = tree.nearest_leaf(p);
    // Light enters from side(-r.direction) and leaves toward side(direction); equal signs here mean it
    // crosses.
    if (leaf != invalid_node && left > 0 && side(leaf, r.direction) == side(leaf, bounce.direction))
      atomic_add(&light[leaf - tree.first_leaf()].crossed, std::uint64_t(left));
    r.origin = p + off_surface * bounce.direction;
    r.direction = bounce.direction;
    return left;
  }
  /// Adds a ray's power to the side of the nearest leaf that the light comes from. Lost where no voxel is
  /// near.
  WFPG_HD void arrive(vec3 p, vec3 direction, std::uint32_t power) const {
    const node_id leaf = tree.nearest_leaf(p);
    if (leaf == invalid_node) return;
    atomic_add(&light[leaf - tree.first_leaf()].arrived[side(leaf, -direction)], std::uint64_t(power));
  }
  /// Side of a leaf that faces a direction, 0 or 1.
  WFPG_HD std::uint32_t side(node_id leaf, vec3 direction) const {
    return lit_nodes{nullptr, normals}.side_facing(leaf, direction);
  }
};

/// Adds each emitter's own light to the leaves that it lies in. A block takes one triangle, and its threads
/// take columns of voxels in the triangle's box. The light of a leaf is proportional to the triangle's area
/// inside the voxel.
struct emit_in_leaves {
  emitter_set from;
  sparse_voxel_octree_view tree;
  const std::uint16_t* normals;  ///< of a node, packed
  float unit;                    ///< radiance times faces of a leaf that counts as 1
  leaf_light* light;             ///< of a leaf; atomic sums

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    if (!(power_of_emitter{from.emitters}(i) > 0.0f)) return;
    const emitting_triangle& e = from.emitters[i];
    const voxel_grid& grid = tree.grid();
    const grid_triangle t{grid.to_grid(e.a), grid.to_grid(e.b), grid.to_grid(e.c)};
    // Only the normals are read: light is not yet known.
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
        // In faces of a leaf: grid units make a voxel's side 1. The triangle may touch a voxel in a point.
        const float area = area_inside(t.relative_to(vec3(voxel) + 0.5f));
        if (leaf == invalid_node || !(area > 0.0f)) continue;
        // Rounded up, so that a leaf with part of an emitter is tagged as a light.
        const auto power = static_cast<std::uint64_t>(ceilf(area * e.radiance / unit));
        const std::uint32_t side = sides.side_facing(leaf, normal);
        std::uint64_t* const emitted = light[leaf - tree.first_leaf()].emitted;
        atomic_add(emitted + side, power);
        if (e.two_sided) atomic_add(emitted + (side ^ 1u), power);
      }
    });
  }
};

}  // namespace detail
}  // namespace wfpg
