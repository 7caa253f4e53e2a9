// Makes the fields of a wave's bins anew, for each depth of each sample. A field lives in scratch memory
// while its bin's rays sample it, or in memory that the caller gives.
//
// Source: Yalciner and Akyuz (2024), section 3.3, Algorithm 3.
//
// Cost: F^2 cones and O(F^2) a bin. Memory: 4 (F^2 + F) bytes of scratch a block, and a few rows for the
// filter. At 128^2 cells and 16 warps that is 81 KiB. Small devices have it once, and large ones twice.
#pragma once

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/guides/octree/detail/bin_ranks.hpp>
#include <wfpg/guides/octree/field_cells.hpp>

namespace wfpg {

/// Makes the field of each bin of a wave, and hands it to a sink. Trivially copyable.
///   Surfaces  (std::uint32_t ray) -> surface<Bsdf>
///   Hits      (std::size_t bin, std::uint32_t i, const ray&, float solid_angle) -> ray_hit, of the i-th
///             cone in their order
///   Sink      words(block&, bin) -> std::uint32_t*, room for a distribution;
///             finish(block&, bin, directional_field), by the whole block;
///             scratch_bytes(): bytes that both take
template <class Surfaces>
struct bin_fields {
  bins_view bins;                  ///< the wave's bins; a field each
  Surfaces surfaces;               ///< where the wave's rays are
  exitance_cache_view cache;       ///< read by cones
  field_options options;           ///< filter and floor
  guiding_mode mode;               ///< decides between hemispheres and spheres
  std::uint32_t resolution;        ///< F: cells along a field's side
  std::uint64_t seed;              ///< of the sample and depth
  detail::shared_bins ranks = {};  ///< where fields start, with ranks

  /// Origin of a bin's field: the surface of one of its rays, drawn uniformly anew for each sample and depth.
  /// Over samples the cones so start from all over the bin. With ranks, the ray is one of all ranks'.
  /// Precondition: the bin has a ray. O(1).
  WFPG_HD field_origin origin(std::size_t bin) const {
    const std::uint64_t bits = hash(seed, bins.key(bin));
    if (!ranks.empty()) return ranks.origin(bin, static_cast<std::uint32_t>(hash(bits, 1)));
    const std::uint64_t rank = (bits >> 32) * bins.size(bin) >> 32;
    return origin_of(bin, bins.permutation[bins.begin(bin) + rank]);
  }
  /// Origin of a bin's field, if it starts at the surface of one of its rays. With ranks, the one that has
  /// the ray tells it to the others. `ray`: index in the wave. O(1).
  WFPG_HD field_origin origin_of(std::size_t bin, std::uint32_t ray) const {
    const std::uint64_t bits = hash(seed, bins.key(bin));
    return origin_at(surfaces(ray), cache.octree(), mode, bins.orientation(bin),
                     static_cast<std::uint32_t>(hash(bits, 1)));
  }

  /// Casts the F² cones of one bin, makes the distribution, and calls sink.finish(). Each thread casts a cone
  /// at a time. All threads of the block call it. O(F²).
  ///
  /// Scratch memory: field_scratch_bytes() for the filter, and the sink's scratch_bytes().
  template <class Block, class Hits, class Sink>
  WFPG_HD void make(Block& block, std::size_t bin, const Hits& hits, const Sink& sink) const {
    const auto size = static_cast<int>(resolution);
    const field_cells cells(origin(bin), resolution);
    const cell_words words{sink.words(block, bin)};
    const float solid_angle = cells.domain.cell_solid_angle();
    block.for_each(size * size, [&](int k) {
      const auto i = static_cast<std::uint32_t>(k);
      const field_cell cell = cell_in_order(i, resolution);
      const ray cone = cells.cone(cell);
      const cone_hit found = cells.find(cache, cone, hits(bin, i, cone, solid_angle));
      words.set(static_cast<int>(cell.index(resolution)), cells.weigh(found.radiance(cache), cone.direction));
    });
    block.sync();
    const bool hemisphere = cells.origin.hemisphere;
    const grid_distribution grid = finish_field(block, words, size, hemisphere, options);
    sink.finish(block, bin,
                hemisphere ? directional_field(grid, cells.origin.normal) : directional_field(grid));
  }
};

/// Kernel: makes the fields of bins from `first_bin` on. One block makes one field.
///   Hits  inline_hits, or stored_hits of these bins
///   Sink  transient_sink or resident_sink
template <class Surfaces, class Hits, class Sink>
struct make_fields {
  bin_fields<Surfaces> fields;  ///< what fields are made of
  Hits hits;                    ///< what cones find
  Sink sink;                    ///< takes each field
  std::size_t first_bin;        ///< bin of block 0
  /// Makes the field of bin `first_bin` + i.
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    fields.make(block, first_bin + i, hits, sink);
  }
};

