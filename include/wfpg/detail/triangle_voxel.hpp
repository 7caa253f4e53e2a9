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

/// The same of an axis that is normal to an edge: one end of it, and the third corner.
WFPG_HD inline bool separates(vec3 axis, vec3 end, vec3 corner, float half) {
  const float a = glm::dot(axis, end), b = glm::dot(axis, corner);
  const float radius = half * (fabsf(axis.x) + fabsf(axis.y) + fabsf(axis.z));
  return min(a, b) > radius || max(a, b) < -radius;
}

/// Whether an edge from `end`, crossed with one of the cube's, keeps the triangle apart from the cube.
WFPG_HD inline bool edge_separates(vec3 edge, vec3 end, vec3 corner, float half) {
  return separates({0.0f, -edge.z, edge.y}, end, corner, half) ||
         separates({edge.z, 0.0f, -edge.x}, end, corner, half) ||
         separates({-edge.y, edge.x, 0.0f}, end, corner, half);
}

/// Whether a triangle, relative to the centre, overlaps the cube of half side `half`, where their boxes do:
/// separating axes (Akenine-Möller 2001, "Fast 3D Triangle-Box Overlap Testing"). `normal`: of any length.
WFPG_HD inline bool overlaps_cube(const grid_triangle& t, vec3 normal, float half) {
  return !separates(normal, t, half) && !edge_separates(t.b - t.a, t.a, t.c, half) &&
         !edge_separates(t.c - t.b, t.b, t.a, half) && !edge_separates(t.a - t.c, t.c, t.b, half);
}

/// The mean of clamp(v, -1/2, 1/2) where v goes evenly from a to b.
WFPG_HD inline float mean_clamped(float a, float b) {
  const float low = min(a, b), high = max(a, b);
  if (low >= -0.5f && high <= 0.5f) return 0.5f * (low + high);
  if (high <= -0.5f) return -0.5f;
  if (low >= 0.5f) return 0.5f;
  const float below = max(-0.5f - low, 0.0f), above = max(high - 0.5f, 0.0f);
  const float from = max(low, -0.5f), to = min(high, 0.5f);
  return (0.5f * (above - below) + 0.5f * (from + to) * (to - from)) / (high - low);
}

/// The area of a closed polygon inside the unit square about the origin, edge by edge: what lies between an
/// edge and a base line, inside the square, counts with the edge's direction. No polygon is kept.
struct area_in_square {
  float base;  // the nearer to the polygon, the less of small ones is lost to rounding
  float sum = 0.0f;

  WFPG_HD void edge(vec2 p, vec2 q) {
    const float from = clamp(p.x, -0.5f, 0.5f), to = clamp(q.x, -0.5f, 0.5f);
    if (from == to) return;
    const float slope = (q.y - p.y) / (q.x - p.x);
    const float y_from = from == p.x ? p.y : p.y + slope * (from - p.x);
    const float y_to = to == q.x ? q.y : q.y + slope * (to - q.x);
    sum += (to - from) * (mean_clamped(y_from, y_to) - base);
  }
};

/// One of the two planes that bound the third coordinate of a polygon: where its edges come in and go out.
struct bounding_plane {
  float side;  // +1 or -1: the plane is at side/2
  vec2 enter{0.0f}, leave{0.0f};
  bool crossed = false;

  /// Cuts what lies beyond the plane off the edge from p to q, of which [begin, end] is left.
  WFPG_HD void cut(vec3 p, vec3 q, float& begin, float& end) {
    const float from = 0.5f - side * p.z, to = 0.5f - side * q.z;  // inside: at least 0
    if ((from >= 0.0f) == (to >= 0.0f)) {
      if (from < 0.0f) end = -1.0f;
      return;
    }
    crossed = true;
    const float t = from / (from - to);
    const vec2 at = vec2(p.x, p.y) + (vec2(q.x, q.y) - vec2(p.x, p.y)) * t;
    if (from >= 0.0f) {
      leave = at;
      end = min(end, t);
    } else {
      enter = at;
      begin = max(begin, t);
    }
  }
};

/// The axis along which a vector is longest.
WFPG_HD inline int largest_axis(vec3 v) {
  const float x = fabsf(v.x), y = fabsf(v.y), z = fabsf(v.z);
  return x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
}

/// The area of a triangle, relative to a voxel's centre, inside the voxel; in square voxels. Of its
/// projection along the dominant axis: the triangle is cut to the voxel's height, and what is left to its
/// square.
WFPG_HD inline float area_inside(const grid_triangle& t) {
  const vec3 n = glm::cross(t.b - t.a, t.c - t.a);
  const vec3 farthest = glm::max(glm::abs(t.a), glm::max(glm::abs(t.b), glm::abs(t.c)));
  if (max(farthest.x, max(farthest.y, farthest.z)) <= 0.5f) return 0.5f * glm::length(n);
  const int w = largest_axis(n);
  if (!(fabsf(n[w]) > 0.0f)) return 0.0f;
  const auto turned = [w](vec3 v) { return w == 0 ? vec3(v.y, v.z, v.x) : w == 1 ? vec3(v.z, v.x, v.y) : v; };
  const vec3 corners[3] = {turned(t.a), turned(t.b), turned(t.c)};
  area_in_square area{clamp(corners[0].y, -0.5f, 0.5f)};
  bounding_plane upper{1.0f}, lower{-1.0f};
  for (int i = 0; i < 3; ++i) {
    const vec3 p = corners[i], q = corners[i < 2 ? i + 1 : 0];
    float begin = 0.0f, end = 1.0f;
    upper.cut(p, q, begin, end);
    lower.cut(p, q, begin, end);
    if (!(begin < end)) continue;
    const vec2 from(p.x, p.y), to(q.x, q.y);
    area.edge(begin > 0.0f ? from + (to - from) * begin : from, end < 1.0f ? from + (to - from) * end : to);
  }
  if (upper.crossed) area.edge(upper.leave, upper.enter);
  if (lower.crossed) area.edge(lower.leave, lower.enter);
  return fabsf(area.sum) * glm::length(n) / fabsf(n[w]);
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
  WFPG_HD triangle_columns(const grid_triangle& t, std::uint32_t resolution)
      : triangle_(t), normal_(accurate_cross(t.b - t.a, t.c - t.b)) {
    const vec3 n = glm::cross(t.b - t.a, t.c - t.a);
    w_ = largest_axis(n);
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
      if (overlaps_cube(local, normal_, 0.5f + touch_tolerance)) f(coordinates);
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
  vec3 normal_;
  int u_, v_, w_;
  int lower_[3], upper_[3];
  vec2 slope_{0.0f};
  float reach_;
};

}  // namespace wfpg::detail
