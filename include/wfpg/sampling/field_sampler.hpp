// Piecewise-constant sampling of a square grid of cells, and of directions through the octahedral map (paper,
// section 3.5; thesis, section 4.4.2). A distribution is integer weights as sums: of each row's cells up to
// each, and of rows up to each. A row is found among the second, which lie in a cache line or two, a cell in
// its row; a cell's weight is the difference of neighbours. Sums of integers are exact in any order, so a
// sampler and its density agree to the bit on every policy and warp width.
//
// Memory: 4 (F² + F) bytes for F² cells. Sampling: two searches, O(log F). Density: O(1).
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>

namespace wfpg {

namespace detail {

/// Where a number fell among inclusive sums: the entry, its width, and how far into it, in [0,1]: it may
/// round to 1.
struct sums_position {
  std::uint32_t index = 0;
  std::uint32_t width = 0;
  float fraction = 0.0f;
};

/// The first of n inclusive sums, of integers, that exceeds `before` plus u times their whole, u in [0,1); it
/// has a width then. sums(i) for i in [0, n - 1); the last is `before`, from which they begin, plus `total`,
/// which is positive.
template <class Sums>
WFPG_HD sums_position find_in_sums(const Sums& sums, std::uint32_t n, std::uint32_t before,
                                   std::uint32_t total, float u) {
  const auto scaled = static_cast<std::uint64_t>(u * 0x1p24f) * total;  // exact: u has 24 bits
  const std::uint32_t target = before + min(static_cast<std::uint32_t>(scaled >> 24), total - 1u);
  // The entry is one of `size` from `low` on: `before` is the sum before them, `through` that with them.
  std::uint32_t low = 0, through = before + total;
  for (std::uint32_t size = n; size > 1;) {
    const std::uint32_t half = size / 2, sum = sums(low + half - 1);
    const bool above = sum > target;
    low += above ? 0 : half;
    size = above ? half : size - half;
    before = above ? before : sum;
    through = above ? sum : through;
  }
  const float rest = static_cast<float>(scaled & 0xffffffu) * 0x1p-24f;
  const std::uint32_t width = through - before;
  return {low, width, (static_cast<float>(target - before) + rest) / static_cast<float>(width)};
}

/// The same among few, of which widths(i) are known and not their sums.
template <class Widths>
WFPG_HD sums_position find_in_widths(const Widths& widths, std::uint32_t total, float u) {
  const auto scaled = static_cast<std::uint64_t>(u * 0x1p24f) * total;
  const std::uint32_t target = min(static_cast<std::uint32_t>(scaled >> 24), total - 1u);
  std::uint32_t i = 0, before = 0, width = widths(0);
  while (target - before >= width) {
    before += width;
    width = widths(++i);
  }
  const float rest = static_cast<float>(scaled & 0xffffffu) * 0x1p-24f;
  return {i, width, (static_cast<float>(target - before) + rest) / static_cast<float>(width)};
}

/// A place inside a cell off its faces by more than rounding moves a point to a direction and back, so that a
/// density finds the cell that was drawn.
WFPG_HD inline float inside_cell(float fraction) {
  return clamp(fraction, 0x1p-14f, 1.0f - 0x1p-14f);
}

}  // namespace detail

/// Cells of a grid: columns [x, x + side) and rows [y, y + side).
struct cell_block {
  std::uint32_t x = 0;     ///< the first column
  std::uint32_t y = 0;     ///< the first row
  std::uint32_t side = 1;  ///< columns, and rows
};

/// A density over [0,1)², constant in each of F x F cells.
class grid_distribution {
 public:
  grid_distribution() = default;
  /// `sums`: words(F) of them. First F², row by row: entry (x, y) is the sum of row y's cells 0 to x. Then F:
  /// entry y is the sum of rows 0 to y.
  WFPG_HD grid_distribution(const std::uint32_t* sums, std::uint32_t resolution)
      : sums_(sums), resolution_(resolution) {}

  /// Words of a distribution over F x F cells.
  WFPG_HD static constexpr std::uint32_t words(std::uint32_t resolution) {
    return resolution * resolution + resolution;
  }

