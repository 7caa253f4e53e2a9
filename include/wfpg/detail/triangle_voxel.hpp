// One triangle against voxels, in grid units: which voxels it touches, and how much of it lies in one.
// Coordinates are relative to a voxel's centre where a function says so; a voxel is the unit cube around it.
#pragma once

#include <wfpg/detail/math.hpp>
#include <wfpg/types.hpp>

#include <cmath>

namespace wfpg::detail {

/// A voxel counts as touched within this distance of its faces, in voxels: above the rounding error of grid
/// coordinates up to 2¹², so that no touched voxel is missed.
inline constexpr float touch_tolerance = 0x1p-10f;

/// Three vertices in grid units.
struct grid_triangle {
  vec3 a, b, c;

  WFPG_HD grid_triangle relative_to(vec3 p) const { return {a - p, b - p, c - p}; }
};

/// The cross product with exact products: floats cancel in it, and would tilt the normal of a long sliver by
/// more than the tolerance is worth at its ends.
WFPG_HD inline vec3 accurate_cross(vec3 a, vec3 b) {
  const auto difference = [](float p, float q, float r, float s) {
    return static_cast<float>(static_cast<double>(p) * q - static_cast<double>(r) * s);
  };
  return {difference(a.y, b.z, a.z, b.y), difference(a.z, b.x, a.x, b.z), difference(a.x, b.y, a.y, b.x)};
}

/// Whether the triangle's projections on `axis` stay apart from those of the cube of half side `half`.
WFPG_HD inline bool separates(vec3 axis, const grid_triangle& t, float half) {
  const float a = glm::dot(axis, t.a);
  const float b = glm::dot(axis, t.b);
  const float c = glm::dot(axis, t.c);
  const float radius = half * (fabsf(axis.x) + fabsf(axis.y) + fabsf(axis.z));
  return min(a, min(b, c)) > radius || max(a, max(b, c)) < -radius;
}

/// Whether a triangle, relative to the centre, overlaps the cube of half side `half`: separating axes
/// (Akenine-Möller 2001, "Fast 3D Triangle-Box Overlap Testing").
WFPG_HD inline bool overlaps_cube(const grid_triangle& t, float half) {
  const vec3 edges[3] = {t.b - t.a, t.c - t.b, t.a - t.c};
  if (separates({1, 0, 0}, t, half) || separates({0, 1, 0}, t, half) || separates({0, 0, 1}, t, half))
    return false;
  if (separates(accurate_cross(edges[0], edges[1]), t, half)) return false;
  for (const vec3& e : edges)
    if (separates({0, -e.z, e.y}, t, half) || separates({e.z, 0, -e.x}, t, half) ||
        separates({-e.y, e.x, 0}, t, half))
      return false;
  return true;
}

/// A convex polygon of a clipped triangle: three vertices and at most one more for each of six planes.
struct clip_polygon {
  vec3 vertices[9];
  int count = 0;

