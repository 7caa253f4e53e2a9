// Piecewise-constant sampling of a square grid of cells, and of directions through the octahedral map (paper,
// section 3.5; thesis, section 4.4.2).
//
// A distribution is integer weights, stored as inclusive sums: the sums inside each row, and the sums of
// whole rows. A search among the rows' sums finds the row; they fit in a cache line or two. A second search
// inside the row finds the cell. A cell's weight is the difference of neighbouring sums. Sums of integers are
// exact in any order. A sampler and its density therefore agree to the bit on every policy and warp width.
//
// Memory: 4 (F² + F) bytes for F² cells. Sampling: two searches, O(log F). Density: O(1).
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/prefix_search.hpp>
#include <wfpg/base/types.hpp>

namespace wfpg {

namespace detail {

/// Where a number fell among inclusive sums.
struct sums_position {
  std::uint32_t index = 0;  ///< the entry
  std::uint32_t width = 0;  ///< the entry's own number, the difference of its sum and the one before
  float fraction = 0.0f;    ///< how far into the entry, in [0, 1]; it may round to 1
};

/// Finds the first of n inclusive integer sums that exceeds `before` + u `total`, for u in [0, 1). The entry
/// found has a positive width. O(log n). `sums(i)` is called for i in [0, n - 1) alone. `before` is the sum
/// before the first entry; the last sum is `before` + `total`. Precondition: `total` is positive.
template <class Sums>
WFPG_HD sums_position find_in_sums(const Sums& sums, std::uint32_t n, std::uint32_t before,
                                   std::uint32_t total, float u) {
  // Fixed point: the upper bits of the product choose the entry, its lower 24 bits say how far into it. u has
  // 24 bits, so nothing is rounded.
  const auto scaled = static_cast<std::uint64_t>(u * 0x1p24f) * total;
  const std::uint32_t target = before + min(static_cast<std::uint32_t>(scaled >> 24), total - 1u);
  const auto found = search_prefix(sums, n, before, before + total, target);
  const float rest = static_cast<float>(scaled & 0xffffffu) * 0x1p-24f;
  const std::uint32_t width = found.end - found.begin;
  return {found.index, width, (static_cast<float>(target - found.begin) + rest) / static_cast<float>(width)};
}

/// Finds an entry among few whose widths are known and their sums are not. `widths(i)`: weight of entry i;
/// they sum to `total`, which is positive. u is in [0, 1). O(entries).
template <class Widths>
WFPG_HD sums_position find_in_widths(const Widths& widths, std::uint32_t total, float u) {
  const auto scaled = static_cast<std::uint64_t>(u * 0x1p24f) * total;
  const std::uint32_t target = min(static_cast<std::uint32_t>(scaled >> 24), total - 1u);
  // A linear search: a block has few rows, and each width costs two reads.
  std::uint32_t i = 0, before = 0, width = widths(0);
  while (target - before >= width) {
    before += width;
    width = widths(++i);
  }
  const float rest = static_cast<float>(scaled & 0xffffffu) * 0x1p-24f;
  return {i, width, (static_cast<float>(target - before) + rest) / static_cast<float>(width)};
}

/// Moves a place in a cell, in [0, 1], at least 2⁻¹⁴ away from the cell's faces. Rounding moves a point less
/// than that on the way to a direction and back. A density thus finds the cell that was drawn.
WFPG_HD inline float inside_cell(float fraction) {
  return clamp(fraction, 0x1p-14f, 1.0f - 0x1p-14f);
}

}  // namespace detail

/// A square block of a grid's cells: columns [x, x + side) and rows [y, y + side).
struct cell_block {
  std::uint32_t x = 0;     ///< the first column
  std::uint32_t y = 0;     ///< the first row
  std::uint32_t side = 1;  ///< number of columns and of rows, at least 1
};

/// A probability density over [0,1)², constant in each of F x F cells. It refers to memory that must outlive
/// it.
class grid_distribution {
 public:
  /// No cells: resolution() is 0, and nothing can be drawn.
  grid_distribution() = default;
  /// Distribution over sums that are already built, as build_distribution() makes them. `resolution` is F.
  /// `sums` has words(F) entries:
  /// - F² entries, row by row: entry (x, y) is the sum of row y's cells 0 to x
  /// - F entries: entry y is the sum of rows 0 to y
  WFPG_HD grid_distribution(const std::uint32_t* sums, std::uint32_t resolution)
      : sums_(sums), resolution_(resolution) {}

