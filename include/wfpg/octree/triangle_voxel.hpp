// One triangle against voxels, in grid units: which voxels it touches, and how much of its area lies in one.
// The voxelizer uses it for conservative voxelization (paper, section 3.2; Crassin & Green 2012).
//
// A voxel is the unit cube around its centre. Coordinates are relative to that centre where a function says
// so. Cost: O(columns of the triangle's box + voxels touched) a triangle. No memory.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>

namespace wfpg::detail {

/// Distance from its faces, in voxels, within which a voxel counts as touched. It is above the rounding error
/// of grid coordinates up to 2¹², so no touched voxel is missed.
inline constexpr float touch_tolerance = 0x1p-10f;

/// A triangle whose vertices are in grid units: voxels from the grid's origin, or relative to a point.
struct grid_triangle {
  vec3 a, b, c;  ///< counter-clockwise seen from the outside

  /// The triangle moved so that `p` is the origin.
  WFPG_HD grid_triangle relative_to(vec3 p) const { return {a - p, b - p, c - p}; }
};

/// Cross product with products in double precision. In floats the products cancel. The normal of a long
/// sliver would be tilted by more than the tolerance at the sliver's ends.
WFPG_HD inline vec3 accurate_cross(vec3 a, vec3 b) {
  const auto difference = [](float p, float q, float r, float s) {
    return static_cast<float>(static_cast<double>(p) * q - static_cast<double>(r) * s);
  };
  return {difference(a.y, b.z, a.z, b.y), difference(a.z, b.x, a.x, b.z), difference(a.x, b.y, a.y, b.x)};
}

/// Whether `axis` separates a triangle from the cube of half side `half` about the origin: their projections
/// on it do not overlap. The axis has any length.
WFPG_HD inline bool separates(vec3 axis, const grid_triangle& t, float half) {
  const float a = glm::dot(axis, t.a);
  const float b = glm::dot(axis, t.b);
  const float c = glm::dot(axis, t.c);
  // Half the length of the cube's projection, times the axis's own length.
  const float radius = half * (fabsf(axis.x) + fabsf(axis.y) + fabsf(axis.z));
  return min(a, min(b, c)) > radius || max(a, max(b, c)) < -radius;
}

/// Whether an axis normal to an edge separates the triangle from the cube. The edge's ends project to one
/// point, so one `end` and the third `corner` are enough.
WFPG_HD inline bool separates(vec3 axis, vec3 end, vec3 corner, float half) {
  const float a = glm::dot(axis, end), b = glm::dot(axis, corner);
  const float radius = half * (fabsf(axis.x) + fabsf(axis.y) + fabsf(axis.z));
  return min(a, b) > radius || max(a, b) < -radius;
}

/// Whether the cross product of an edge with one of the cube's three axes separates triangle and cube. `end`:
/// one end of the edge. `corner`: the vertex that is not on it.
WFPG_HD inline bool edge_separates(vec3 edge, vec3 end, vec3 corner, float half) {
  // The edge crossed with x, y and z. Each product is normal to the edge.
  return separates({0.0f, -edge.z, edge.y}, end, corner, half) ||
         separates({edge.z, 0.0f, -edge.x}, end, corner, half) ||
         separates({-edge.y, edge.x, 0.0f}, end, corner, half);
}

/// Whether a triangle overlaps the cube of half side `half` about the origin. Source: separating axes,
/// Akenine-Möller 2001, "Fast 3D Triangle-Box Overlap Testing". `normal`: the triangle's, of any length.
/// Precondition: their boxes overlap, since the cube's own three axes are not tested.
WFPG_HD inline bool overlaps_cube(const grid_triangle& t, vec3 normal, float half) {
  return !separates(normal, t, half) && !edge_separates(t.b - t.a, t.a, t.c, half) &&
         !edge_separates(t.c - t.b, t.b, t.a, half) && !edge_separates(t.a - t.c, t.c, t.b, half);
}

/// Mean of clamp(v, -1/2, 1/2) while v goes evenly from a to b. In [-1/2, 1/2].
WFPG_HD inline float mean_clamped(float a, float b) {
  const float low = min(a, b), high = max(a, b);
  // The three cases in which one part alone is left.
  if (low >= -0.5f && high <= 0.5f) return 0.5f * (low + high);
  if (high <= -0.5f) return -0.5f;
  if (low >= 0.5f) return 0.5f;
  // Three parts: below the range, inside it, and above it.
  const float below = max(-0.5f - low, 0.0f), above = max(high - 0.5f, 0.0f);
  // The part inside has the mean of its ends; the others are constant.
  const float from = max(low, -0.5f), to = min(high, 0.5f);
  return (0.5f * (above - below) + 0.5f * (from + to) * (to - from)) / (high - low);
}

/// Area of a closed polygon inside the unit square about the origin, summed edge by edge. What lies between
/// an edge and a base line, inside the square, counts with the sign of the edge's direction. The polygon is
/// not stored.
struct area_in_square {
  /// Height of the base line. The nearer it is to the polygon, the less of small ones is lost to rounding.
  float base;
  float sum = 0.0f;  ///< signed area so far

