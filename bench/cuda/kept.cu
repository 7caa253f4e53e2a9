// Kept fields: refreshing slots, their casts apart, and serving a wave from slots that are up to date.
#include "guide.hpp"

#include <wfpg/path_guider.hpp>

namespace bench {
namespace {

constexpr std::uint32_t slot_count = 4096, slot_size = 24, cells = slot_size * slot_size, recast = 8;

/// Slots with a history, each with a ray of the wave as origin.
struct make_slots {
  wfpg::array_view<wfpg::detail::field_slot> slots;
  wfpg::resident_field* fields;
  wfpg::array_view<const room_point> points;
  WFPG_HD void operator()(std::size_t i) const {
    const std::uint64_t ray = wfpg::hash(9, i) % pixels;
    slots[i].key = static_cast<std::uint32_t>(i) * wfpg::orientations;
    slots[i].builds = 1;
    slots[i].origin = ray;
    fields[i] = {points[ray].normal, 0.7f};
  }
};

struct cast_all {
  wfpg::detail::kept_field_builder<wfpg::kept_field_wave<stored_surfaces>> builder;
  wfpg::array_view<wfpg::ray_hit> hits;
  std::uint32_t cones;
  bool whole;
  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const auto slot = static_cast<std::uint32_t>(i);
    const wfpg::field_cells cells_of = builder.cells(slot, whole);
    block.for_each(static_cast<int>(cones), [&](int c) {
      const auto cone = static_cast<std::uint32_t>(c);
      hits[i * cones + cone] = room_caster()(cells_of.cone(builder.cell(slot, whole, cone)));
    });
  }
};

/// 4,096 due slots of 24² cells, a cone in eight cast again, four times the default's; the floor reads what
/// cells have hit and writes their distributions.
void refreshing_slots(benchmark::State& state) {
  const exec_policy exec;
  const guide_of_room guide(exec, 128);
  const auto points = points_after(exec, 1);
  const wfpg::array_view<const room_point> given(points.view());
  const wfpg::buffer<wfpg::detail::field_slot, exec_policy> slots(exec, slot_count);
  const wfpg::buffer<wfpg::resident_field, exec_policy> fields(exec, slot_count);
  const wfpg::buffer<std::uint32_t, exec_policy> words(
      exec, std::size_t(slot_count) * wfpg::grid_distribution::words(slot_size)),
      list(exec, slot_count);
  const wfpg::buffer<wfpg::cone_hit, exec_policy> found(exec, std::size_t(slot_count) * cells);
  const wfpg::buffer<wfpg::rough_mean, exec_policy> learnt(exec, found.size());
  const wfpg::buffer<wfpg::ray_hit, exec_policy> hits(exec, std::size_t(slot_count) * cells);
  thrust::sequence(exec.thrust(), list.data(), list.data() + slot_count);

  const wfpg::kept_field_wave<stored_surfaces> wave{
      pixels, {given}, guide.cache.view(), {}, wfpg::guiding_mode::oriented, 0.7f, 1, {}};
  const wfpg::buffer<std::uint8_t, exec_policy> settled(exec, slot_count);
  const wfpg::buffer<std::uint64_t, exec_policy> refreshed(exec, 1);
  const wfpg::detail::kept_fields_view kept{{slots.view(), nullptr, 0, settled.data()},
                                            fields.data(),
                                            words.data(),
                                            found.data(),
                                            learnt.data(),
                                            1.0f,
                                            slot_size,
                                            recast,
                                            2,
                                            refreshed.data()};
  using builder_type = wfpg::detail::kept_field_builder<wfpg::kept_field_wave<stored_surfaces>>;
  const builder_type builder{wave, kept};
  const auto renew = [&] { exec.for_each(slot_count, make_slots{slots.view(), fields.data(), given}); };
  const auto build = [&](bool whole) {
    const std::uint32_t cones = builder.cone_count(whole);
    exec.for_each_block(slot_count, wfpg::field_scratch_bytes(slot_size, exec_policy::warps_per_block),
                        wfpg::detail::build_kept_fields<builder_type, wfpg::stored_hits>{
                            builder, {hits.view(), 0, cones}, list.data(), whole});
  };
  for (const bool whole : {true, false}) {
    renew();
    exec.for_each_block(slot_count, 0, cast_all{builder, hits.view(), builder.cone_count(whole), whole});
    if (whole) build(true);
  }
  compare(
      state, exec, [&] { build(false); }, copy_of(exec, found.bytes() + words.bytes()), renew);
}

/// A wave's rays to their slots, a direction and a density each, where fields would be built, but none is
/// due; the floor reads the surfaces and writes the directions.
void serving_kept(benchmark::State& state) {
  const exec_policy exec;
  const room_mesh mesh(exec, 100000);
  wfpg::guider_options options;
  options.max_rays = pixels;
  options.deposit_capacity = pixels;
  options.unguided_samples = 0;
  options.product_resolution = static_cast<std::uint32_t>(state.range(0));
  wfpg::path_guider<exec_policy> guider(exec, mesh.view(), options);
  const auto points = points_after(exec, 1);
  const wfpg::array_view<const room_point> given(points.view());
  const wfpg::buffer<wfpg::sampled_direction, exec_policy> directions(exec, pixels);
  const auto kind = static_cast<render::material_kind>(state.range(1));
  const wfpg::wave wave{0u, pixels, stored_surfaces{given, kind}, hashed_numbers{}};
  const auto draw = [&] { guider.sample_directions(wave, room_caster{}, directions.view()); };
  for (int sample = 0; sample < 17; ++sample) {
    if (sample > 0) guider.end_sample();
    guider.begin_sample();
    exec.for_each(pixels, light_room{guider.cache(), given});
    draw();
  }
  compare(state, exec, draw, copy_of(exec, points.bytes() + directions.bytes()));
  state.counters["slots"] = guider.statistics().kept.live;
}

BENCHMARK(refreshing_slots)->Apply(as_stage);
BENCHMARK(serving_kept)
    ->ArgNames({"P", "material"})
    ->Args({0, static_cast<int>(render::material_kind::lambert)})
    ->Args({8, static_cast<int>(render::material_kind::plastic)})
    ->Apply(as_stage);

}  // namespace
}  // namespace bench
