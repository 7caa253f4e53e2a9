// Implementation of field_store.hpp.
#pragma once

#include <wfpg/guides/octree/field_store.hpp>

namespace wfpg {
namespace detail {

/// Forgets a wave that ended before its fields were built.
struct forget_wave {
  array_view<field_slot> slots;
  field_wave_counts* counts;
  WFPG_HD void operator()(std::size_t i) const {
    if (i == 0) *counts = {};
    if (i < slots.size()) slots[i].origin = field_slot::unpicked;
  }
};

/// Counts the fields that rays had after a sample; free slots were never used.
struct count_used {
  array_view<const field_slot> slots;
  std::uint32_t after;
  field_store_state* state;
  WFPG_HD void operator()(std::size_t i) const {
    if (slots[i].last_used > after) atomic_add(&state->used, 1);
  }
};

/// Bins become smaller or larger so that their fields fill the slots but for an eighth, which is for fields
/// that are asked for seldom. After some samples fields have learnt what new ones would have to learn again:
/// from then on bins only grow, where births are refused. There is always a sample after the last change to
/// smaller ones to find out: where all nodes have as many rays, a little less pressure makes four times the
/// bins. Samples that ask for no field say nothing.
struct adapt_pressure {
  static constexpr std::uint32_t settled = 16;  // sample
  static constexpr std::uint32_t least = mark_threshold::pressure_unit / 4;
  static constexpr std::uint32_t most = mark_threshold::pressure_unit << 15;

  field_store_state* state;
  std::uint64_t slots;
  std::uint32_t sample;