  /// F, cells along a side; 0 of a default one.
  WFPG_HD std::uint32_t resolution() const { return resolution_; }
  /// The sum of all cells. Precondition: not a default one.
  WFPG_HD std::uint32_t total() const { return rows()[resolution_ - 1]; }
  /// The sum of a block's cells. O(side).
  WFPG_HD std::uint32_t weight(const cell_block& b) const {
    std::uint32_t sum = 0;
    for (std::uint32_t y = b.y; y < b.y + b.side; ++y) sum += weight_in_row(b, y);
    return sum;
  }
  /// The weight of one cell.
  WFPG_HD std::uint32_t weight(std::uint32_t x, std::uint32_t y) const {
    return through(x, y) - before(x, y);
  }
  /// The sum of row y's cells 0 to x.
  WFPG_HD std::uint32_t through(std::uint32_t x, std::uint32_t y) const { return sums_[y * resolution_ + x]; }

  /// A point of [0,1)² from u in [0,1)². Monotone in each coordinate inside a row: stratified u stay
  /// stratified.
  WFPG_HD vec2 sample(vec2 u) const {
    float density;
    return sample(u, density);
  }
  /// The same, and pdf() of the point: of the cell that the search ended in.
  WFPG_HD vec2 sample(vec2 u, float& density) const {
    const auto row =
        detail::find_in_sums([&](std::uint32_t i) { return rows()[i]; }, resolution_, 0, total(), u.y);
    std::uint32_t weight;
    const vec2 point = sample_in_row({0, 0, resolution_}, row, u.x, weight);
    density = density_of(weight);
    return point;
  }
  /// A point of a block, as its cells' weights have it, and the weight of the cell that it lies in. O(side).
  /// `whole`: the block's weight, which is positive.
  WFPG_HD vec2 sample(const cell_block& b, std::uint32_t whole, vec2 u, std::uint32_t& weight) const {
    const auto row =
        detail::find_in_widths([&](std::uint32_t i) { return weight_in_row(b, b.y + i); }, whole, u.y);
    return sample_in_row(b, row, u.x, weight);
  }

  /// The cell along one side of the square that a coordinate in [0,1] lies in; of any other, too, one of
  /// them.
  WFPG_HD std::uint32_t cell_along(float coordinate) const {
    const auto end = static_cast<float>(resolution_);
    const float along = coordinate * end;
    if (is_in_range(along, end)) return static_cast<std::uint32_t>(along);
    return along < 0.0f ? 0u : resolution_ - 1u;
  }
  /// The density at a point, per unit of the square's area.
  WFPG_HD float pdf(vec2 uv) const { return density_of(weight(cell_along(uv.x), cell_along(uv.y))); }

 private:
  WFPG_HD const std::uint32_t* rows() const { return sums_ + resolution_ * resolution_; }

  /// In the part of a row that lies in a block.
  WFPG_HD vec2 sample_in_row(const cell_block& b, const detail::sums_position& row, float u,
                             std::uint32_t& weight) const {
    const std::uint32_t y = b.y + row.index;
    const auto column = detail::find_in_sums([&](std::uint32_t i) { return through(b.x + i, y); }, b.side,
                                             before(b.x, y), row.width, u);
    weight = column.width;
    return vec2{static_cast<float>(b.x + column.index) + detail::inside_cell(column.fraction),
                static_cast<float>(y) + detail::inside_cell(row.fraction)} /
           static_cast<float>(resolution_);
  }
  WFPG_HD std::uint32_t weight_in_row(const cell_block& b, std::uint32_t y) const {
    return through(b.x + b.side - 1, y) - before(b.x, y);
  }
  /// In a cell.
  WFPG_HD float density_of(std::uint32_t weight) const {
    const auto cells = static_cast<float>(resolution_ * resolution_);
    return static_cast<float>(weight) / static_cast<float>(total()) * cells;
  }
  /// The sum of row y's first x cells.
  WFPG_HD std::uint32_t before(std::uint32_t x, std::uint32_t y) const {
    return x > 0 ? through(x - 1, y) : 0u;
  }

  const std::uint32_t* sums_ = nullptr;
  std::uint32_t resolution_ = 0;
};

/// A density over directions: a grid_distribution over the sphere, or over the hemisphere above a normal. A
/// default one is empty and guides nothing.
class directional_field {
 public:
  directional_field() = default;
  /// Over the whole sphere.
  WFPG_HD explicit directional_field(const grid_distribution& grid) : grid_(grid) {}
  /// Over the hemisphere above a unit normal.
  WFPG_HD directional_field(const grid_distribution& grid, vec3 normal)
      : grid_(grid), normal_(normal), hemisphere_(true) {}