/// Kernel: writes the cones of bins from `first_bin` on, for a batch caster. One block writes those of one
/// bin.
template <class Surfaces>
struct write_cones {
  bin_fields<Surfaces> fields;  ///< where cones start
  array_view<ray> cones;        ///< F² a bin, bin by bin
  std::size_t first_bin;        ///< bin of cones[0]
  /// Writes the F² cones of bin `first_bin` + i, in the order of cell_in_order().
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const field_cells cells(fields.origin(first_bin + i), fields.resolution);
    const std::uint32_t n = fields.resolution * fields.resolution;
    block.for_each(static_cast<int>(n), [&](int k) {
      const auto cone = static_cast<std::uint32_t>(k);
      cones[i * n + cone] = cells.cone(cell_in_order(cone, fields.resolution));
    });
  }
};

/// Makes the field of every bin and hands it to the sink. An inline caster is called inside the kernel: the
/// host reads nothing, and no cone is stored.
///
/// A batch caster gets the cones of as many bins at once as `buffer_bytes` holds, at least one. The host then
/// reads the number of bins, which waits for the work before it. Throws out_of_memory, and what the caster
/// throws.
template <class Exec, class Surfaces, class Caster, class Sink>
void for_each_field(const Exec& exec, const bin_fields<Surfaces>& fields, const Caster& caster,
                    const Sink& sink, std::size_t buffer_bytes) {
  const std::size_t scratch =
      field_scratch_bytes(fields.resolution, Exec::warps_per_block) + sink.scratch_bytes();
  if constexpr (is_inline_caster_v<Caster>) {
    const exec::device_count bins{fields.bins.count, fields.bins.permutation.size()};
    exec.for_each_block(bins, scratch,
                        make_fields<Surfaces, inline_hits<Caster>, Sink>{fields, {caster}, sink, 0});
  } else {
    const std::uint32_t cells = fields.resolution * fields.resolution;
    const std::size_t bins = read_element(exec, fields.bins.count);
    // There are no more bins than rays. So the buffers have one size for all waves of as many rays.
    const std::size_t rays = fields.bins.permutation.size();
    // At least one bin, however small the buffer is.
    const std::size_t at_once =
        min(rays, max<std::size_t>(1, buffer_bytes / (cells * (sizeof(ray) + sizeof(ray_hit)))));
    const buffer<ray, Exec> cones(exec, cells * at_once);
    const buffer<ray_hit, Exec> hits(exec, cones.size());
    cast_in_batches(
        exec, caster, bins, cells, cones.view(), hits.view(),
        [&](std::size_t first, std::size_t n, array_view<ray> to) {
          exec.for_each_block(n, 0, write_cones<Surfaces>{fields, to, first});
        },
        [&](std::size_t first, std::size_t n, array_view<ray_hit> from) {
          exec.for_each_block(
              n, scratch,
              make_fields<Surfaces, stored_hits, Sink>{fields, {from, first, cells}, sink, first});
        });
  }
}

}  // namespace wfpg
