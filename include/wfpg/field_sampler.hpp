// Piecewise-constant sampling of a square grid of cells, and of directions through the octahedral map (paper,
// section 3.5; thesis, section 4.4.2). A distribution is integer weights: each row's inclusive sums and the
// inclusive sums of the rows. Sums of integers are exact in any order, so a sampler and its density agree to
// the bit on every policy and warp width: a cell's probability is the difference of two entries that the
// sampler searched.
//
// Memory: 4 (F² + F) bytes for F² cells. Sampling: two searches, O(log F). Density: O(1).
#pragma once

#include <wfpg/detail/math.hpp>
#include <wfpg/octahedral_map.hpp>
#include <wfpg/types.hpp>

namespace wfpg {

namespace detail {

/// Where a number fell among inclusive sums: the entry, and how far into its width, in [0,1).
struct sums_position {
  std::uint32_t index = 0;
  float fraction = 0.0f;
};

/// The first of n inclusive sums, of integers, that exceeds `before` plus u times their whole, u in [0,1); it
/// has a width then. sums(i) for i in [0, n); `before` is what sums(0) begins from, less than sums(n - 1).
template <class Sums>
WFPG_HD sums_position find_in_sums(const Sums& sums, std::uint32_t n, std::uint32_t before, float u) {
  const std::uint32_t total = sums(n - 1) - before;
  const auto scaled = static_cast<std::uint64_t>(u * 0x1p24f) * total;  // exact: u has 24 bits
  const std::uint32_t target = before + min(static_cast<std::uint32_t>(scaled >> 24), total - 1u);
  std::uint32_t low = 0;
  for (std::uint32_t size = n; size > 1; size -= size / 2)
    low += sums(low + size / 2 - 1) > target ? 0 : size / 2;
  if (low > 0) before = sums(low - 1);
  const float rest = static_cast<float>(scaled & 0xffffffu) * 0x1p-24f;
  return {low, (static_cast<float>(target - before) + rest) / static_cast<float>(sums(low) - before)};
}

/// A place inside a cell off its faces by more than rounding moves a point to a direction and back, so that a
/// density finds the cell that was drawn.
WFPG_HD inline float inside_cell(float fraction) {
  return clamp(fraction, 0x1p-14f, 1.0f - 0x1p-14f);
}

}  // namespace detail

/// A density over [0,1)², constant in each of F x F cells.
class grid_distribution {
 public:
  grid_distribution() = default;
  /// `rows`: F² inclusive sums, each row from its own beginning; `marginal`: F inclusive sums of the rows'
  /// totals.
  WFPG_HD grid_distribution(const std::uint32_t* rows, const std::uint32_t* marginal,
                            std::uint32_t resolution)
      : rows_(rows), marginal_(marginal), resolution_(resolution) {}

  WFPG_HD std::uint32_t resolution() const { return resolution_; }
  WFPG_HD std::uint32_t total() const { return marginal_[resolution_ - 1]; }
  WFPG_HD std::uint32_t weight(std::uint32_t x, std::uint32_t y) const {
    return width(rows_ + y * resolution_, x);
  }

  /// A point of [0,1)² from u in [0,1)². Monotone in each coordinate inside a row: stratified u stay
  /// stratified.
  WFPG_HD vec2 sample(vec2 u) const {
    float density;
    return sample(u, density);
  }
  /// The same, and pdf() of the point: of the cell that the search ended in.
  WFPG_HD vec2 sample(vec2 u, float& density) const {
    const detail::sums_position row = find(marginal_, u.y);
    const detail::sums_position column = find(rows_ + row.index * resolution_, u.x);
    density = cell_pdf(column.index, row.index);
    return vec2{static_cast<float>(column.index) + detail::inside_cell(column.fraction),
                static_cast<float>(row.index) + detail::inside_cell(row.fraction)} /
           static_cast<float>(resolution_);
  }

  /// The cell along one side of the square that a coordinate in [0,1] lies in.
  WFPG_HD std::uint32_t cell_along(float coordinate) const {
    const auto last = static_cast<float>(resolution_ - 1);
    return static_cast<std::uint32_t>(
        detail::clamp(coordinate * static_cast<float>(resolution_), 0.0f, last));
  }
  /// The sum of the cells of row y up to x.
  WFPG_HD std::uint32_t row_sum(std::uint32_t x, std::uint32_t y) const { return rows_[y * resolution_ + x]; }

  /// The density at a point, per unit of the square's area.
  WFPG_HD float pdf(vec2 uv) const { return cell_pdf(cell_along(uv.x), cell_along(uv.y)); }

 private:
  WFPG_HD float cell_pdf(std::uint32_t x, std::uint32_t y) const {
    const auto cells = static_cast<float>(resolution_ * resolution_);
    return static_cast<float>(weight(x, y)) / static_cast<float>(total()) * cells;
  }
  WFPG_HD static std::uint32_t width(const std::uint32_t* sums, std::uint32_t i) {
    return sums[i] - (i ? sums[i - 1] : 0u);
  }
  WFPG_HD detail::sums_position find(const std::uint32_t* sums, float u) const {
    return detail::find_in_sums([sums](std::uint32_t i) { return sums[i]; }, resolution_, 0, u);
  }