  WFPG_HD void push(vec3 v) {
    if (count < 9) vertices[count++] = v;
  }
};

/// Cuts off what of the polygon lies where sign * v[axis] > 0.5 (Sutherland & Hodgman 1974). Most planes cut
/// nothing.
WFPG_HD inline void clip(clip_polygon& in, int axis, float sign) {
  bool crosses = false;
  for (int i = 0; i < in.count; ++i) crosses = crosses || sign * in.vertices[i][axis] > 0.5f;
  if (!crosses) return;
  clip_polygon out;
  for (int i = 0; i < in.count; ++i) {
    const vec3 p = in.vertices[i];
    const vec3 q = in.vertices[i + 1 < in.count ? i + 1 : 0];
    const float dp = 0.5f - sign * p[axis];
    const float dq = 0.5f - sign * q[axis];
    if (dp >= 0.0f) out.push(p);
    if ((dp >= 0.0f) != (dq >= 0.0f)) out.push(p + (q - p) * (dp / (dp - dq)));
  }
  in = out;
}

/// The area of a triangle, relative to a voxel's centre, inside the voxel; in square voxels.
WFPG_HD inline float area_inside(const grid_triangle& t) {
  clip_polygon polygon;
  polygon.push(t.a);
  polygon.push(t.b);
  polygon.push(t.c);
  for (int axis = 0; axis < 3; ++axis) {
    clip(polygon, axis, 1.0f);
    clip(polygon, axis, -1.0f);
  }
  vec3 twice(0.0f);
  for (int i = 2; i < polygon.count; ++i)
    twice +=
        glm::cross(polygon.vertices[i - 1] - polygon.vertices[0], polygon.vertices[i] - polygon.vertices[0]);
  return 0.5f * glm::length(twice);
}

/// The unit normal of the counter-clockwise side, or zero where the triangle has no area.
WFPG_HD inline vec3 unit_normal(vec3 a, vec3 b, vec3 c) {
  const vec3 e = b - a;
  const vec3 f = c - a;
  const float size_e = max(fabsf(e.x), max(fabsf(e.y), fabsf(e.z)));
  const float size_f = max(fabsf(f.x), max(fabsf(f.y), fabsf(f.z)));
  if (!(size_e > 0.0f) || !(size_f > 0.0f)) return vec3(0.0f);
  const vec3 n = glm::cross(e / size_e, f / size_f);
  const float length = glm::length(n);
  return length > 1.0e-12f ? n / length : vec3(0.0f);
}

/// The columns of voxels along the triangle's dominant axis that its box covers, in row order, and in each
/// column the voxels that its plane can reach.
class triangle_columns {
 public:
  WFPG_HD triangle_columns(const grid_triangle& t, std::uint32_t resolution) : triangle_(t) {
    const vec3 n = glm::cross(t.b - t.a, t.c - t.a);
    w_ = fabsf(n.x) > fabsf(n.y) ? (fabsf(n.x) > fabsf(n.z) ? 0 : 2) : (fabsf(n.y) > fabsf(n.z) ? 1 : 2);
    u_ = (w_ + 1) % 3;
    v_ = (w_ + 2) % 3;
    for (int axis = 0; axis < 3; ++axis) {
      const float low = min(t.a[axis], min(t.b[axis], t.c[axis])) - touch_tolerance;
      const float high = max(t.a[axis], max(t.b[axis], t.c[axis])) + touch_tolerance;
      const float last = static_cast<float>(resolution - 1);
      lower_[axis] = static_cast<int>(clamp(floorf(low), 0.0f, last));
      upper_[axis] = static_cast<int>(clamp(floorf(high), 0.0f, last));
    }
    if (fabsf(n[w_]) > 0.0f) slope_ = {-n[u_] / n[w_], -n[v_] / n[w_]};
    // The normal of a sliver is rounded; how far its plane misses the vertices says by how much.
    const float miss = max(fabsf(plane(t.b) - t.b[w_]), fabsf(plane(t.c) - t.c[w_]));
    reach_ = 0.5f * (fabsf(slope_.x) + fabsf(slope_.y)) + miss + 4.0f * touch_tolerance;
  }

  WFPG_HD std::uint64_t count() const {
    return static_cast<std::uint64_t>(upper_[u_] - lower_[u_] + 1) *
           static_cast<std::uint64_t>(upper_[v_] - lower_[v_] + 1);
  }

  /// f(voxel) for each voxel of column i that the triangle touches.
  template <class F>
  WFPG_HD void for_each_voxel(std::uint64_t i, F f) const {
    const auto width = static_cast<std::uint64_t>(upper_[u_] - lower_[u_] + 1);
    int voxel[3];
    voxel[u_] = lower_[u_] + static_cast<int>(i % width);
    voxel[v_] = lower_[v_] + static_cast<int>(i / width);
    int first, last;
    plane_range(voxel[u_], voxel[v_], first, last);
    for (voxel[w_] = first; voxel[w_] <= last; ++voxel[w_]) {
      const uvec3 coordinates(voxel[0], voxel[1], voxel[2]);
      const grid_triangle local = triangle_.relative_to(vec3(coordinates) + 0.5f);
      if (overlaps_cube(local, 0.5f + touch_tolerance)) f(coordinates);
    }
  }

 private:
  WFPG_HD float plane(vec3 p) const {
    return triangle_.a[w_] + slope_.x * (p[u_] - triangle_.a[u_]) + slope_.y * (p[v_] - triangle_.a[v_]);
  }

  WFPG_HD void plane_range(int column_u, int column_v, int& first, int& last) const {
    vec3 centre(0.0f);
    centre[u_] = static_cast<float>(column_u) + 0.5f;
    centre[v_] = static_cast<float>(column_v) + 0.5f;
    const float limit = 1.0e6f;
    first = max(lower_[w_], static_cast<int>(floorf(clamp(plane(centre) - reach_, -limit, limit))));
    last = min(upper_[w_], static_cast<int>(floorf(clamp(plane(centre) + reach_, -limit, limit))));
  }

  grid_triangle triangle_;
  int u_, v_, w_;
  int lower_[3], upper_[3];
  vec2 slope_{0.0f};
  float reach_;
};

}  // namespace wfpg::detail
