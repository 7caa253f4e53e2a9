// Implementation of voxelizer.hpp. Triangles are divided into items of equal work. One kernel finds the
// items' voxels, and another writes them. Each test of a triangle is evaluated once and its result kept,
// since two kernels may round one expression differently.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/sum_prefix.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/octree/triangle_voxel.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <thrust/functional.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/scan.h>
#include <thrust/transform_reduce.h>

#include <vector>

namespace wfpg {
namespace detail {

inline constexpr std::uint32_t largest_resolution = 1u << 12;

/// Throws std::invalid_argument where the resolution is no power of two in [1, 4096].
inline void require_resolution(std::uint32_t resolution) {
  require(resolution >= 1 && resolution <= largest_resolution && (resolution & (resolution - 1)) == 0,
          "octree resolution", resolution, "a power of two in [1, 4096]");
}

/// Counters of a build report in device memory.
enum report_counter : std::uint32_t {
  counter_non_finite,
  counter_out_of_range,
  counter_degenerate,
  counters
};

/// The cube around a box, about half a voxel wider on each side. Axis-aligned walls at the box's faces thus
/// lie in the middle of their voxels. A point gets a cube that is large enough for floats to divide it. An
/// empty box gets the default cube, of side 1.
inline voxel_grid grid_around(const bounds3& box, std::uint32_t resolution) {
  voxel_grid grid;
  grid.resolution = resolution;
  if (box.empty()) return grid;
  const vec3 e = box.extent();
  const vec3 c = box.centre();
  const float magnitude = max(fabsf(c.x), max(fabsf(c.y), fabsf(c.z)));
  const float extent = max(max(e.x, max(e.y, e.z)), max(magnitude * 1.0e-4f, 1.0e-12f));
  grid.side = extent * (1.0f + 1.0f / static_cast<float>(resolution));
  grid.origin = c - 0.5f * grid.side;
  return grid;
}

/// Reads and validates triangles.
struct triangle_reader {
  triangle_mesh_view mesh;
  voxel_grid grid;

  /// Reads triangle i, in world space. Returns false where it is left out; `reason` says why.
  WFPG_HD bool vertices(std::size_t i, grid_triangle& t, report_counter& reason) const {
    const uvec3 index = mesh.triangles[i];
    const std::size_t n = mesh.positions.size();
    reason = counter_out_of_range;
    if (index.x >= n || index.y >= n || index.z >= n) return false;
    t = {mesh.positions[index.x], mesh.positions[index.y], mesh.positions[index.z]};
    reason = counter_non_finite;
    if (!is_valid_position(t.a) || !is_valid_position(t.b) || !is_valid_position(t.c)) return false;
    reason = counter_degenerate;
    const vec3 n_unit = unit_normal(t.a, t.b, t.c);
    return n_unit.x != 0.0f || n_unit.y != 0.0f || n_unit.z != 0.0f;
  }

  /// Reads a triangle that is known to be valid, in world space.
  WFPG_HD grid_triangle checked(std::uint32_t i) const {
    const uvec3 index = mesh.triangles[i];
    return {mesh.positions[index.x], mesh.positions[index.y], mesh.positions[index.z]};
  }

  /// A triangle's vertices in grid units.
  WFPG_HD grid_triangle in_grid(const grid_triangle& t) const {
    return {grid.to_grid(t.a), grid.to_grid(t.b), grid.to_grid(t.c)};
  }
};

/// The box of a valid triangle; an empty box for the others.
struct triangle_bounds {
  triangle_reader reader;
  WFPG_HD bounds3 operator()(std::size_t i) const {
    grid_triangle t{};
    report_counter reason;
    if (!reader.vertices(i, t, reason)) return {};
    return bounds_union()(bounds_union()({t.a, t.a}, {t.b, t.b}), {t.c, t.c});
  }
};

/// Columns of one item of work. Triangles are divided into such items, so that a large wall does not occupy
/// one thread while others wait.
inline constexpr std::uint64_t columns_per_item = 16;

/// Counts the items of each triangle, and stores its box and normal. Invalid triangles get no items, and are
/// counted by reason.
struct count_items {
  triangle_reader reader;
  array_view<column_box> boxes;       // a triangle
  array_view<std::uint32_t> normals;  // a triangle: packed
  array_view<std::uint64_t> items;    // a triangle
  std::uint32_t* counters;

