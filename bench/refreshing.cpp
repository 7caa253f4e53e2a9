// Kept fields: refreshing slots, without casting their cones.
#include "floors.hpp"
#include "guide.hpp"

#include <wfpg/path_guider.hpp>

#include <thrust/sequence.h>

namespace bench {
namespace {

constexpr std::uint32_t slot_count = sizes::slot_count, slot_size = sizes::slot_size;
constexpr std::uint32_t cells = slot_size * slot_size, recast = 8;

/// Slots with learnt data, each with a ray of the wave as origin.
struct make_slots {
  wfpg::array_view<wfpg::field_slot> slots;
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
  wfpg::kept_field_builder<wfpg::kept_field_wave<stored_surfaces>> builder;
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

/// Refreshes due slots, 4,096 of 24² cells on a GPU. One cone in eight is cast again, four times the
/// default's. The floor reads the cells' hits and writes their distributions.
template <class Exec>
void refreshing_slots(benchmark::State& state) {
  const Exec exec;
  const guide_of_room<Exec> guide(exec, sizes::slot_octree);
  const auto points = points_after(exec, 1);
  const wfpg::array_view<const room_point> given(points.view());
  const wfpg::buffer<wfpg::field_slot, Exec> slots(exec, slot_count);
  const wfpg::buffer<wfpg::resident_field, Exec> fields(exec, slot_count);
  const wfpg::buffer<std::uint32_t, Exec> words(
      exec, std::size_t(slot_count) * wfpg::grid_distribution::words(slot_size)),
      list(exec, slot_count);
  const wfpg::buffer<wfpg::cone_hit, Exec> found(exec, std::size_t(slot_count) * cells);
  const wfpg::buffer<wfpg::stochastic_mean16, Exec> learnt(exec, found.size());
  const wfpg::buffer<wfpg::ray_hit, Exec> hits(exec, std::size_t(slot_count) * cells);
  thrust::sequence(exec.thrust(), list.data(), list.data() + slot_count);

  const wfpg::kept_field_wave<stored_surfaces> wave{
      pixels, {given}, guide.cache.view(), {}, wfpg::guiding_mode::oriented, 0.7f, 1, {}};
  const wfpg::buffer<std::uint8_t, Exec> noted(exec, slot_count);
  const wfpg::buffer<std::uint64_t, Exec> refreshed(exec, 1);
  exec.fill_bytes(slots.data(), 0, slots.bytes());
  exec.fill_bytes(learnt.data(), 0, learnt.bytes());
  exec.fill_bytes(noted.data(), 0, noted.bytes());
  const wfpg::kept_fields_view kept{{slots.view(), nullptr, 0, noted.data()},
                                    fields.data(),
                                    words.data(),
                                    found.data(),
                                    learnt.data(),
                                    nullptr,  // fractions do not change in a build
                                    1.0f,
                                    slot_size,
                                    recast,
                                    2,
                                    refreshed.data()};
  using builder_type = wfpg::kept_field_builder<wfpg::kept_field_wave<stored_surfaces>>;
  const builder_type builder{wave, kept};
  const auto renew = [&] { exec.for_each(slot_count, make_slots{slots.view(), fields.data(), given}); };
  const auto build = [&](bool whole) {
    const std::uint32_t cones = builder.cone_count(whole);
    exec.for_each_block(slot_count, wfpg::field_scratch_bytes(slot_size, Exec::warps_per_block),
                        wfpg::build_kept_fields<builder_type, wfpg::stored_hits>{
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

WFPG_BENCH_STAGE(refreshing_slots, no_arguments{});

}  // namespace
}  // namespace bench
