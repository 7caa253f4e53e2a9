// The equal-area octahedral map: the unit square to the sphere, or to the hemisphere z >= 0.
// Fields are grids over these squares (paper, section 4, "Radiance field projection").
// Equal areas of a square become equal solid angles: a cell of an n x n grid covers 4 pi / n² steradians.
// Over the hemisphere it covers 2 pi / n². Densities therefore need no Jacobian that varies.
//
// Source: Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD".
// Directions are stored in another, cheaper map: Cigolle et al. 2014, at the end of this file.
// Cost: one square root and a polynomial a call, O(1). No call of trigonometry. Memory: none.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>

namespace wfpg {
/// Parts of the maps, on one quadrant or one half of the square.
namespace detail {

/// Returns (cos, sin) of t · pi/2, t in [0,1], to 1e-7.
/// Source: the polynomials of Moshier's Cephes library, sinf.c, on half the range.
/// Both results lie in [0,1]; the ends of the quadrant are exact.
WFPG_HD inline vec2 quarter_turn(float t) {
  // Angles above pi/4 swap sine and cosine: the polynomials need only cover [0, pi/4].
  const bool upper = t > 0.5f;
  const float x = (upper ? 1.0f - t : t) * (0.5f * pi), z = x * x;
  const float sine = x + x * z * (-1.6666654611e-1f + z * (8.3321608736e-3f + z * -1.9515295891e-4f));
  const float cosine =
      1.0f - 0.5f * z + z * z * (4.166664568e-2f + z * (-1.388731625e-3f + z * 2.443315712e-5f));
  return upper ? vec2{sine, cosine} : vec2{cosine, sine};
}

/// Returns the angle of (x, y) in quarter turns, in [0,1]. Inverse of quarter_turn().
/// Preconditions: x and y are at least 0 and not both 0. Source: Cephes, atanf.c.
/// It is 0 on the x axis and 1 on the y axis.
WFPG_HD inline float quarters_of(float x, float y) {
  // Two reductions keep the polynomial's argument below tan(pi/8): to the nearer axis, then by pi/4.
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

/// Returns the unit direction with z >= 0 above a point of the diamond |p.x| + |p.y| <= 1.
/// Area is kept: with r = |p.x| + |p.y|, z is 1 - r². Rounding beyond the diamond is clamped to its edge.
WFPG_HD inline vec3 diamond_to_hemisphere(vec2 p) {
  const float ax = fabsf(p.x);
  const float ay = fabsf(p.y);
  const float r = min(ax + ay, 1.0f);
  // The share of |p.y| in r is the azimuth inside the quadrant, in quarter turns.
  const vec2 turn = quarter_turn(r > 0.0f ? ay / (ax + ay) : 0.0f);
  const float scale = r * sqrtf(2.0f - r * r);
  return {copysignf(scale * turn.x, p.x), copysignf(scale * turn.y, p.y), 1.0f - r * r};
}

/// Returns the point of the diamond under a unit direction with z >= 0. Inverse of diamond_to_hemisphere().
/// The radius is sqrt(1 - z), computed from x and y so that nothing cancels near the pole.
/// At the pole, where the azimuth is undefined, it returns (0, 0).
WFPG_HD inline vec2 hemisphere_to_diamond(vec3 d) {
  const float ax = fabsf(d.x);
  const float ay = fabsf(d.y);
  // x² + y² is (1 - z)(1 + z), of which the quotient leaves 1 - z.
  const float r = min(sqrtf((ax * ax + ay * ay) / (1.0f + d.z)), 1.0f);
  const float y = r > 0.0f ? quarters_of(ax, ay) * r : 0.0f;
  return {copysignf(r - y, d.x), copysignf(y, d.y)};
}

}  // namespace detail

/// Returns the unit direction of a point of [0,1]².
/// The inner diamond is the hemisphere z >= 0: the centre is +z, and all four corners are -z.
/// Seams of the lower hemisphere are the square's edges, each of which is glued to itself about its middle.
WFPG_HD inline vec3 square_to_sphere(vec2 uv) {
  vec2 p{2.0f * uv.x - 1.0f, 2.0f * uv.y - 1.0f};
  const float ax = fabsf(p.x);
  const float ay = fabsf(p.y);
  if (ax + ay <= 1.0f) return detail::diamond_to_hemisphere(p);
  // Outside of the diamond: the four outer triangles fold inward and become the lower hemisphere.
  p = {copysignf(1.0f - ay, p.x), copysignf(1.0f - ax, p.y)};
  const vec3 d = detail::diamond_to_hemisphere(p);
  return {d.x, d.y, -d.z};
}

/// Returns the point of [0,1]² of a unit direction. Inverse of square_to_sphere().
/// With -ffast-math, results lie up to 1e-7 outside [0,1]².
/// Directions of the lower hemisphere are folded outward. -z is at all four corners: it returns one of them.
WFPG_HD inline vec2 sphere_to_square(vec3 d) {
  vec2 p = detail::hemisphere_to_diamond({d.x, d.y, fabsf(d.z)});
  if (d.z < 0.0f) p = {copysignf(1.0f - fabsf(p.y), p.x), copysignf(1.0f - fabsf(p.x), p.y)};
  return {0.5f * p.x + 0.5f, 0.5f * p.y + 0.5f};
}

/// Returns the unit direction with z >= 0 of a point of [0,1]². The centre is +z, the edges are the horizon.
/// The square's corners become the diamond's: (1, 1) is +x, (0, 0) is -x, (1, 0) is +y, (0, 1) is -y.
WFPG_HD inline vec3 square_to_hemisphere(vec2 uv) {
  return detail::diamond_to_hemisphere({uv.x + uv.y - 1.0f, uv.x - uv.y});
}

/// Returns the z of square_to_hemisphere(), without its polynomial and square root.
/// It is the cosine to the normal: 1 in the centre, 0 on all edges.
WFPG_HD inline float square_to_hemisphere_z(vec2 uv) {
  const float r = max(fabsf(2.0f * uv.x - 1.0f), fabsf(2.0f * uv.y - 1.0f));
  return 1.0f - r * r;
}

/// Returns the point of [0,1]² of a unit direction with z >= 0. Inverse of square_to_hemisphere().
/// With -ffast-math, coordinates may leave [0,1] by up to 1e-7.
/// Fields over a surface's hemisphere look up cells with it, in the frame of the normal.
WFPG_HD inline vec2 hemisphere_to_square(vec3 d) {
  const vec2 p = detail::hemisphere_to_diamond(d);
  return {0.5f * (p.x + p.y) + 0.5f, 0.5f * (p.x - p.y) + 0.5f};
}

/// Moves a cell that left the grid over an edge to the cell that is its neighbour on the sphere.
/// The grid has `size` x `size` cells over the square of square_to_sphere().
/// A step over an edge comes back on that edge, mirrored about its middle.
/// x and y are inputs and outputs. Cells inside the grid stay as they are.
/// Precondition: both coordinates lie in [-size, 2 · size).
/// Filters over a field's cells use it, so that they see no seam.
WFPG_HD inline void wrap_octahedral(int& x, int& y, int size) {
  // A corner step leaves over both edges, and is mirrored twice.
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

/// Returns a direction's projection onto the octahedron, unfolded to [-1,1]². `d` may have any length but 0.
/// For storage: no trigonometry, and areas are not kept.
/// Source: Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors", oct.
/// The faces with z < 0 are folded outward over the edges of the diamond.
WFPG_HD inline vec2 direction_to_octahedron(vec3 d) {
  const float sum = fabsf(d.x) + fabsf(d.y) + fabsf(d.z);
  const vec2 p{d.x / sum, d.y / sum};
  if (d.z >= 0.0f) return p;
  return {copysignf(1.0f - fabsf(p.y), p.x), copysignf(1.0f - fabsf(p.x), p.y)};
}

/// Returns the direction of a point of [-1,1]², not normalised: its length is above 0.5.
/// Inverse of direction_to_octahedron().
/// Callers that compare directions only may skip normalising it.
WFPG_HD inline vec3 octahedron_to_direction(vec2 p) {
  const float z = 1.0f - fabsf(p.x) - fabsf(p.y);
  if (z >= 0.0f) return {p.x, p.y, z};
  return {copysignf(1.0f - fabsf(p.y), p.x), copysignf(1.0f - fabsf(p.x), p.y), z};
}

}  // namespace detail

/// Packs a unit direction into 32 bits, 16 a coordinate of the octahedron's square.
/// The stored direction is at most 0.01 degrees off; the axes are exact, but for fast maths.
/// x is in the low half. The steps are 1/32767, so that -1, 0 and 1 are among the values.
WFPG_HD inline std::uint32_t pack_direction(vec3 d) {
  const vec2 p = detail::direction_to_octahedron(d);
  const auto x = static_cast<std::uint32_t>(p.x * 32767.0f + 32767.5f);
  const auto y = static_cast<std::uint32_t>(p.y * 32767.0f + 32767.5f);
  return x | y << 16;
}

/// Returns the unit direction that pack_direction() stored.
WFPG_HD inline vec3 unpack_direction(std::uint32_t packed) {
  return glm::normalize(
      detail::octahedron_to_direction({(static_cast<float>(packed & 0xffffu) - 32767.0f) * (1.0f / 32767.0f),
                                       (static_cast<float>(packed >> 16) - 32767.0f) * (1.0f / 32767.0f)}));
}

}  // namespace wfpg