  WFPG_HD void operator()(std::size_t i) const {
    grid_triangle t{};
    report_counter reason;
    items[i] = 0;
    if (!reader.vertices(i, t, reason)) {
      atomic_add(counters + reason, 1);
      return;
    }
    normals[i] = pack_direction(unit_normal(t.a, t.b, t.c));
    t = reader.in_grid(t);
    const column_box box = triangle_columns(t, reader.grid.resolution, column_axis(t)).box();
    boxes[i] = box;
    items[i] = (box.count() + columns_per_item - 1) / columns_per_item;
  }
};

/// Writes each triangle's number at its first item. A running maximum then gives each item its triangle.
struct mark_first_items {
  array_view<const std::uint64_t> items_prefix;  // a triangle
  std::uint32_t* triangles;                      // an item
  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t first = i > 0 ? items_prefix[i - 1] : 0;
    if (items_prefix[i] > first) triangles[first] = static_cast<std::uint32_t>(i);
  }
};

/// The columns of one item of work, and the run of voxels that was found in each.
struct item_columns {
  array_view<const column_box> boxes;            // a triangle
  array_view<const std::uint64_t> items_prefix;  // a triangle: the items up to and with its own
  array_view<const std::uint32_t> triangles;     // an item
  std::uint32_t* runs;  // a column and item: packed; items side by side, so that threads write in a row

  /// f(column, run) for each column.
  template <class F>
  WFPG_HD void for_each(std::size_t item, const column_box& box, F f) const {
    const std::uint32_t triangle = triangles[item];
    const std::uint64_t first = (item - (triangle > 0 ? items_prefix[triangle - 1] : 0)) * columns_per_item;
    const std::uint64_t n = min(columns_per_item, box.count() - first);
    for (std::uint64_t c = 0; c < n; ++c) f(box.column(first + c), runs[c * triangles.size() + item]);
  }
};

/// Decides which voxels the triangles touch: a run in each column of an item, and the item's number of
/// voxels.
struct find_runs {
  triangle_reader reader;
  item_columns columns;
  array_view<std::uint64_t> counts;  // an item: its voxels

  WFPG_HD void operator()(std::size_t item) const {
    const std::uint32_t triangle = columns.triangles[item];
    const column_box box = columns.boxes[triangle];
    const triangle_columns found(reader.in_grid(reader.checked(triangle)), reader.grid.resolution,
                                 box.axis());
    std::uint64_t n = 0;
    columns.for_each(item, box, [&](glm::uvec2 column, std::uint32_t& packed) {
      const voxel_run run = found.run(box, column);
      packed = run.first | run.count << 16;
      n += run.count;
    });
    counts[item] = n;
  }
};

/// Writes the codes of fragments. Their triangle's number is stored in place of the normal, for
/// measure_fragments.
struct emit_fragments {
  item_columns columns;
  array_view<const std::uint64_t> fragments_prefix;
  array_view<morton_code> codes;
  array_view<fragment_surface> surfaces;

