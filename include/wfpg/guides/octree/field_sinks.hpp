// What happens to a transient field once it is made: the rays of its bin sample it in scratch memory, or it
// is kept for one depth.
#pragma once

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/sampling/mixture.hpp>

namespace wfpg {

/// The share of guided samples of a bin: more where enough rays share it for its field to fit them.
struct mixture_fraction {
  float with_enough_rays;
  float with_few_rays;
  std::uint32_t enough;
  WFPG_HD float operator()(std::uint32_t rays) const {
    return rays >= enough ? with_enough_rays : with_few_rays;
  }
};

/// Fields in scratch memory, gone when their rays are served.
template <class Serve>
struct transient_sink {
  bins_view bins;
  Serve serve;
  mixture_fraction fraction;
  std::uint32_t resolution;
  product_points points;

  std::size_t scratch_bytes() const {
    const std::uint32_t words = grid_distribution::words(resolution) + points.resolution * points.resolution;
    return sizeof(std::uint32_t) * words + 32;
  }

  template <class Block>
  WFPG_HD std::uint32_t* words(Block& block, std::size_t) const {
    return block.template scratch<std::uint32_t>(grid_distribution::words(resolution));
  }
  template <class Block>
  WFPG_HD void finish(Block& block, std::size_t bin, const directional_field& field) const {
    const float share = fraction(bins.size(bin));
    const std::uint32_t* const rays = bins.permutation.data() + bins.begin(bin);
    const std::uint32_t* const sums = sum_blocks(block, field.grid());
    block.for_each(static_cast<int>(bins.size(bin)), [&](int i) {
      if (points.resolution == 0) {
        serve(rays[i], [&](const auto&) { return guide_mixture{field, share}; });
        return;
      }
      std::uint32_t words[max_product_words];
      serve(rays[i], [&](const auto& s) -> product_mixture {
        return {multiply_field(field, points, s, words, sums), share};
      });
    });
  }

 private:
  /// The field's block sums in scratch memory, for all of the bin's rays.
  template <class Block>
  WFPG_HD const std::uint32_t* sum_blocks(Block& block, const grid_distribution& grid) const {
    const std::uint32_t p = points.resolution;
    std::uint32_t* const sums = block.template scratch<std::uint32_t>(std::size_t(p) * p);
    block.for_each(static_cast<int>(p), [&](int y) {
      const auto row = static_cast<std::uint32_t>(y);
      sum_block_row(grid, p, row, sums + row * p);
    });
    block.sync();
    return sums;
  }
};

/// Fields in memory of their own, and for each ray which is its.
struct resident_sink {
  bins_view bins;
  std::uint32_t* storage;
  resident_field* fields;
  std::uint32_t* field_of_ray;
  mixture_fraction fraction;
  std::uint32_t resolution;

  static std::size_t scratch_bytes() { return 0; }

  template <class Block>
  WFPG_HD std::uint32_t* words(Block&, std::size_t bin) const {
    return storage + bin * grid_distribution::words(resolution);
  }
  template <class Block>
  WFPG_HD void finish(Block& block, std::size_t bin, const directional_field& field) const {
    const std::uint32_t begin = bins.begin(bin);
    block.for_each(static_cast<int>(bins.size(bin)), [&](int i) {
      if (i == 0) fields[bin] = {field.hemisphere() ? field.normal() : vec3(0.0f), fraction(bins.size(bin))};
      field_of_ray[bins.permutation[begin + static_cast<std::uint32_t>(i)]] = static_cast<std::uint32_t>(bin);
    });
  }
};

}  // namespace wfpg