  /// Whether there is nothing to draw from.
  WFPG_HD bool empty() const { return grid_.resolution() == 0; }
  /// Whether it covers a hemisphere; else the sphere.
  WFPG_HD bool hemisphere() const { return hemisphere_; }
  /// Of the hemisphere.
  WFPG_HD vec3 normal() const { return normal_; }
  /// The distribution over the square.
  WFPG_HD const grid_distribution& grid() const { return grid_; }
  /// The GGX roughness from which on a lobe is nearly as wide as a diffuse one: a field knows no BSDF.
  WFPG_HD static constexpr float resolved_alpha() { return 0.5f; }
  /// Solid angle of a cell, steradians.
  WFPG_HD float cell_solid_angle() const {
    return domain() / static_cast<float>(grid_.resolution() * grid_.resolution());
  }

  /// The unit direction of a point of the square.
  WFPG_HD vec3 direction(vec2 uv) const {
    return hemisphere_ ? basis().to_world(square_to_hemisphere(uv)) : square_to_sphere(uv);
  }

  /// A unit direction from u in [0,1)². Precondition: not empty.
  WFPG_HD vec3 sample(vec2 u) const { return direction(grid_.sample(u)); }
  /// The same, and pdf() of the direction.
  WFPG_HD vec3 sample(vec2 u, float& density) const {
    const vec2 uv = grid_.sample(u, density);
    density /= domain();
    return direction(uv);
  }

  /// The density of a unit direction, per steradian; 0 outside the hemisphere. Precondition: not empty.
  WFPG_HD float pdf(vec3 d) const {
    vec2 uv;
    return locate(d, uv) ? grid_.pdf(uv) / domain() : 0.0f;
  }

  /// The point of the square that a unit direction comes from; false outside the hemisphere.
  WFPG_HD bool locate(vec3 d, vec2& uv) const {
    if (!hemisphere_) {
      uv = sphere_to_square(d);
      return true;
    }
    vec3 local = basis().to_local(d);
    if (local.z < -1.0e-5f) return false;  // what sample() draws at the horizon may round to below it
    local.z = max(local.z, 0.0f);
    uv = hemisphere_to_square(local);
    return true;
  }

  /// Solid angle of all cells, steradians.
  WFPG_HD float domain() const { return hemisphere_ ? 2.0f * pi : 4.0f * pi; }
  /// A direction of square_to_hemisphere or square_to_sphere, in the world.
  WFPG_HD vec3 to_world(vec3 local) const { return hemisphere_ ? basis().to_world(local) : local; }

 private:
  // Made where it is used: the ray that holds a normal while it draws needs fewer registers.
  WFPG_HD frame basis() const { return frame(normal_); }

  grid_distribution grid_;
  vec3 normal_{0.0f};
  bool hemisphere_ = false;
};

/// Cell values and what becomes of them share memory: 32-bit words that hold a float first and an integer
/// later.
struct cell_words {
  std::uint32_t* words = nullptr;

  WFPG_HD float get(int i) const { return bits_float(words[i]); }
  WFPG_HD void set(int i, float value) const { words[i] = float_bits(value); }
};

/// Turns F² non-negative finite cell values, each plus a floor, into a distribution in place, of
/// grid_distribution::words(F). The floor is `absolute`, and `relative` times the values' mean. All of it
/// zero (the sum below 1e-25): uniform. The values' sum is below 3e38.
template <class Block>
WFPG_HD grid_distribution build_distribution(const Block& block, const cell_words& cells, int resolution,
                                             float absolute, float relative = 0.0f) {
  const int n = resolution * resolution;
  const float sum = block.sum(n, [&](int i) { return cells.get(i); });
  const float floor = absolute + relative * sum / static_cast<float>(n);
  const float total = sum + floor * static_cast<float>(n);
  // Weights sum to 2³¹ and some rounding, below 2³².
  const float scale = total > 1.0e-25f ? 0x1p31f / total : 0.0f;
  block.for_each(n, [&](int i) {
    const float value = cells.get(i) + floor;
    const auto weight = static_cast<std::uint32_t>(min(value * scale, 0x1p31f));
    cells.words[i] = scale > 0.0f ? (value > 0.0f ? max(weight, 1u) : 0u) : 1u;
  });
  block.sync();
  block.for_each_warp(resolution, [&](const auto& warp, int y) {
    std::uint32_t* const row = cells.words + y * resolution;
    warp.inclusive_scan(resolution, row, [&](int x) { return row[x]; });
  });
  block.sync();
  block.for_each_warp(1, [&](const auto& warp, int) {
    warp.inclusive_scan(resolution, cells.words + n,
                        [&](int y) { return cells.words[(y + 1) * resolution - 1]; });
  });
  block.sync();
  return {cells.words, static_cast<std::uint32_t>(resolution)};
}

}  // namespace wfpg
