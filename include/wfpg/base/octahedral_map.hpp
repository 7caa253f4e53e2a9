// The equal-area concentric octahedral map (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using
// SIMD"): the unit square to the sphere, or to the hemisphere z >= 0, preserving relative areas. Fields are
// grids over these squares (paper, section 4, "Radiance field projection").
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>

namespace wfpg {
namespace detail {

/// cos and sin of t · pi/2, t in [0,1], to 1e-7 (polynomials of Moshier's Cephes library, sinf.c, on half the
/// range).
WFPG_HD inline vec2 quarter_turn(float t) {
  const bool upper = t > 0.5f;
  const float x = (upper ? 1.0f - t : t) * (0.5f * pi), z = x * x;
  const float sine = x + x * z * (-1.6666654611e-1f + z * (8.3321608736e-3f + z * -1.9515295891e-4f));
  const float cosine =
      1.0f - 0.5f * z + z * z * (4.166664568e-2f + z * (-1.388731625e-3f + z * 2.443315712e-5f));
  return upper ? vec2{sine, cosine} : vec2{cosine, sine};
}

/// The inverse: the angle of (x, y), both at least 0 and not both 0, in quarter turns (Cephes, atanf.c).
WFPG_HD inline float quarters_of(float x, float y) {
  const bool upper = y > x;
  const float r = upper ? x / y : y / x;  // tan of the angle to the nearer axis, in [0,1]
  const bool steep = r > 0.41421356f;     // tan(pi/8)
  const float a = steep ? (r - 1.0f) / (r + 1.0f) : r, z = a * a;
  const float angle = a + a * z *
                              (-3.33329491539e-1f +
                               z * (1.99777106478e-1f + z * (-1.38776856032e-1f + z * 8.05374449538e-2f)));
  const float quarters = angle * (2.0f / pi) + (steep ? 0.5f : 0.0f);
  return upper ? 1.0f - quarters : quarters;
}

/// A point of the diamond |p.x| + |p.y| <= 1 to the direction above it, z >= 0.
WFPG_HD inline vec3 diamond_to_hemisphere(vec2 p) {
  const float ax = fabsf(p.x);
  const float ay = fabsf(p.y);
  const float r = min(ax + ay, 1.0f);
  const vec2 turn = quarter_turn(r > 0.0f ? ay / (ax + ay) : 0.0f);
  const float scale = r * sqrtf(2.0f - r * r);
  return {copysignf(scale * turn.x, p.x), copysignf(scale * turn.y, p.y), 1.0f - r * r};
}

/// The inverse, for d.z >= 0.
WFPG_HD inline vec2 hemisphere_to_diamond(vec3 d) {
  const float ax = fabsf(d.x);
  const float ay = fabsf(d.y);
  const float r = min(sqrtf((ax * ax + ay * ay) / (1.0f + d.z)), 1.0f);
  const float y = r > 0.0f ? quarters_of(ax, ay) * r : 0.0f;
  return {copysignf(r - y, d.x), copysignf(y, d.y)};
}

}  // namespace detail

/// A point of [0,1]² to a unit direction. The inner diamond is the hemisphere z >= 0.
WFPG_HD inline vec3 square_to_sphere(vec2 uv) {
  vec2 p{2.0f * uv.x - 1.0f, 2.0f * uv.y - 1.0f};
  const float ax = fabsf(p.x);
  const float ay = fabsf(p.y);
  if (ax + ay <= 1.0f) return detail::diamond_to_hemisphere(p);
  p = {copysignf(1.0f - ay, p.x), copysignf(1.0f - ax, p.y)};
  const vec3 d = detail::diamond_to_hemisphere(p);
  return {d.x, d.y, -d.z};
}

/// The inverse of square_to_sphere, for unit directions. With -ffast-math up to 1e-7 outside [0,1]².
WFPG_HD inline vec2 sphere_to_square(vec3 d) {
  vec2 p = detail::hemisphere_to_diamond({d.x, d.y, fabsf(d.z)});
  if (d.z < 0.0f) p = {copysignf(1.0f - fabsf(p.y), p.x), copysignf(1.0f - fabsf(p.x), p.y)};
  return {0.5f * p.x + 0.5f, 0.5f * p.y + 0.5f};
}

/// A point of [0,1]² to a unit direction with z >= 0.
WFPG_HD inline vec3 square_to_hemisphere(vec2 uv) {
  return detail::diamond_to_hemisphere({uv.x + uv.y - 1.0f, uv.x - uv.y});
}

/// The z of square_to_hemisphere, without its trigonometry.
WFPG_HD inline float square_to_hemisphere_z(vec2 uv) {
  const float r = max(fabsf(2.0f * uv.x - 1.0f), fabsf(2.0f * uv.y - 1.0f));
  return 1.0f - r * r;
}

/// The inverse of square_to_hemisphere, for unit directions with z >= 0. With -ffast-math up to 1e-7 outside
/// [0,1]².
WFPG_HD inline vec2 hemisphere_to_square(vec3 d) {
  const vec2 p = detail::hemisphere_to_diamond(d);
  return {0.5f * (p.x + p.y) + 0.5f, 0.5f * (p.x - p.y) + 0.5f};
}

/// The cell (x, y) of a `size` x `size` grid over the sphere's square that lies where a neighbour step left
/// the grid: steps over an edge come back on the same edge, mirrored, as they do on the sphere. One step at
/// most `size` cells wide.
WFPG_HD inline void wrap_octahedral(int& x, int& y, int size) {
  if (x < 0 || x >= size) {
    x = x < 0 ? -1 - x : 2 * size - 1 - x;
    y = size - 1 - y;
  }
  if (y < 0 || y >= size) {
    y = y < 0 ? -1 - y : 2 * size - 1 - y;
    x = size - 1 - x;
  }
}

namespace detail {

/// A direction to the octahedron's own projection onto [-1,1]²: not equal-area, and without trigonometry; for
/// storage (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors", oct).
WFPG_HD inline vec2 direction_to_octahedron(vec3 d) {
  const float sum = fabsf(d.x) + fabsf(d.y) + fabsf(d.z);
  const vec2 p{d.x / sum, d.y / sum};
  if (d.z >= 0.0f) return p;
  return {copysignf(1.0f - fabsf(p.y), p.x), copysignf(1.0f - fabsf(p.x), p.y)};
}

/// The inverse: a direction of any length above 0.5.
WFPG_HD inline vec3 octahedron_to_direction(vec2 p) {
  const float z = 1.0f - fabsf(p.x) - fabsf(p.y);
  if (z >= 0.0f) return {p.x, p.y, z};
  return {copysignf(1.0f - fabsf(p.y), p.x), copysignf(1.0f - fabsf(p.x), p.y), z};
}

}  // namespace detail

/// A unit direction in 32 bits, at most 0.01 degrees away; the axes are exact.
WFPG_HD inline std::uint32_t pack_direction(vec3 d) {
  const vec2 p = detail::direction_to_octahedron(d);
  const auto x = static_cast<std::uint32_t>(p.x * 32767.0f + 32767.5f);
  const auto y = static_cast<std::uint32_t>(p.y * 32767.0f + 32767.5f);
  return x | y << 16;
}

/// The inverse of pack_direction.
WFPG_HD inline vec3 unpack_direction(std::uint32_t packed) {
  return glm::normalize(
      detail::octahedron_to_direction({(static_cast<float>(packed & 0xffffu) - 32767.0f) * (1.0f / 32767.0f),
                                       (static_cast<float>(packed >> 16) - 32767.0f) * (1.0f / 32767.0f)}));
}

}  // namespace wfpg