  /// Number of 32-bit words of a distribution over F x F cells: F² + F.
  WFPG_HD static constexpr std::uint32_t words(std::uint32_t resolution) {
    return resolution * resolution + resolution;
  }

  /// F, the number of cells along a side; 0 for a default-constructed distribution.
  WFPG_HD std::uint32_t resolution() const { return resolution_; }
  /// Sum of all cells. Precondition: not default-constructed.
  WFPG_HD std::uint32_t total() const { return rows()[resolution_ - 1]; }
  /// Sum of the cells of a block that lies inside the grid. O(side).
  WFPG_HD std::uint32_t weight(const cell_block& b) const {
    std::uint32_t sum = 0;
    for (std::uint32_t y = b.y; y < b.y + b.side; ++y) sum += weight_in_row(b, y);
    return sum;
  }
  /// Weight of the cell in column x and row y, both below F. O(1): the difference of two sums.
  WFPG_HD std::uint32_t weight(std::uint32_t x, std::uint32_t y) const { return prefix(x, y) - before(x, y); }
  /// Sum of row y's cells 0 to x. One read.
  WFPG_HD std::uint32_t prefix(std::uint32_t x, std::uint32_t y) const { return sums_[y * resolution_ + x]; }

  /// Draws a point of [0,1)² from u in [0,1)². Inside a row it is monotone in each coordinate: stratified u
  /// stay stratified. O(log F).
  WFPG_HD vec2 sample(vec2 u) const {
    float density;
    return sample(u, density);
  }
  /// Draws a point and sets `density` to its pdf(). The density is that of the cell in which the search
  /// ended.
  WFPG_HD vec2 sample(vec2 u, float& density) const {
    const auto row =
        detail::find_in_sums([&](std::uint32_t i) { return rows()[i]; }, resolution_, 0, total(), u.y);
    std::uint32_t weight;
    const vec2 point = sample_in_row({0, 0, resolution_}, row, u.x, weight);
    density = density_of(weight);
    return point;
  }
  /// Draws a point of a block in proportion to its cells' weights. `whole`: the block's weight(), which is
  /// positive. Sets `weight` to that of the cell in which the point lies. O(side).
  WFPG_HD vec2 sample(const cell_block& b, std::uint32_t whole, vec2 u, std::uint32_t& weight) const {
    const auto row =
        detail::find_in_widths([&](std::uint32_t i) { return weight_in_row(b, b.y + i); }, whole, u.y);
    return sample_in_row(b, row, u.x, weight);
  }

  /// Index in [0, F) of the cell, along one side of the square, that holds a coordinate in [0, 1].
  /// Coordinates below 0 give the first cell; those above 1, and NaN, give the last.
  WFPG_HD std::uint32_t cell_along(float coordinate) const {
    const auto end = static_cast<float>(resolution_);
    const float along = coordinate * end;
    if (is_in_range(along, end)) return static_cast<std::uint32_t>(along);
    return along < 0.0f ? 0u : resolution_ - 1u;
  }
  /// Row-major index, in [0, F²), of the cell that holds a point of [0,1]². Other points give a cell at the
  /// border, as cell_along() does.
  WFPG_HD std::uint32_t cell_of(vec2 uv) const { return cell_along(uv.y) * resolution_ + cell_along(uv.x); }
  /// Density at a point of [0,1]², per unit of the square's area. Its mean over the square is 1.
  WFPG_HD float pdf(vec2 uv) const { return density_of(weight(cell_along(uv.x), cell_along(uv.y))); }

 private:
  /// The F sums of rows, behind those of the cells.
  WFPG_HD const std::uint32_t* rows() const { return sums_ + resolution_ * resolution_; }