  const std::uint32_t* rows_ = nullptr;
  const std::uint32_t* marginal_ = nullptr;
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
      : grid_(grid), frame_(normal), hemisphere_(true) {}

  WFPG_HD bool empty() const { return grid_.resolution() == 0; }
  WFPG_HD bool hemisphere() const { return hemisphere_; }
  /// Of the hemisphere.
  WFPG_HD vec3 normal() const { return frame_.z; }
  WFPG_HD const grid_distribution& grid() const { return grid_; }
  /// The GGX roughness from which on a lobe is nearly as wide as a diffuse one: a field knows no BSDF.
  WFPG_HD static constexpr float resolved_alpha() { return 0.5f; }
  /// Solid angle of a cell, steradians.
  WFPG_HD float cell_solid_angle() const {
    return domain() / static_cast<float>(grid_.resolution() * grid_.resolution());
  }

  /// The unit direction of a point of the square.
  WFPG_HD vec3 direction(vec2 uv) const {
    return hemisphere_ ? frame_.to_world(square_to_hemisphere(uv)) : square_to_sphere(uv);
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
    vec3 local = frame_.to_local(d);
    if (local.z < -1.0e-5f) return false;  // what sample() draws at the horizon may round to below it
    local.z = detail::max(local.z, 0.0f);
    uv = hemisphere_to_square(local);
    return true;
  }

  /// Solid angle of all cells, steradians.
  WFPG_HD float domain() const { return hemisphere_ ? 2.0f * detail::pi : 4.0f * detail::pi; }
  /// A direction of square_to_hemisphere or square_to_sphere, in the world.
  WFPG_HD vec3 to_world(vec3 local) const { return hemisphere_ ? frame_.to_world(local) : local; }

 private:
  grid_distribution grid_;
  detail::frame frame_;
  bool hemisphere_ = false;
};

namespace detail {

/// Cell values and what becomes of them share memory: 32-bit words that hold a float first and an integer
/// later.
struct cell_words {
  std::uint32_t* words = nullptr;

  WFPG_HD float get(int i) const { return bits_float(words[i]); }
  WFPG_HD void set(int i, float value) const { words[i] = float_bits(value); }
};

/// 4-byte words of a distribution of F² cells.
WFPG_HD constexpr std::size_t distribution_words(std::uint32_t resolution) {
  return std::size_t(resolution) * resolution + resolution;
}

/// sums[i] becomes the sum of value(0) to value(i), for i in [0, n), by one warp; gives the last to all.
/// value(i) may read sums[i].
template <class Warp, class Value>
WFPG_HD std::uint32_t scan_by_warp(const Warp& warp, int n, std::uint32_t* sums, const Value& value) {
  std::uint32_t before = 0;
  for (int first = 0; first < n; first += Warp::width) {
    const auto values =
        warp.map([&](int lane) -> std::uint32_t { return first + lane < n ? value(first + lane) : 0u; });
    const auto through = warp.inclusive_sum(values);
    warp.for_each_lane([&](int lane) {
      if (first + lane < n) sums[first + lane] = before + through[lane];
    });
    before += warp.shuffle(through, Warp::width - 1);
  }
  return before;
}

/// Turns F² non-negative finite cell values, each plus `floor`, into a distribution in place, and the F words
/// behind them into its marginal. All values zero (their sum below 1e-25): uniform. The values' sum is below
/// 3e38.
template <class Block>
WFPG_HD grid_distribution build_distribution(const Block& block, const cell_words& cells, int resolution,
                                             float floor) {
  const int n = resolution * resolution;
  const float total = block.sum(n, [&](int i) { return cells.get(i) + floor; });
  // Weights sum to 2³¹ and some rounding, below 2³².
  const float scale = total > 1.0e-25f ? 0x1p31f / total : 0.0f;
  block.for_each(n, [&](int i) {
    const float value = cells.get(i) + floor;
    const auto weight = static_cast<std::uint32_t>(min(value * scale, 0x1p31f));
    cells.words[i] = scale > 0.0f ? (value > 0.0f ? max(weight, 1u) : 0u) : 1u;
  });
  block.sync();
  std::uint32_t* const marginal = cells.words + n;
  block.for_each_warp(resolution, [&](const auto& warp, int y) {
    std::uint32_t* const row = cells.words + y * resolution;
    const std::uint32_t sum = scan_by_warp(warp, resolution, row, [&](int x) { return row[x]; });
    warp.for_each_lane([&](int lane) {
      if (lane == 0) marginal[y] = sum;
    });
  });
  block.sync();
  block.inclusive_sum(marginal, resolution);
  block.sync();
  return {cells.words, marginal, static_cast<std::uint32_t>(resolution)};
}

}  // namespace detail
}  // namespace wfpg
