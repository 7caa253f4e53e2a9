// Smooths a field's cells by a separable Gaussian, in place. At the square's edges it continues as the sphere
// does. Scratch memory holds a few rows alone, so that the cells themselves may fill what a thread block has.
//
// Source: Yalciner and Akyuz (2024), section 4; thesis (2024), Eq. 5.1.
//
// Cost: O(F^2) a field. Memory: scratch_floats() of scratch a block.
#pragma once

#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/sampling/field_sampler.hpp>

namespace wfpg::detail {

/// A normalized Gaussian exp(-x²/alpha²) with `radius` taps on either side. `alpha`: in cells, positive.
struct gaussian_taps {
  static constexpr int radius = 2;
  float weights[radius + 1];

  WFPG_HD explicit gaussian_taps(float alpha) {
    float sum = 0.0f;
    for (int i = 0; i <= radius; ++i) {
      const float x = static_cast<float>(i) / alpha;
      weights[i] = expf(-x * x);
      sum += i ? 2.0f * weights[i] : weights[i];
    }
    for (float& w : weights) w /= sum;
  }

  /// Returns the middle one's new value, of five neighbours.
  WFPG_HD float operator()(float a, float b, float middle, float c, float d) const {
    return weights[0] * middle + weights[1] * (b + c) + weights[2] * (a + d);
  }
};

/// Filters the cells of a square of at least 4 x 4 cells. Over the sphere, a step off an edge comes back on
/// the same edge, mirrored about its middle. Over a hemisphere the horizon mirrors.
class field_filter {
 public:
  WFPG_HD field_filter(const cell_words& cells, int resolution, bool hemisphere, float alpha)
      : cells_(cells), size_(resolution), hemisphere_(hemisphere), taps_(alpha) {}

  /// Floats of scratch memory that a block of `warps` warps needs.
  WFPG_HD static std::size_t scratch_floats(std::uint32_t resolution, int warps) {
    const std::size_t rows = 2 * (std::size_t(resolution) + 2 * radius) * static_cast<std::size_t>(warps);
    const std::size_t columns = 2 * radius * std::size_t(resolution) * segments(resolution);
    return max(rows, columns);
  }

  // Filters rows, then columns. All threads of the block call it.
  template <class Block>
  WFPG_HD void apply(const Block& block, float* scratch) const {
    filter_rows(block, scratch);
    block.sync();
    filter_columns(block, scratch);
    block.sync();
  }

 private:
  static constexpr int radius = gaussian_taps::radius;
  static constexpr int segment = 16;  // rows of a column that one lane filters

  WFPG_HD static std::size_t segments(std::uint32_t resolution) {
    return (resolution + segment - 1) / segment;
  }

  /// Filters row y together with the row that its taps reach over the sphere's edges. A warp copies both
  /// before it changes either.
  template <class Block>
  WFPG_HD void filter_rows(const Block& block, float* scratch) const {
    block.for_each_warp((size_ + 1) / 2, [&](const auto& warp, int y) {
      const int other = size_ - 1 - y;
      float* const a = scratch + 2 * (size_ + 2 * radius) * warp.index() + radius;
      float* const b = a + size_ + 2 * radius;
      warp.for_each(size_, [&](int x) {
        a[x] = cells_.get(y * size_ + x);
        b[x] = cells_.get(other * size_ + x);
      });
      warp.sync();
      pad(warp, a, hemisphere_ ? a : b);
      pad(warp, b, hemisphere_ ? b : a);
      warp.sync();
      filter_row(warp, a, y);
      if (other != y) filter_row(warp, b, other);
      warp.sync();
    });
  }

  // Continues a row by `radius` cells on either side, mirrored from the row beyond the edge.
  template <class Warp>
  WFPG_HD void pad(const Warp& warp, float* row, const float* beyond) const {
    warp.for_each(radius, [&](int i) {
      row[-1 - i] = beyond[i];
      row[size_ + i] = beyond[size_ - 1 - i];
    });
  }

  template <class Warp>
  WFPG_HD void filter_row(const Warp& warp, const float* row, int y) const {
    warp.for_each(size_, [&](int x) {
      cells_.set(y * size_ + x, taps_(row[x - 2], row[x - 1], row[x], row[x + 1], row[x + 2]));
    });
  }

  /// Filters columns in segments of rows, a lane a column. The rows next to each segment are copied first,
  /// since neighbouring segments change them.
  template <class Block>
  WFPG_HD void filter_columns(const Block& block, float* aside) const {
    const auto segment_count = static_cast<int>(segments(static_cast<std::uint32_t>(size_)));
    block.for_each(segment_count * 2 * radius * size_, [&](int i) {
      const int row = i / size_, k = row % (2 * radius), first = row / (2 * radius) * segment;
      const int y = k < radius ? first - radius + k : min(first + segment, size_) + k - radius;
      aside[i] = at(i % size_, y);
    });
    block.sync();
    constexpr int width = Block::warp::width;
    const int strips = (size_ + width - 1) / width;
    block.for_each_warp(strips * segment_count, [&](const auto& warp, int i) {
      filter_segment(warp, i % strips * width, i / strips * segment,
                     aside + i / strips * (2 * radius * size_));
    });
  }

  template <class Warp>
  WFPG_HD void filter_segment(const Warp& warp, int first_column, int first_row, const float* aside) const {
    const int end = min(first_row + segment, size_), columns = min(Warp::width, size_ - first_column);
    const auto read = [&](auto& row, int y) {
      const bool is_own = y >= first_row && y < end;
      const float* const beyond =
          y < first_row ? aside + (y - first_row + radius) * size_ : aside + (y - end + radius) * size_;
      warp.for_lanes_below(columns, [&](int lane) {
        const int x = first_column + lane;
        row[lane] = is_own ? cells_.get(y * size_ + x) : beyond[x];
      });
    };
    auto a = warp.map([](int) { return 0.0f; });
    auto b = a, middle = a, c = a, d = a;
    read(a, first_row - 2);
    read(b, first_row - 1);
    read(middle, first_row);
    read(c, first_row + 1);
    for (int y = first_row; y < end; ++y) {
      read(d, y + 2);
      warp.for_lanes_below(columns, [&](int lane) {
        cells_.set(y * size_ + first_column + lane, taps_(a[lane], b[lane], middle[lane], c[lane], d[lane]));
      });
      a = b;
      b = middle;
      middle = c;
      c = d;
    }
  }

  /// The cell at (x, y), y at most `radius` rows off the square.
  WFPG_HD float at(int x, int y) const {
    if (!hemisphere_)
      wrap_octahedral(x, y, size_);
    else if (y < 0 || y >= size_)
      y = y < 0 ? -1 - y : 2 * size_ - 1 - y;
    return cells_.get(y * size_ + x);
  }

  cell_words cells_;
  int size_;
  bool hemisphere_;
  gaussian_taps taps_;
};

}  // namespace wfpg::detail
