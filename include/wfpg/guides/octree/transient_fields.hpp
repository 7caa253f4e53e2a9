// The fields of a wave's bins, made anew for each depth of each sample (paper, section 3.3, Algorithm 3).
// Fields live in scratch memory while their bin's rays sample them, or in memory that the caller gives.
//
// Cost: F^2 cones and O(F^2) a bin; 4 (F^2 + F) bytes of scratch a block and a few rows for the filter: at
// 128^2 and 16 warps 81 KiB, which small devices have and large ones twice.
#pragma once

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/guides/octree/field_cells.hpp>

namespace wfpg {

/// The fields of a wave's bins: a functor of blocks that fills each bin's field and hands it to `sink`.
///   Surfaces  (std::uint32_t ray) -> surface<Bsdf>
///   Hits      (std::size_t bin, std::uint32_t i, const ray&, float solid_angle) -> ray_hit, of the i-th
///             cone in their order
///   Sink      words(block&, bin) -> std::uint32_t*, room for a distribution;
///             finish(block&, bin, directional_field), by the whole block;
///             scratch_bytes(): what that takes
template <class Surfaces>
struct bin_fields {
  bins_view bins;
  Surfaces surfaces;
  exitance_cache_view cache;
  field_options options;
  guiding_mode mode;
  std::uint32_t resolution;
  std::uint64_t seed;  // of the sample and depth

  /// The bin's origin: one of its rays, drawn anew in each sample.
  WFPG_HD field_origin origin(std::size_t bin) const {
    const std::uint64_t bits = hash(seed, bins.key(bin));
    const std::uint64_t rank = (bits >> 32) * bins.size(bin) >> 32;
    const auto s = surfaces(bins.permutation[bins.begin(bin) + rank]);
    field_origin result;
    result.position = off_surface(s, cache.octree());
    result.normal = facing_normal(s);
    result.hemisphere = mode == guiding_mode::oriented && bins.orientation(bin) < orientation_transmits;
    result.cosine = result.hemisphere;
    result.seed = static_cast<std::uint32_t>(hash(bits, 1));
    return result;
  }

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

template <class Surfaces, class Hits, class Sink>
struct make_fields {
  bin_fields<Surfaces> fields;
  Hits hits;
  Sink sink;
  std::size_t first_bin;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    fields.make(block, first_bin + i, hits, sink);
  }
};

template <class Surfaces>
struct write_cones {
  bin_fields<Surfaces> fields;
  array_view<ray> cones;
  std::size_t first_bin;
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

/// Makes the field of every bin and hands it to the sink. An inline caster is called in place; a batch caster
/// gets the cones of as many bins at once as `buffer_bytes` holds, at least one, and the host reads the
/// number of bins.
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
    const std::size_t rays = fields.bins.permutation.size();  // and no more bins: the same memory every time
    const std::size_t at_once =
        min(rays, max<std::size_t>(1, buffer_bytes / (cells * (sizeof(ray) + sizeof(ray_hit)))));
    const buffer<ray, Exec> cones(exec, cells * at_once);
    const buffer<ray_hit, Exec> hits(exec, cones.size());
    for (std::size_t first = 0; first < bins; first += at_once) {
      const std::size_t n = min(bins - first, at_once);
      exec.for_each_block(n, 0, write_cones<Surfaces>{fields, cones.view(), first});
      caster.cast(exec, array_view<const ray>(cones.data(), n * cells),
                  array_view<ray_hit>(hits.data(), n * cells));
      exec.for_each_block(
          n, scratch,
          make_fields<Surfaces, stored_hits, Sink>{fields, {hits.view(), first, cells}, sink, first});
    }
  }
}

}  // namespace wfpg
