// Transient fields of a wave's bins: building them from the hits of their cones, and sampling directions from
// them.
#include "floors.hpp"
#include "guide.hpp"

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/octree/field_sinks.hpp>
#include <wfpg/guides/octree/transient_fields.hpp>
#include <wfpg/sampling/product_sampler.hpp>

#include <type_traits>

namespace bench {
namespace {

constexpr std::uint32_t field_count = sizes::field_count, field_size = sizes::field_size;
constexpr std::uint32_t cells = field_size * field_size;

using fields_type = wfpg::bin_fields<stored_surfaces>;
using sampler_type = wfpg::sample_ray<stored_surfaces, hashed_numbers, wfpg::no_queries>;

/// Rays in runs of equal length. Each run is a bin, so the rays of a bin are contiguous.
struct equal_bins {
  wfpg::array_view<std::uint32_t> permutation, offsets, keys;
  std::uint32_t* count;
  WFPG_HD void operator()(std::size_t i) const {
    permutation[i] = static_cast<std::uint32_t>(i);
    keys[i] = static_cast<std::uint32_t>(i * field_count / pixels) * wfpg::orientations;
    if (i <= field_count) offsets[i] = static_cast<std::uint32_t>(i * pixels / field_count);
    if (i == 0) *count = field_count;
  }
};

/// The hits of all cones of all fields.
struct cast_cones {
  fields_type fields;
  wfpg::array_view<wfpg::ray_hit> hits;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t bin) const {
    const wfpg::field_cells cone_of(fields.origin(bin), field_size);
    block.for_each(static_cast<int>(cells), [&](int k) {
      const auto i = static_cast<std::uint32_t>(k);
      hits[bin * cells + i] = room_caster()(cone_of.cone(wfpg::cell_in_order(i, field_size)));
    });
  }
};

/// Leaves finished fields in scratch memory and only marks them as done.
struct keep_nothing {
  std::uint32_t* totals;
  template <class Block>
  WFPG_HD std::uint32_t* words(Block& block, std::size_t) const {
    return block.template scratch<std::uint32_t>(wfpg::grid_distribution::words(field_size));
  }
  template <class Block>
  WFPG_HD void finish(Block& block, std::size_t bin, const wfpg::directional_field& field) const {
    block.for_each(1, [&](int) { totals[bin] = field.grid().total(); });
  }
  static std::size_t scratch_bytes() {
    return sizeof(std::uint32_t) * wfpg::grid_distribution::words(field_size) + 16;
  }
};

/// Fields over a wave, 2,048 of 128² on a GPU. Their cones are cast already.
template <class Exec>
class workload {
 public:
  workload(const Exec& exec, render::material_kind kind, std::uint32_t product_resolution)
      : exec(exec),
        guide(exec, sizes::field_octree),
        points(points_after(exec, 1)),
        permutation(exec, pixels),
        offsets(exec, field_count + 1),
        keys(exec, pixels),
        count(exec, 1),
        hits(exec, std::size_t(field_count) * cells),
        totals(exec, field_count),
        directions(exec, pixels),
        product_points(exec, std::size_t(2) * product_resolution * product_resolution) {
    exec.for_each(pixels, equal_bins{permutation.view(), offsets.view(), keys.view(), count.data()});
    wfpg::bins_view bins;
    bins.permutation = permutation.view();
    bins.offsets = offsets.view();
    bins.sorted_keys = keys.view();
    bins.ray_keys = keys.view();
    bins.count = count.data();
    const stored_surfaces surfaces{wfpg::array_view<const room_point>(points.view()), kind};
    fields =
        fields_type{bins, surfaces, guide.cache.view(), {}, wfpg::guiding_mode::oriented, field_size, 17};
    exec.for_each_block(field_count, 0, cast_cones{fields, hits.view()});
    const std::uint32_t p = product_resolution;
    wfpg::product_point* const hemisphere = product_points.data();
    exec.for_each(std::size_t(p) * p, wfpg::measure_product_blocks{hemisphere, hemisphere + p * p, p});
    exec.for_each(std::size_t(p) * p, wfpg::draw_product_points{hemisphere, hemisphere + p * p, p, 1});
    sampler = sampler_type{surfaces, hashed_numbers{}, {}, directions.view()};
    sink = {bins, sampler, {0.7f, 0.5f, 64}, field_size, {hemisphere, hemisphere + p * p, p}};
  }

  /// Passes every field to a sink.
  template <class Sink>
  void make(const Sink& into) const {
    const std::size_t making = wfpg::field_scratch_bytes(field_size, Exec::warps_per_block);
    exec.for_each_block(field_count, making + into.scratch_bytes(),
                        wfpg::make_fields<stored_surfaces, wfpg::stored_hits, Sink>{
                            fields, {hits.view(), 0, cells}, into, 0});
  }

  Exec exec;
  guide_of_room<Exec> guide;
  wfpg::buffer<room_point, Exec> points;
  wfpg::buffer<std::uint32_t, Exec> permutation, offsets, keys, count;
  wfpg::buffer<wfpg::ray_hit, Exec> hits;
  wfpg::buffer<std::uint32_t, Exec> totals;
  wfpg::buffer<wfpg::sampled_direction, Exec> directions;
  wfpg::buffer<wfpg::product_point, Exec> product_points;
  fields_type fields;
  sampler_type sampler;
  wfpg::transient_sink<sampler_type> sink;
};

/// From hits to distributions in scratch memory. The floor reads the hits.
template <class Exec>
void making_fields(benchmark::State& state) {
  const Exec exec;
  const workload<Exec> w(exec, render::material_kind::lambert, 0);
  compare(
      state, exec, [&] { w.make(keep_nothing{w.totals.data()}); }, copy_of(exec, w.hits.bytes()));
}

/// The time that sampling a direction for every ray adds to building the fields. The floor reads the surfaces
/// and writes the directions.
template <class Exec>
void serving_rays(benchmark::State& state) {
  const Exec exec;
  const auto kind = static_cast<render::material_kind>(state.range(1));
  const workload<Exec> w(exec, kind, static_cast<std::uint32_t>(state.range(0)));
  const copy_of floor(exec, w.points.bytes() + w.directions.bytes());
  std::vector<double> sampled, made, floors;
  const auto make = [&] { w.make(keep_nothing{w.totals.data()}); };
  const auto make_and_sample = [&] { w.make(w.sink); };
  for (int i = 0; i < warm_up; ++i) {
    seconds_of(exec, make);
    seconds_of(exec, make_and_sample);
    seconds_of(exec, floor);
  }
  for (auto _ : state) {
    made.push_back(seconds_of(exec, make));
    sampled.push_back(seconds_of_stage(exec, make_and_sample));
    floors.push_back(seconds_of(exec, floor));
    state.SetIterationTime(sampled.back());
  }
  report(state, median(sampled) - median(made), median(floors));
}

/// P, the material.
constexpr argument sampled_with[][2] = {{0, static_cast<int>(render::material_kind::plastic)},
                                        {8, static_cast<int>(render::material_kind::plastic)}};

WFPG_BENCH_STAGE(making_fields, no_arguments{});
WFPG_BENCH_STAGE(serving_rays, {"P", "material"}, sampled_with);

}  // namespace
}  // namespace bench
