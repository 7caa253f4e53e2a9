// One triangle against voxels, in grid units: which voxels it touches, and how much of it lies in one.
// Coordinates are relative to a voxel's centre where a function says so; a voxel is the unit cube around it.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

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

/// A normal of the counter-clockwise side, at most 2 long: zero where an edge has no length.
WFPG_HD inline vec3 scaled_normal(vec3 a, vec3 b, vec3 c) {
  const vec3 e = b - a;
  const vec3 f = c - a;
  const float size_e = max(fabsf(e.x), max(fabsf(e.y), fabsf(e.z)));
  const float size_f = max(fabsf(f.x), max(fabsf(f.y), fabsf(f.z)));
  if (!(size_e > 0.0f) || !(size_f > 0.0f)) return vec3(0.0f);
  return glm::cross(e / size_e, f / size_f);
}

/// The unit normal of the counter-clockwise side, or zero where the triangle has no area.
WFPG_HD inline vec3 unit_normal(vec3 a, vec3 b, vec3 c) {
  const vec3 n = scaled_normal(a, b, c);
  const float length = glm::length(n);
  return length > 1.0e-12f ? n / length : vec3(0.0f);
}

/// Voxels in a row along an axis.
struct voxel_run {
  std::uint32_t first = 0;  ///< coordinate of the first one
  std::uint32_t count = 0;
};

/// The columns of voxels that a triangle's box covers, in row order, in 8 bytes. Columns run along `axis()`.
class column_box {
 public:
  column_box() = default;
  /// Inclusive bounds in [0, 4095] along the two axes after `axis`.
  WFPG_HD column_box(int axis, glm::uvec2 lower, glm::uvec2 upper)
      : bits_(std::uint64_t(lower.x) | std::uint64_t(lower.y) << 12 | std::uint64_t(upper.x - lower.x) << 24 |
              std::uint64_t(upper.y - lower.y) << 36 |
              std::uint64_t(static_cast<std::uint32_t>(axis)) << 48) {}

  /// 0, 1 or 2.
  WFPG_HD int axis() const { return static_cast<int>(bits_ >> 48); }
  /// Number of columns, at least 1.
  WFPG_HD std::uint64_t count() const { return std::uint64_t(width()) * (part(36) + 1); }
  /// Coordinates of column i along the two axes after `axis()`.
  WFPG_HD glm::uvec2 column(std::uint64_t i) const {
    const auto at = static_cast<std::uint32_t>(i);
    return {part(0) + at % width(), part(12) + at / width()};
  }
  /// The voxel at `along` in a column.
  WFPG_HD uvec3 voxel(glm::uvec2 column, std::uint32_t along) const {
    const int w = axis();
    if (w == 0) return {along, column.x, column.y};
    return w == 1 ? uvec3(column.y, along, column.x) : uvec3(column.x, column.y, along);
  }

 private:
  WFPG_HD std::uint32_t part(int shift) const { return static_cast<std::uint32_t>(bits_ >> shift) & 0xfffu; }
  WFPG_HD std::uint32_t width() const { return part(24) + 1; }

  std::uint64_t bits_ = 0;
};

/// The axis along which a triangle's normal is longest.
WFPG_HD inline int column_axis(const grid_triangle& t) {
  return largest_axis(glm::cross(t.b - t.a, t.c - t.a));
}

/// Finds the voxels that a triangle touches, in columns along an axis.
class triangle_columns {
 public:
  /// `t` in grid units; `resolution` at most 4096; `axis`: the dominant one.
  WFPG_HD triangle_columns(const grid_triangle& t, std::uint32_t resolution, int axis)
      : triangle_(t),
        normal_(accurate_cross(t.b - t.a, t.c - t.b)),
        u_((axis + 1) % 3),
        v_((axis + 2) % 3),
        w_(axis) {
    const vec3 n = glm::cross(t.b - t.a, t.c - t.a);
    for (int i = 0; i < 3; ++i) {
      const float low = min(t.a[i], min(t.b[i], t.c[i])) - touch_tolerance;
      const float high = max(t.a[i], max(t.b[i], t.c[i])) + touch_tolerance;
      const float last = static_cast<float>(resolution - 1);
      lower_[i] = static_cast<int>(clamp(floorf(low), 0.0f, last));
      upper_[i] = static_cast<int>(clamp(floorf(high), 0.0f, last));
    }
    if (fabsf(n[w_]) > 0.0f) slope_ = {-n[u_] / n[w_], -n[v_] / n[w_]};
    // The normal of a sliver is rounded; how far its plane misses the vertices says by how much.
    const float miss = max(fabsf(plane(t.b) - t.b[w_]), fabsf(plane(t.c) - t.c[w_]));
    reach_ = 0.5f * (fabsf(slope_.x) + fabsf(slope_.y)) + miss + 4.0f * touch_tolerance;
  }

  /// The columns of the triangle's box.
  WFPG_HD column_box box() const {
    return {w_, glm::uvec2(lower_[u_], lower_[v_]), glm::uvec2(upper_[u_], upper_[v_])};
  }

  /// The voxels of a column that the triangle touches: one run, since triangle and column are convex. `box`
  /// runs along the same axis; who calls twice may get two answers where a compiler fuses operations.
  WFPG_HD voxel_run run(const column_box& box, glm::uvec2 column) const {
    int first, last;
    plane_range(column, first, last);
    voxel_run found;
    for (int along = first; along <= last; ++along) {
      const auto at = static_cast<std::uint32_t>(along);
      const grid_triangle local = triangle_.relative_to(vec3(box.voxel(column, at)) + 0.5f);
      if (!overlaps_cube(local, normal_, 0.5f + touch_tolerance)) continue;
      if (found.count == 0) found.first = at;
      found.count = at - found.first + 1;
    }
    return found;
  }

 private:
  WFPG_HD float plane(vec3 p) const {
    return triangle_.a[w_] + slope_.x * (p[u_] - triangle_.a[u_]) + slope_.y * (p[v_] - triangle_.a[v_]);
  }

  WFPG_HD void plane_range(glm::uvec2 column, int& first, int& last) const {
    vec3 centre(0.0f);
    centre[u_] = static_cast<float>(column.x) + 0.5f;
    centre[v_] = static_cast<float>(column.y) + 0.5f;
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