  WFPG_HD void operator()(std::size_t item) const {
    const std::uint32_t triangle = columns.triangles[item];
    const column_box box = columns.boxes[triangle];
    std::uint64_t at = item ? fragments_prefix[item - 1] : 0;
    columns.for_each(item, box, [&](glm::uvec2 column, std::uint32_t packed) {
      const std::uint32_t first = packed & 0xffffu, end = first + (packed >> 16);
      for (std::uint32_t along = first; along < end; ++along, ++at) {
        codes[at] = morton_encode(box.voxel(column, along));
        surfaces[at].normal = triangle;
      }
    });
  }
};

/// Computes the area of each fragment, and gives it its triangle's normal. Clipping takes longer than finding
/// the voxels, so it has a loop of its own, in which all threads clip.
struct measure_fragments {
  triangle_reader reader;
  array_view<const std::uint32_t> normals;  // a triangle: packed
  array_view<const morton_code> codes;
  array_view<fragment_surface> surfaces;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t triangle = surfaces[i].normal;
    const grid_triangle t = reader.in_grid(reader.checked(triangle));
    const vec3 centre = vec3(morton_decode(codes[i])) + 0.5f;
    const float voxel = reader.grid.voxel_size();
    surfaces[i] = {normals[triangle], area_inside(t.relative_to(centre)) * voxel * voxel};
  }
};

/// Reads the counters back to the host.
template <class Exec>
build_report read_report(const Exec& exec, const buffer<std::uint32_t, Exec>& counters) {
  const auto host = counters.to_host(exec);
  return {host[counter_non_finite], host[counter_out_of_range], host[counter_degenerate]};
}

/// Throws std::invalid_argument for 2³² - 1 fragments or more.
inline void require_fragment_count(std::uint64_t n) {
  require(n < 0xffffffffull, "number of voxel fragments", n,
          "less than 2^32 - 1: lower the octree resolution");
}

/// Union of the boxes f(i), i in [0, n).
template <class Exec, class F>
bounds3 union_of_boxes(const Exec& exec, std::size_t n, const F& f) {
  const ::thrust::counting_iterator<std::size_t> first(0);
  return ::thrust::transform_reduce(exec.thrust(), first, first + static_cast<std::ptrdiff_t>(n), f,
                                    bounds3{}, bounds_union());
}

/// World-space box around the valid triangles; empty without any.
template <class Exec>
bounds3 bounds_of(const Exec& exec, triangle_mesh_view mesh) {
  return union_of_boxes(exec, mesh.triangles.size(), triangle_bounds{triangle_reader{mesh, {}}});
}

/// The position of a sample as a box; an empty box where it is not valid.
struct sample_bounds {
  array_view<const surface_fragment> samples;
  WFPG_HD bounds3 operator()(std::size_t i) const {
    const vec3 p = samples[i].position;
    return is_valid_position(p) ? bounds3{p, p} : bounds3{};
  }
};

/// Whether a sample's normal and area are those of a surface.
WFPG_HD inline bool is_surface_sample(const surface_fragment& s) {
  const float length = is_finite(s.normal) ? glm::length(s.normal) : 0.0f;
  return is_finite(s.area) && s.area > 0.0f && fabsf(length - 1.0f) < 1.0e-2f;
}

/// Flags the samples that are used (1) and counts the others by reason.
struct check_samples {
  array_view<const surface_fragment> samples;
  voxel_grid grid;
  array_view<std::uint64_t> used;
  std::uint32_t* counters;

  WFPG_HD void operator()(std::size_t i) const {
    const surface_fragment s = samples[i];
    uvec3 voxel;
    used[i] = 0;
    if (!is_valid_position(s.position))
      atomic_add(counters + counter_non_finite, 1);
    else if (!grid.voxel_of(s.position, voxel))
      atomic_add(counters + counter_out_of_range, 1);
    else if (!is_surface_sample(s))
      atomic_add(counters + counter_degenerate, 1);
    else
      used[i] = 1;
  }
};

/// Voxel of a position that was found to be in the grid. Another kernel may round it differently.
WFPG_HD inline uvec3 clamped_voxel(const voxel_grid& grid, vec3 p) {
  return uvec3(glm::clamp(grid.to_grid(p), 0.0f, static_cast<float>(grid.resolution - 1)));
}