  /// Draws a point in the part of a row that lies in a block. `row.index` counts from the block's first row.
  WFPG_HD vec2 sample_in_row(const cell_block& b, const detail::sums_position& row, float u,
                             std::uint32_t& weight) const {
    const std::uint32_t y = b.y + row.index;
    // The block's cells are searched in the sums of the whole row, from the sum left of the block on.
    const auto column = detail::find_in_sums([&](std::uint32_t i) { return prefix(b.x + i, y); }, b.side,
                                             before(b.x, y), row.width, u);
    weight = column.width;
    return vec2{static_cast<float>(b.x + column.index) + detail::inside_cell(column.fraction),
                static_cast<float>(y) + detail::inside_cell(row.fraction)} /
           static_cast<float>(resolution_);
  }
  /// Weight of the block's cells in row y.
  WFPG_HD std::uint32_t weight_in_row(const cell_block& b, std::uint32_t y) const {
    return prefix(b.x + b.side - 1, y) - before(b.x, y);
  }
  /// Density in a cell of this weight: weight / total() F².
  WFPG_HD float density_of(std::uint32_t weight) const {
    const auto cells = static_cast<float>(resolution_ * resolution_);
    return static_cast<float>(weight) / static_cast<float>(total()) * cells;
  }
  /// Sum of row y's cells in the columns below x.
  WFPG_HD std::uint32_t before(std::uint32_t x, std::uint32_t y) const {
    return x > 0 ? prefix(x - 1, y) : 0u;
  }

  const std::uint32_t* sums_ = nullptr;  ///< words(F) words, not owned
  std::uint32_t resolution_ = 0;         ///< F
};

/// A probability density over directions: a grid_distribution mapped to the sphere, or to the hemisphere
/// above a normal. The octahedral maps keep areas, so all cells have one solid angle. A default-constructed
/// field is empty: mixtures then draw from the BSDF alone. It refers to the grid's memory.
class directional_field {
 public:
  /// An empty field.
  directional_field() = default;
  /// Field over the whole sphere, in world space.
  WFPG_HD explicit directional_field(const grid_distribution& grid) : grid_(grid) {}
  /// Field over the hemisphere above a unit normal.
  WFPG_HD directional_field(const grid_distribution& grid, vec3 normal)
      : grid_(grid), normal_(normal), hemisphere_(true) {}

  /// Returns true where the field has no cells to draw from.
  WFPG_HD bool empty() const { return grid_.resolution() == 0; }
  /// Returns true where the field covers a hemisphere, false for the sphere.
  WFPG_HD bool hemisphere() const { return hemisphere_; }
  /// Axis of the hemisphere, unit length; zero for fields over the sphere.
  WFPG_HD vec3 normal() const { return normal_; }
  /// The density over the square, before it is mapped to directions.
  WFPG_HD const grid_distribution& grid() const { return grid_; }
  /// GGX roughness from which on a lobe is nearly as wide as a diffuse one. A field knows no BSDF, so
  /// narrower lobes keep a part of their samples (guided_part()).
  WFPG_HD static constexpr float resolved_alpha() { return 0.5f; }
  /// Solid angle of a cell, steradians: domain() / F². Precondition: not empty.
  WFPG_HD float cell_solid_angle() const {
    return domain() / static_cast<float>(grid_.resolution() * grid_.resolution());
  }

  /// The unit direction to which a point of the square is mapped.
  WFPG_HD vec3 direction(vec2 uv) const {
    return hemisphere_ ? basis().to_world(square_to_hemisphere(uv)) : square_to_sphere(uv);
  }

  /// Draws a unit direction from u in [0,1)². Precondition: the field is not empty.
  WFPG_HD vec3 sample(vec2 u) const { return direction(grid_.sample(u)); }
  /// Draws a unit direction and sets `density` to its pdf(), per steradian. The density costs no second
  /// search.
  WFPG_HD vec3 sample(vec2 u, float& density) const {
    const vec2 uv = grid_.sample(u, density);
    density /= domain();
    return direction(uv);
  }