  WFPG_HD void operator()(std::size_t) const {
    const std::uint64_t asked = std::uint64_t(state->used) + state->waiting, now = state->pressure;
    const bool shrinks = sample < settled;
    if (asked > 0 && (shrinks || state->refused_births > 0)) {
      const std::uint64_t next = now * asked / max<std::uint64_t>(slots - slots / 8, 1);
      const std::uint64_t low = shrinks ? now / 2 : now;
      state->pressure = static_cast<std::uint32_t>(
          clamp(clamp(next, low, 2 * now), std::uint64_t(least), std::uint64_t(most)));
    }
  }
};

}  // namespace detail

template <class Exec>
const kept_field_options& field_store<Exec>::checked(const kept_field_options& o, std::uint32_t nodes) {
  require(o.resolution >= 2 && o.resolution <= 128, "kept.resolution", o.resolution, "in [2, 128]");
  require(o.recast >= 1, "kept.recast", o.recast, "at least 1");
  require(o.idle_samples >= 1, "kept.idle_samples", o.idle_samples, "at least 1");
  require(o.cone_samples > 0.0f, "kept.cone_samples", o.cone_samples, "positive and finite");
  const std::size_t slots = o.budget_bytes / bytes_a_slot(o.resolution, o.learn);
  require(slots < (1u << 30), "kept.budget_bytes", o.budget_bytes, "less than 2^30 slots");
  require(!o.learn || slots * o.resolution * o.resolution < 0xffffffffull, "kept.budget_bytes",
          o.budget_bytes, "less than 2^32 - 1 cells where fields learn");
  static_assert(detail::missing_key::most_nodes == 1u << 28, "the message names it");
  require(nodes < detail::missing_key::most_nodes, "number of octree nodes", nodes, "less than 2^28");
  return o;
}

template <class Exec>
kept_field_options field_store<Exec>::completed(kept_field_options o, std::size_t max_values) {
  o.recast = min(o.recast, o.resolution * o.resolution);
  o.learn = o.learn && max_values > 0;
  return o;
}

template <class Exec>
field_store<Exec>::field_store(const Exec& exec, const sparse_voxel_octree_view& tree,
                               const binning_options& binning, const kept_field_options& options,
                               std::size_t max_rays, std::size_t max_values)
    : tree_(tree),
      options_(completed(checked(options, tree.node_count()), max_values)),
      capacity_(tree.empty() ? 0 : options.budget_bytes / bytes_a_slot(options.resolution, options_.learn)),
      marks_(exec, tree, binning),
      slots_(exec, std::vector<detail::field_slot>(capacity_)),
      fields_(exec, std::vector<resident_field>(capacity_)),
      words_(exec, capacity_ * words_a_field()),
      hits_(exec, capacity_ * cells_a_field()),
      learnt_(exec, options_.learn ? hits_.size() : 0),
      queue_(exec, learnt_.size() > 0 ? max_values : 0, learnt_.size()),
      free_slots_(exec, capacity_),
      list_(exec, 2 * capacity_),
      through_(exec, capacity_),
      field_of_ray_(exec, max_rays),
      state_(exec, std::vector<detail::field_store_state>(1)),
      counts_(exec, std::vector<detail::field_wave_counts>(2)) {
  std::size_t entries = 2;
  while (entries < 2 * capacity_) entries *= 2;
  table_ = buffer<std::uint64_t, Exec>(exec, entries);
  settled_ = buffer<std::uint8_t, Exec>(exec, capacity_);
  while (max_rays / stride_ > 8 * std::size_t(tree.leaf_count()) && stride_ < 32) stride_ *= 2;
  constexpr std::size_t most_births = 1 << 12;  // of a wave: what one block goes through in microseconds
  wanted_ = buffer<std::uint32_t, Exec>(exec, min(entries, most_births));
  wanted_through_ = buffer<std::uint32_t, Exec>(exec, wanted_.size());
  exec.fill_bytes(table_.data(), 0xff, table_.bytes());
  exec.fill_bytes(settled_.data(), 0, settled_.bytes());
  exec.fill_bytes(words_.data(), 0, words_.bytes());  // files are written from copies of whole buffers
  exec.fill_bytes(hits_.data(), 0, hits_.bytes());
  exec.fill_bytes(learnt_.data(), 0, learnt_.bytes());
  ::thrust::fill_n(exec.thrust(), wanted_.data(), wanted_.size(), detail::no_key);
}

template <class Exec>
void field_store<Exec>::begin_sample(const Exec& exec, std::uint32_t sample) {
  sample_ = sample;
  waves_ = 0;
  adapted_ = false;
  exec.for_each(max<std::size_t>(capacity_, 1), detail::begin_slots{view(), fields_.data(), state_.data(),
                                                                    counts(), sample, options_.idle_samples});
  exec.fill_bytes(table_.data(), 0xff, table_.bytes());  // no_entry
  const array_view<std::uint32_t> free_through(list_.data(), capacity_);
  ::thrust::transform_inclusive_scan(exec.thrust(), slots_.data(), slots_.data() + capacity_,
                                     free_through.data(), detail::is_free{}, ::thrust::plus<std::uint32_t>());
  exec.for_each(max<std::size_t>(capacity_, 1),
                detail::index_slots{view(), free_through.data(), free_slots_.data(), state_.data()});
  counted_samples_ += counts_rays() ? 1 : 0;
}

template <class Exec>
void field_store<Exec>::end_sample(const Exec& exec, bool told) {
  if (told) learn(exec);
  const bool is_power_of_two = (sample_ & (sample_ - 1)) == 0;
  if (sample_ == 0 || !is_power_of_two) return;
  expect_builds(busy_samples);
  if (sample_ > 1 && !adapted_) {  // in the first, bins are as large as they may be
    exec.fill_bytes(&state_.data()->used, 0, sizeof(std::uint32_t));
    exec.for_each(capacity_, detail::count_used{slots_.view(), sample_ / 2, state_.data()});
    exec.for_each(1, detail::adapt_pressure{state_.data(), capacity_, sample_});
    adapted_ = true;
  }
  marks_.mark(exec, counted_samples_, capacity_, &state_.data()->pressure);
}

/// Adds what the sample's paths found to the fields' means.
template <class Exec>
void field_store<Exec>::learn(const Exec& exec) {
  if (!learns()) return;
  queue_.sum(exec);
  exec.for_each_block(
      capacity_, 0,
      detail::fold_learnt{slots_.view(), sample_, cells_a_field(), queue_.view(), learnt_.data()});
}

template <class Exec>
template <class Surfaces, class Caster>
guide_view field_store<Exec>::prepare(const Exec& exec, const kept_field_wave<Surfaces>& wave,
                                      const Caster& caster, std::size_t caster_buffer_bytes) {
  static_assert(is_ray_caster_v<Caster, Exec>,
                "caster: needs ray_hit operator()(const ray&) const, or cast(exec, rays, hits) const");
  begin_wave(exec, wave);
  find(exec, wave);
  const detail::kept_fields_view kept{
      view(),         fields_.data(),           words_.data(),       hits_.data(),
      learnt_.data(), options_.cone_samples,    options_.resolution, options_.recast,
      sample_,        &state_.data()->refreshed};
  if (builds_in_wave())
    build(exec, detail::kept_field_builder<kept_field_wave<Surfaces>>{wave, kept}, caster,
          caster_buffer_bytes);
  end_wave();
  return {{field_of_ray_.data(), wave.ray_count}, fields(wave.points)};
}

template <class Exec>
template <class Surfaces, class Serve>
void field_store<Exec>::find_and_serve(const Exec& exec, const kept_field_wave<Surfaces>& wave,
                                       const Serve& serve) {
  begin_wave(exec, wave);
  exec.for_each_run(wave.ray_count, detail::find_and_serve<wave_rays<Surfaces>, Serve>{
                                        finder(wave, detail::wanted_builds::none), serve, other_counts()});
  end_wave();
}

template <class Exec>
template <class Surfaces>
void field_store<Exec>::begin_wave(const Exec& exec, const kept_field_wave<Surfaces>& wave) {
  require(wave.ray_count <= field_of_ray_.size(), "ray_count", wave.ray_count, "at most max_rays");
  detail::require_product_resolution(wave.points.resolution, "kept.resolution", options_.resolution);
  if (in_wave_) exec.for_each(max<std::size_t>(capacity_, 1), detail::forget_wave{slots_.view(), counts()});
  in_wave_ = true;
}

/// What finds a ray's slot.
template <class Exec>
template <class Surfaces>
detail::find_field<wave_rays<Surfaces>> field_store<Exec>::finder(const kept_field_wave<Surfaces>& wave,
                                                                  detail::wanted_builds wanted_now) {
  const detail::build_list builds{list_.data(), counts()};
  const detail::use_slot use{view(), sample_, wave.seed, wanted_now, builds};
  return {{wave.surfaces, wave.mode},
          {counts(), wave.statistics},
          marks_.view(),
          {tree_, use},
          wanted(),
          counted()};
}

/// Gives rays their slots, new ones where there is room.
template <class Exec>
template <class Surfaces>
void field_store<Exec>::find(const Exec& exec, const kept_field_wave<Surfaces>& wave) {
  using detail::wanted_builds;
  const auto find = finder(wave, !builds_in_wave() ? wanted_builds::none
                                 : limits_builds() ? wanted_builds::marked
                                                   : wanted_builds::listed);
  const detail::ray_blocks blocks{wave.ray_count, field_of_ray_.data(), find.counts};
  exec.for_each_block(blocks.size(), 0,
                      detail::find_fields<wave_rays<Surfaces>>{find, blocks, other_counts()});
  if (!builds_in_wave()) return;
  bear(exec);
  exec.for_each_block(blocks.size(), 0, detail::find_missing_fields{blocks, find.ancestor});
  if (limits_builds()) list(exec, wave.seed, find.ancestor.use.builds);
}

/// Gives free slots to wanted keys.
template <class Exec>
void field_store<Exec>::bear(const Exec& exec) {
  using detail::bear_fields;
  exec.for_each_block(1, bear_fields::scratch_bytes(),
                      bear_fields{view(), wanted(), wanted_through_.data(), free_slots_.data(), counts(),
                                  state_.data(), options_.max_wave_cones / cells_a_field()});
}

/// Lists the slots to build, under a limit.
template <class Exec>
void field_store<Exec>::list(const Exec& exec, std::uint64_t seed, const detail::build_list& builds) {
  if (capacity_ == 0) return;
  ::thrust::transform_inclusive_scan(exec.thrust(), slots_.data(), slots_.data() + capacity_, through_.data(),
                                     detail::is_to_build{}, ::thrust::plus<std::uint64_t>());
  const detail::build_limits limits{options_.max_wave_cones, cells_a_field(), refresh_cones()};
  exec.for_each(capacity_, detail::list_builds{slots_.view(), through_.data(), limits, builds, seed});
}

/// Builds the listed slots' fields.
template <class Exec>
template <class Builder, class Caster>
void field_store<Exec>::build(const Exec& exec, const Builder& builder, const Caster& caster,
                              std::size_t buffer_bytes) {
  if constexpr (is_inline_caster_v<Caster>) {
    using build_type = detail::build_kept_fields<Builder, inline_hits<Caster>>;
    exec.for_each_block(
        exec::device_count{&counts()->builds, capacity_},
        field_scratch_bytes(options_.resolution, Exec::warps_per_block),
        detail::build_listed_fields<build_type>{
            {builder, {caster}, listed(true), true}, {builder, {caster}, listed(false), false}, counts()});
  } else {
    const std::uint32_t cells = builder.cone_count(true);
    const std::size_t room = max<std::size_t>(cells, buffer_bytes / (sizeof(ray) + sizeof(ray_hit)));
    const buffer<ray, Exec> cones(exec, min(room, capacity_ * cells));
    const buffer<ray_hit, Exec> hits(exec, cones.size());
    for (const bool whole : {true, false})
      build_batches(exec, builder, caster, whole,
                    read_element(exec, whole ? &counts()->all : &counts()->part), cones.view(), hits.view());
  }
}

/// The same through a batch caster, as many fields at once as the buffers hold.
template <class Exec>
template <class Builder, class Caster>
void field_store<Exec>::build_batches(const Exec& exec, const Builder& builder, const Caster& caster,
                                      bool whole, std::size_t count, array_view<ray> cones,
                                      array_view<ray_hit> hits) {
  const std::uint32_t cones_a_field = builder.cone_count(whole);
  const std::size_t at_once = cones.size() / cones_a_field;
  for (std::size_t first = 0; first < count; first += at_once) {
    const std::size_t n = min(at_once, count - first);
    const std::uint32_t* const list = listed(whole) + first;
    exec.for_each_block(n, 0, detail::write_kept_cones<Builder>{builder, cones, list, whole});
    caster.cast(exec, array_view<const ray>(cones.data(), n * cones_a_field),
                array_view<ray_hit>(hits.data(), n * cones_a_field));
    const stored_hits found{hits, 0, cones_a_field};
    exec.for_each_block(n, field_scratch_bytes(options_.resolution, Exec::warps_per_block),
                        detail::build_kept_fields<Builder, stored_hits>{builder, found, list, whole});
  }
}

template <class Exec>
std::vector<std::uint32_t> field_store<Exec>::keys(const Exec& exec) const {
  std::vector<std::uint32_t> result;
  for (const detail::field_slot& slot : slots_.to_host(exec)) result.push_back(slot.key);
  return result;
}

template <class Exec>
kept_field_statistics field_store<Exec>::statistics(const Exec& exec) const {
  const detail::field_store_state state = read_element(exec, state_.data());
  kept_field_statistics result;
  result.capacity = static_cast<std::uint32_t>(capacity_);
  result.live = sample_ > 0 ? result.capacity - (state.free - state.taken) : 0;
  result.bytes_a_slot = bytes_a_slot(options_.resolution, options_.learn);
  result.born = state.born;
  result.freed = state.born - result.live;
  result.refreshed = state.refreshed;
  result.refused = state.refused_births + state.delayed_births;
  return result;
}

template <class Exec>
std::size_t field_store<Exec>::slot_bytes() const {
  return slots_.bytes() + fields_.bytes() + words_.bytes() + hits_.bytes() + learnt_.bytes() +
         table_.bytes() + settled_.bytes() + wanted_.bytes() + wanted_through_.bytes() + free_slots_.bytes() +
         list_.bytes() + through_.bytes();
}

}  // namespace wfpg