/// Writes the fragments of the samples that are used, in the samples' order.
struct emit_samples {
  array_view<const surface_fragment> samples;
  voxel_grid grid;
  array_view<const std::uint64_t> used_prefix;
  array_view<morton_code> codes;
  array_view<fragment_surface> surfaces;

  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t at = i ? used_prefix[i - 1] : 0;
    if (used_prefix[i] == at) return;
    codes[at] = morton_encode(clamped_voxel(grid, samples[i].position));
    surfaces[at] = {pack_direction(glm::normalize(samples[i].normal)), samples[i].area};
  }
};

}  // namespace detail

template <class Exec>
voxel_fragments<Exec> voxelize(const Exec& exec, triangle_mesh_view mesh, std::uint32_t resolution) {
  detail::require_resolution(resolution);
  const std::size_t n = mesh.triangles.size();
  require(n < 0xffffffffull, "number of triangles", n, "less than 2^32 - 1");
  detail::triangle_reader reader{mesh, {}};
  reader.grid = detail::grid_around(detail::bounds_of(exec, mesh), resolution);

  const buffer<std::uint32_t, Exec> counters(exec, std::vector<std::uint32_t>(detail::counters, 0));
  const buffer<detail::column_box, Exec> boxes(exec, n);
  const buffer<std::uint32_t, Exec> normals(exec, n);
  buffer<std::uint64_t, Exec> items(exec, n);
  exec.for_each(n, detail::count_items{reader, boxes.view(), normals.view(), items.view(), counters.data()});
  const std::uint64_t item_count = sum_prefix(exec, items);
  const buffer<std::uint32_t, Exec> triangles(exec, item_count);
  exec.fill_bytes(triangles.data(), 0, triangles.bytes());
  exec.for_each(n, detail::mark_first_items{items.view(), triangles.data()});
  ::thrust::inclusive_scan(exec.thrust(), triangles.data(), triangles.data() + item_count, triangles.data(),
                           ::thrust::maximum<std::uint32_t>());

  const buffer<std::uint32_t, Exec> runs(exec, item_count * detail::columns_per_item);
  const detail::item_columns columns{boxes.view(), items.view(), triangles.view(), runs.data()};
  buffer<std::uint64_t, Exec> counts(exec, item_count);
  exec.for_each(item_count, detail::find_runs{reader, columns, counts.view()});
  const std::uint64_t fragment_count = sum_prefix(exec, counts);
  detail::require_fragment_count(fragment_count);

  voxel_fragments<Exec> result(exec, fragment_count);
  exec.for_each(item_count,
                detail::emit_fragments{columns, counts.view(), result.codes.view(), result.surfaces.view()});
  exec.for_each(fragment_count, detail::measure_fragments{reader, normals.view(), result.codes.view(),
                                                          result.surfaces.view()});
  result.grid = reader.grid;
  result.report = detail::read_report(exec, counters);
  return result;
}

template <class Exec>
voxel_fragments<Exec> fragments_from_samples(const Exec& exec, array_view<const surface_fragment> samples,
                                             std::uint32_t resolution, const bounds3& bounds) {
  detail::require_resolution(resolution);
  const std::size_t n = samples.size();
  detail::require_fragment_count(n);
  const bounds3 box =
      bounds.empty() ? detail::union_of_boxes(exec, n, detail::sample_bounds{samples}) : bounds;
  const voxel_grid grid = detail::grid_around(box, resolution);

  const buffer<std::uint32_t, Exec> counters(exec, std::vector<std::uint32_t>(detail::counters, 0));
  buffer<std::uint64_t, Exec> used(exec, n);
  exec.for_each(n, detail::check_samples{samples, grid, used.view(), counters.data()});
  voxel_fragments<Exec> result(exec, sum_prefix(exec, used));
  exec.for_each(
      n, detail::emit_samples{samples, grid, used.view(), result.codes.view(), result.surfaces.view()});
  result.grid = grid;
  result.report = detail::read_report(exec, counters);
  return result;
}

}  // namespace wfpg