  /// Density of a unit direction, per steradian; 0 outside the hemisphere. Precondition: there are cells.
  WFPG_HD float pdf(vec3 d) const {
    vec2 uv;
    return locate(d, uv) ? grid_.pdf(uv) / domain() : 0.0f;
  }

  /// Finds the point of the square that direction() maps to a unit direction. Returns false outside the
  /// hemisphere.
  WFPG_HD bool locate(vec3 d, vec2& uv) const {
    if (!hemisphere_) {
      uv = sphere_to_square(d);
      return true;
    }
    vec3 local = basis().to_local(d);
    // A direction that sample() draws at the horizon may round to slightly below it.
    if (local.z < -1.0e-5f) return false;
    local.z = max(local.z, 0.0f);
    uv = hemisphere_to_square(local);
    return true;
  }

  /// Solid angle of all cells, steradians: 2π for a hemisphere, 4π for the sphere.
  WFPG_HD float domain() const { return hemisphere_ ? 2.0f * pi : 4.0f * pi; }
  /// Turns a direction of square_to_hemisphere() or square_to_sphere() into world space.
  WFPG_HD vec3 to_world(vec3 local) const { return hemisphere_ ? basis().to_world(local) : local; }

 private:
  // Made where it is used: a ray that holds only the normal while it draws needs fewer registers.
  WFPG_HD frame basis() const { return frame(normal_); }

  grid_distribution grid_;   ///< density over the square
  vec3 normal_{0.0f};        ///< axis of the hemisphere, or zero
  bool hemisphere_ = false;  ///< which of the two maps directions use
};

/// Cells whose values and weights share memory: 32-bit words that hold a float first and an integer later.
struct cell_words {
  /// words(F) words, in memory that all threads of the block reach.
  std::uint32_t* words = nullptr;

  /// Value of cell i, while the words hold floats.
  WFPG_HD float get(int i) const { return bits_float(words[i]); }
  /// Stores a cell's value as a float.
  WFPG_HD void set(int i, float value) const { words[i] = float_bits(value); }
};

/// Turns F² cell values into a distribution, in place. Values are non-negative and finite; their sum is below
/// 3e38. `cells` has grid_distribution::words(F) words, which the result refers to. A floor is added to each
/// cell: `absolute` plus `relative` times the values' mean. Where values and floor sum to less than 1e-25,
/// the distribution is uniform. A cell with a positive value keeps a weight of at least 1. All threads of
/// `block` call it together. O(F²) work; block.sync() is called before it returns.
template <class Block>
WFPG_HD grid_distribution build_distribution(const Block& block, const cell_words& cells, int resolution,
                                             float absolute, float relative = 0.0f) {
  const int n = resolution * resolution;
  const float sum = block.sum(n, [&](int i) { return cells.get(i); });
  const float floor = absolute + relative * sum / static_cast<float>(n);
  const float total = sum + floor * static_cast<float>(n);
  // Weights sum to 2³¹ and some rounding, which stays below 2³².
  const float scale = total > 1.0e-25f ? 0x1p31f / total : 0.0f;
  // Values become weights: no positive value is rounded to 0, since it would never be drawn.
  block.for_each(n, [&](int i) {
    const float value = cells.get(i) + floor;
    const auto weight = static_cast<std::uint32_t>(min(value * scale, 0x1p31f));
    cells.words[i] = scale > 0.0f ? (value > 0.0f ? max(weight, 1u) : 0u) : 1u;
  });
  block.sync();
  // A warp turns each row into inclusive sums.
  block.for_each_warp(resolution, [&](const auto& warp, int y) {
    std::uint32_t* const row = cells.words + y * resolution;
    warp.inclusive_scan(resolution, row, [&](int x) { return row[x]; });
  });
  block.sync();
  // The rows' last sums, summed in turn, choose among rows.
  block.for_each_warp(1, [&](const auto& warp, int) {
    warp.inclusive_scan(resolution, cells.words + n,
                        [&](int y) { return cells.words[(y + 1) * resolution - 1]; });
  });
  block.sync();
  return {cells.words, static_cast<std::uint32_t>(resolution)};
}

}  // namespace wfpg
