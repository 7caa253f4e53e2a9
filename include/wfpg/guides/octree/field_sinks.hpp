// Consumers of transient fields. transient_sink samples a field in scratch memory, for the rays of its bin.
// resident_sink keeps the fields of one depth in memory.
//
// Source: Yalciner and Akyuz (2024), section 3.5, Algorithm 3.
//
// Cost: one direction a ray, or one word a ray. Memory: 4 (F^2 + F) bytes a field; with products P^2 words
// more a block.
#pragma once

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/sampling/mixture.hpp>

namespace wfpg {

/// Fraction of guided directions in a bin. Fields of bins with many rays may have a larger one: the rays
/// share the cost, and one field fits them.
struct mixture_fraction {
  float with_enough_rays;  ///< in (0, 1], for bins of at least `enough` rays
  float with_few_rays;     ///< in (0, 1], for smaller bins
  std::uint32_t enough;    ///< rays; 0: every bin has enough
  /// Returns the fraction for a bin of `rays` rays. O(1).
  WFPG_HD float operator()(std::uint32_t rays) const {
    return rays >= enough ? with_enough_rays : with_few_rays;
  }
};

/// Samples each field while it lies in scratch memory: no field is written to global memory. The field is
/// gone once its rays have their directions.
///   Sampler  (std::uint32_t ray, (const surface<Bsdf>&) -> mixture): draws one direction, such as sample_ray
///
/// Delta surfaces have no bin, so no ray of theirs comes here.
template <class Sampler>
struct transient_sink {
  bins_view bins;             ///< the wave's bins
  Sampler sampler;            ///< writes one ray's direction
  mixture_fraction fraction;  ///< of guided directions, by bin size
  std::uint32_t resolution;   ///< F: cells along a field's side
  /// Points of products; `points.resolution` is P, 0 without products. P divides F.
  product_points points;

  /// Bytes of scratch memory that words() and finish() take in a block. These are the distribution's words,
  /// P² for block sums, and 32 bytes for alignment.
  std::size_t scratch_bytes() const {
    const std::uint32_t words = grid_distribution::words(resolution) + points.resolution * points.resolution;
    return sizeof(std::uint32_t) * words + 32;
  }

  /// Returns room for one distribution in scratch memory, grid_distribution::words(F) words.
  template <class Block>
  WFPG_HD std::uint32_t* words(Block& block, std::size_t) const {
    return block.template scratch<std::uint32_t>(grid_distribution::words(resolution));
  }
  /// Samples `field` for all rays of `bin`; each thread of the block takes a ray at a time. With products, a
  /// ray multiplies the field by its own BSDF. That takes max_product_words words (1 KiB) of the thread's
  /// local memory. All threads of the block call it.
  template <class Block>
  WFPG_HD void finish(Block& block, std::size_t bin, const directional_field& field) const {
    const float share = fraction(bins.rays(bin));
    const std::uint32_t* const rays = bins.permutation.data() + bins.begin(bin);
    const std::uint32_t* const sums = sum_blocks(block, field.grid());
    block.for_each(static_cast<int>(bins.size(bin)), [&](int i) {
      if (points.resolution == 0) {
        sampler(rays[i], [&](const auto&) { return guide_mixture{field, share}; });
        return;
      }
      std::uint32_t words[max_product_words];
      sampler(rays[i], [&](const auto& s) -> product_mixture {
        return {multiply_field(field, points, s, words, sums), share};
      });
    });
  }

 private:
  /// Returns the field's P² block sums in scratch memory. They are made once, and all rays of the bin
  /// multiply them. Each row of blocks is one thread's. O(F²/P) a thread.
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

/// Stores the field of each bin in memory, and for each ray the number of its field. Renderers whose BSDFs
/// exist only in their own kernels sample these later, through guide_view.
struct resident_sink {
  bins_view bins;  ///< the wave's bins
  /// Distributions, bin by bin: grid_distribution::words(F) words each.
  std::uint32_t* storage;
  resident_field* fields;  ///< normal and fraction of each bin's field
  /// One word a ray, written for the rays in bins alone. The caller fills it with no_field first.
  std::uint32_t* field_of_ray;
  /// Goes into `fields`: a bin's rays all have one fraction.
  mixture_fraction fraction;
  /// F of the stored distributions.
  std::uint32_t resolution;

  /// Returns 0: distributions need no scratch memory of their own.
  static std::size_t scratch_bytes() { return 0; }

  /// Returns the part of `storage` that holds the distribution of `bin`.
  template <class Block>
  WFPG_HD std::uint32_t* words(Block&, std::size_t bin) const {
    return storage + bin * grid_distribution::words(resolution);
  }
  /// Writes the bin's entry of `fields`, and the bin's number for each of its rays. O(rays of the bin).
  template <class Block>
  WFPG_HD void finish(Block& block, std::size_t bin, const directional_field& field) const {
    const std::uint32_t begin = bins.begin(bin);
    block.for_each(static_cast<int>(bins.size(bin)), [&](int i) {
      if (i == 0) fields[bin] = {field.hemisphere() ? field.normal() : vec3(0.0f), fraction(bins.rays(bin))};
      field_of_ray[bins.permutation[begin + static_cast<std::uint32_t>(i)]] = static_cast<std::uint32_t>(bin);
    });
  }
};

}  // namespace wfpg