  /// Adds the edge from p to q. Edges may come in any order.
  WFPG_HD void edge(vec2 p, vec2 q) {
    // Only the part between the square's left and right sides counts. An end that is not moved keeps its
    // exact height.
    const float from = clamp(p.x, -0.5f, 0.5f), to = clamp(q.x, -0.5f, 0.5f);
    // Outside the square, or along its height, an edge encloses no area.
    if (from == to) return;
    const float slope = (q.y - p.y) / (q.x - p.x);
    const float y_from = from == p.x ? p.y : p.y + slope * (from - p.x);
    const float y_to = to == q.x ? q.y : q.y + slope * (to - q.x);
    sum += (to - from) * (mean_clamped(y_from, y_to) - base);
  }
};

/// One of the two planes that bound a polygon's third coordinate. It remembers where the polygon's edges
/// leave the slab and come back, since the cut makes an edge between those points.
struct bounding_plane {
  float side;                     ///< +1 or -1: the plane is at side / 2
  vec2 enter{0.0f}, leave{0.0f};  ///< where edges come in and go out
  bool crossed = false;           ///< whether any edge crosses the plane

  /// Cuts off the part of the edge from p to q that lies beyond the plane. [begin, end] is the part that is
  /// left, as fractions of the edge; begin < end fails where nothing is left.
  WFPG_HD void cut(vec3 p, vec3 q, float& begin, float& end) {
    const float from = 0.5f - side * p.z, to = 0.5f - side * q.z;  // inside: at least 0
    // Both ends are on one side, so the edge stays whole or is dropped.
    if ((from >= 0.0f) == (to >= 0.0f)) {
      if (from < 0.0f) end = -1.0f;
      return;
    }
    crossed = true;
    // The distance from the plane changes linearly along the edge.
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

/// Axis along which a vector is longest: 0, 1 or 2.
WFPG_HD inline int largest_axis(vec3 v) {
  const float x = fabsf(v.x), y = fabsf(v.y), z = fabsf(v.z);
  return x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
}

/// Whether a triangle covers the unit square about the origin, seen along the third axis. Where a square and
/// an edge nearly touch, rounding decides. `facing`: any number with the sign of its normal's third
/// coordinate.
WFPG_HD inline bool covers_square(const vec3 (&corners)[3], float facing) {
  for (int i = 0; i < 3; ++i) {
    const vec3 p = corners[i], q = corners[i < 2 ? i + 1 : 0];
    // The origin's distance from the edge, times the edge's length. The nearest corner of the square is less
    // far inside, by half of the square's extent across the edge.
    const float inside = p.x * q.y - p.y * q.x;
    if (!((facing > 0.0f ? inside : -inside) >= 0.5f * (fabsf(q.x - p.x) + fabsf(q.y - p.y)))) return false;
  }
  return true;
}

/// Area of a triangle inside the voxel, in square voxels. The triangle is relative to the voxel's centre. It
/// is cut to the voxel's height along its dominant axis. What is left is projected along that axis and cut to
/// the voxel's square.
WFPG_HD inline float area_inside(const grid_triangle& t) {
  const vec3 n = glm::cross(t.b - t.a, t.c - t.a);
  const vec3 farthest = glm::max(glm::abs(t.a), glm::max(glm::abs(t.b), glm::abs(t.c)));
  // A triangle that lies wholly inside needs no cuts.
  if (max(farthest.x, max(farthest.y, farthest.z)) <= 0.5f) return 0.5f * glm::length(n);
  // The projection along the largest component is the largest of three, so dividing by it is safe.
  const int w = largest_axis(n);
  if (!(fabsf(n[w]) > 0.0f)) return 0.0f;
  // Turned so that the dominant axis is the third one.
  const auto turned = [w](vec3 v) { return w == 0 ? vec3(v.y, v.z, v.x) : w == 1 ? vec3(v.z, v.x, v.y) : v; };
  const vec3 corners[3] = {turned(t.a), turned(t.b), turned(t.c)};
  const vec3 normal = turned(n);
  // The projection is smaller than the triangle by the cosine n[w] / |n|.
  const float scale = glm::length(n) / fabsf(normal.z);
  // In most voxels of a large triangle no edge is near, and the plane leaves by the sides. The plane's height
  // at the square's corners differs from that at its middle by at most half of its slopes.
  // Normals of slivers are tilted by rounding. Of the three corners' heights one is then right, or the right
  // one lies between them.
  float height = 0.0f;  // times normal.z
  for (const vec3& corner : corners) height = max(height, fabsf(glm::dot(normal, corner)));
  height += 0.5f * (fabsf(normal.x) + fabsf(normal.y));
  if (height <= 0.5f * fabsf(normal.z) && covers_square(corners, normal.z)) return scale;
  // The base line passes through the first corner, moved into the square.
  area_in_square area{clamp(corners[0].y, -0.5f, 0.5f)};
  bounding_plane upper{1.0f}, lower{-1.0f};
  for (int i = 0; i < 3; ++i) {
    const vec3 p = corners[i], q = corners[i < 2 ? i + 1 : 0];
    float begin = 0.0f, end = 1.0f;
    // Each plane may shorten the edge at either end.
    upper.cut(p, q, begin, end);
    lower.cut(p, q, begin, end);
    if (!(begin < end)) continue;
    const vec2 from(p.x, p.y), to(q.x, q.y);
    area.edge(begin > 0.0f ? from + (to - from) * begin : from, end < 1.0f ? from + (to - from) * end : to);
  }
  // Each plane that cuts the triangle adds one edge to the polygon.
  if (upper.crossed) area.edge(upper.leave, upper.enter);
  if (lower.crossed) area.edge(lower.leave, lower.enter);
  return fabsf(area.sum) * scale;
}

/// Normal of the counter-clockwise side; zero where an edge has no length. Its coordinates are at most 2.
/// Edges are scaled by their largest coordinate first, so no product overflows or vanishes.
WFPG_HD inline vec3 scaled_normal(vec3 a, vec3 b, vec3 c) {
  const vec3 e = b - a;
  const vec3 f = c - a;
  const float size_e = max(fabsf(e.x), max(fabsf(e.y), fabsf(e.z)));
  const float size_f = max(fabsf(f.x), max(fabsf(f.y), fabsf(f.z)));
  if (!(size_e > 0.0f) || !(size_f > 0.0f)) return vec3(0.0f);
  return glm::cross(e / size_e, f / size_f);
}

/// Unit normal of the counter-clockwise side; zero where the triangle has no area, which is relative to its
/// edges.
WFPG_HD inline vec3 unit_normal(vec3 a, vec3 b, vec3 c) {
  const vec3 n = scaled_normal(a, b, c);
  const float length = glm::length(n);
  // The length is relative to the edges', so small triangles are kept and slivers of no width are not.
  return length > 1.0e-12f ? n / length : vec3(0.0f);
}

/// Voxels in a row along an axis; none by default.
struct voxel_run {
  std::uint32_t first = 0;  ///< coordinate of the first one along the axis
  std::uint32_t count = 0;  ///< number of voxels, at most 4096
};

/// The columns of voxels that a triangle's box covers, in row order. It is packed into 8 bytes, since there
/// is one for each triangle. Columns run along axis().
class column_box {
 public:
  /// One column along x, at the origin.
  column_box() = default;
  /// Columns between two corners, both included. Coordinates are along the two axes after `axis`, in cyclic
  /// order, and in [0, 4095].
  WFPG_HD column_box(int axis, glm::uvec2 lower, glm::uvec2 upper)
      : bits_(std::uint64_t(lower.x) | std::uint64_t(lower.y) << 12 | std::uint64_t(upper.x - lower.x) << 24 |
              std::uint64_t(upper.y - lower.y) << 36 |
              std::uint64_t(static_cast<std::uint32_t>(axis)) << 48) {}

  /// Axis of the columns: 0, 1 or 2.
  WFPG_HD int axis() const { return static_cast<int>(bits_ >> 48); }
  /// Number of columns, 1 to 2²⁴.
  WFPG_HD std::uint64_t count() const { return std::uint64_t(width()) * (part(36) + 1); }
  /// Coordinates of column i along the two axes after axis(). Precondition: i < count().
  WFPG_HD glm::uvec2 column(std::uint64_t i) const {
    const auto at = static_cast<std::uint32_t>(i);
    // Row by row, the first of the two axes fastest.
    return {part(0) + at % width(), part(12) + at / width()};
  }
  /// Coordinates of the voxel at `along` in a column, in the order x, y, z.
  WFPG_HD uvec3 voxel(glm::uvec2 column, std::uint32_t along) const {
    const int w = axis();
    // A column is (y, z) along x, (z, x) along y, and (x, y) along z.
    if (w == 0) return {along, column.x, column.y};
    return w == 1 ? uvec3(column.y, along, column.x) : uvec3(column.x, column.y, along);
  }

 private:
  /// 12 of the bits, from `shift` on.
  WFPG_HD std::uint32_t part(int shift) const { return static_cast<std::uint32_t>(bits_ >> shift) & 0xfffu; }
  /// Number of columns in a row.
  WFPG_HD std::uint32_t width() const { return part(24) + 1; }

  /// From the lowest: two least coordinates and two extents of 12 bits each, and the axis.
  std::uint64_t bits_ = 0;
};

/// Axis along which a triangle's normal is longest. Columns along it hold the shortest runs of voxels.
WFPG_HD inline int column_axis(const grid_triangle& t) {
  return largest_axis(glm::cross(t.b - t.a, t.c - t.a));
}

/// Finds the voxels that a triangle touches, in columns along an axis.
class triangle_columns {
 public:
  /// Prepares a triangle in grid units. `resolution`: at most 4096. `axis`: column_axis() of the triangle.
  WFPG_HD triangle_columns(const grid_triangle& t, std::uint32_t resolution, int axis)
      : triangle_(t),
        normal_(accurate_cross(t.b - t.a, t.c - t.b)),
        u_((axis + 1) % 3),
        v_((axis + 2) % 3),
        w_(axis) {
    const vec3 n = glm::cross(t.b - t.a, t.c - t.a);
    // The box of voxels within the tolerance of the triangle's own box, inside the grid.
    for (int i = 0; i < 3; ++i) {
      const float low = min(t.a[i], min(t.b[i], t.c[i])) - touch_tolerance;
      const float high = max(t.a[i], max(t.b[i], t.c[i])) + touch_tolerance;
      const float last = static_cast<float>(resolution - 1);
      lower_[i] = static_cast<int>(clamp(floorf(low), 0.0f, last));
      upper_[i] = static_cast<int>(clamp(floorf(high), 0.0f, last));
    }
    // A triangle without area has no plane: its box alone bounds the runs.
    if (fabsf(n[w_]) > 0.0f) slope_ = {-n[u_] / n[w_], -n[v_] / n[w_]};
    // The normal of a sliver is rounded; how far its plane misses the vertices says by how much.
    const float miss = max(fabsf(plane(flat(t.b)) - t.b[w_]), fabsf(plane(flat(t.c)) - t.c[w_]));
    const float rise = fabsf(slope_.x) + fabsf(slope_.y);  // of the plane, over a voxel
    // The error of the plane, and the tolerance with room for rounding.
    reach_ = 0.5f * rise + miss + 4.0f * touch_tolerance;
    touch_ = touch_tolerance + half_ * rise;
    error_ = miss + 2.0f * touch_tolerance;
    set_edges();
  }

  /// The columns that the triangle's box covers.
  WFPG_HD column_box box() const {
    return {w_, glm::uvec2(lower_[u_], lower_[v_]), glm::uvec2(upper_[u_], upper_[v_])};
  }

  /// Finds the voxels of a column that the triangle touches. They are one run, since triangle and column are
  /// convex. `box` runs along the axis of this object. Evaluate a column once and keep the answer: two calls
  /// may differ where a compiler fuses operations.
  WFPG_HD voxel_run run(const column_box& box, glm::uvec2 column) const {
    const vec2 middle = vec2(column) + 0.5f;
    // Most columns of a large triangle's box lie wholly beside it or inside it. Separating axes are then not
    // needed.
    const placement place = placed(middle);
    if (place == placement::outside) return {};
    const float height = plane(middle), low = height - touch_, high = height + touch_;
    // Inside of it the plane alone tells the run, unless its error decides.
    if (place == placement::inside && voxel_at(low - error_) == voxel_at(low + error_) &&
        voxel_at(high - error_) == voxel_at(high + error_))
      return run_between(voxel_at(low), voxel_at(high));
    // The plane bounds the run before any voxel is tested.
    const int first = max(lower_[w_], voxel_at(height - reach_));
    const int last = min(upper_[w_], voxel_at(height + reach_));
    voxel_run found;
    // The plane's range is a few voxels; each is tested on its own.
    for (int along = first; along <= last; ++along) {
      const auto at = static_cast<std::uint32_t>(along);
      const grid_triangle local = triangle_.relative_to(vec3(box.voxel(column, at)) + 0.5f);
      if (!overlaps_cube(local, normal_, half_)) continue;
      // A gap inside the run can only come from rounding, and is closed.
      if (found.count == 0) found.first = at;
      found.count = at - found.first + 1;
    }
    return found;
  }

 private:
  /// Half the side of a voxel that is larger by the tolerance on each side.
  static constexpr float half_ = 0.5f + touch_tolerance;

  /// Coordinate along the axis at which the triangle's plane passes a point, given by its other two.
  WFPG_HD float plane(vec2 p) const {
    // Linear from the first vertex, with the plane's slopes along the two other axes.
    return triangle_.a[w_] + slope_.x * (p.x - triangle_.a[u_]) + slope_.y * (p.y - triangle_.a[v_]);
  }

  /// Where a column's square, larger by the tolerance, lies as seen along the axis.
  enum class placement {
    outside,  ///< beside the triangle, which touches no voxel of the column
    at_edge,  ///< at an edge, or it is not certain
    inside    ///< inside the triangle: its plane tells which voxels it touches
  };
  /// Where the square around a column's middle lies. Rounding is less than the tolerance.
  WFPG_HD placement placed(vec2 middle) const {
    const vec2 corners[3] = {flat(triangle_.a), flat(triangle_.b), flat(triangle_.c)};
    bool is_inside = true;
    for (int i = 0; i < 3; ++i) {
      // The middle's distance from the edge, positive inside, times the edge's length.
      const vec3 edge = edges_[i];
      const float distance = glm::dot(vec2(edge), middle - corners[i]);
      if (distance < -edge.z) return placement::outside;
      is_inside = is_inside && distance > edge.z;
    }
    return is_inside ? placement::inside : placement::at_edge;
  }
  /// Prepares placed(), for all columns of the triangle. With the wrong sign of its area, a needle's short
  /// edge would face the other way, and leave the whole needle outside. Floats do not tell that sign, nor do
  /// products of rounded edges. Differences in double precision are exact.
  WFPG_HD void set_edges() {
    const glm::dvec2 a(flat(triangle_.a));
    const glm::dvec2 b = glm::dvec2(flat(triangle_.b)) - a, c = glm::dvec2(flat(triangle_.c)) - a;
    const float facing = b.x * c.y - b.y * c.x > 0.0 ? 1.0f : -1.0f;
    const vec2 corners[3] = {flat(triangle_.a), flat(triangle_.b), flat(triangle_.c)};
    for (int i = 0; i < 3; ++i) {
      // The edge turned by a quarter, and half of the square's extent across it.
      const vec2 along = corners[i < 2 ? i + 1 : 0] - corners[i];
      edges_[i] = {-facing * along.y, facing * along.x, half_ * (fabsf(along.x) + fabsf(along.y))};
    }
  }

  /// Voxels of a column from `low` to `high`, both included, that lie in the triangle's box. None where `low`
  /// is above `high`.
  WFPG_HD voxel_run run_between(int low, int high) const {
    const int first = max(lower_[w_], low), last = min(upper_[w_], high);
    if (first > last) return {};
    return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last - first + 1)};
  }

  /// A point's coordinates along u and v.
  WFPG_HD vec2 flat(vec3 p) const { return {p[u_], p[v_]}; }
  /// Coordinate of the voxel that a point lies in, along one axis. The limit keeps the conversion defined for
  /// steep planes.
  WFPG_HD static int voxel_at(float along) { return static_cast<int>(floorf(clamp(along, -1.0e6f, 1.0e6f))); }

  grid_triangle triangle_;   ///< grid units
  vec3 normal_;              ///< of any length
  int u_, v_, w_;            ///< the two axes after the columns' axis, and that axis
  int lower_[3], upper_[3];  ///< voxels of the box, both included
  vec2 slope_{0.0f};         ///< of the plane, along u and v
  float reach_;    ///< how far the plane may be from a voxel that may be touched, at the column's middle
  float touch_;    ///< how far it is at most from one that is touched, where the square is inside
  float error_;    ///< of both
  vec3 edges_[3];  ///< an edge: (u, v) inwards and as long; half of a square's extent along that
};

}  // namespace wfpg::detail
