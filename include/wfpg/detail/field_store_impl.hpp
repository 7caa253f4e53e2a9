// Implementation of field_store.hpp.
#pragma once

#include <wfpg/field_store.hpp>

namespace wfpg {
namespace detail {

/// The state as a sample begins.
struct begin_store_sample {
  field_store_state* state;
  WFPG_HD void operator()(std::size_t) const {
    state->refused_births_before = state->refused_births;
    state->refused_births = state->delayed_births = 0;
    state->taken = 0;
  }
};

/// The state as a wave begins; origins that a wave before left behind, where its caster threw, are void.
struct begin_store_wave {
  array_view<field_slot> slots;
  array_view<std::uint8_t> settled;
  field_store_state* state;
  std::uint32_t sample;
  WFPG_HD void operator()(std::size_t i) const {
    if (i < slots.size()) {
      slots[i].origin = field_slot::unpicked;
      settled[i] = slots[i].last_used == sample && !slots[i].is_due(sample);
    }
    if (i > 0) return;
    state->missing = state->unbinned = state->unserved = state->served = state->all = state->part =
        state->builds = 0;
  }
};

/// Where births were refused, bins are to be larger from the next marking on.
struct adapt_pressure {
  field_store_state* state;
  WFPG_HD void operator()(std::size_t) const {
    if (state->refused_since_mark > 0) state->pressure = min(2 * state->pressure, 1u << 16);
    state->refused_since_mark = 0;
  }
};

/// Counts a run of rays with fields.
struct count_served {
  static constexpr std::size_t run = 2048;
  array_view<const std::uint32_t> field_of_ray;
  const resident_field* fields;
  field_store_state* state;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    const std::size_t first = i * run;
    const auto n = static_cast<int>(min(run, field_of_ray.size() - first));
    const std::uint32_t served = block.sum(n, [&](int ray) {
      const std::uint32_t field = field_of_ray[first + static_cast<std::size_t>(ray)];
      return field != no_slot && fields[field].fraction > 0.0f ? 1u : 0u;
    });
    block.for_each(1, [&](int) { atomic_add(&state->served, served); });
  }
};

}  // namespace detail

template <class Exec>
const kept_field_options& field_store<Exec>::checked(const kept_field_options& o, std::uint32_t nodes) {
  using detail::require;
  require(o.resolution >= 2 && o.resolution <= 128, "kept.resolution", o.resolution, "in [2, 128]");
  require(o.recast >= 1, "kept.recast", o.recast, "at least 1");
  require(o.idle_samples >= 1, "kept.idle_samples", o.idle_samples, "at least 1");
  require(o.budget_bytes / bytes_a_slot(o.resolution) < (1u << 30), "kept.budget_bytes", o.budget_bytes,
          "less than 2^30 slots");
  require(nodes < (1u << 29), "number of octree nodes", nodes, "less than 2^29");
  return o;
}

template <class Exec>
field_store<Exec>::field_store(const Exec& exec, const sparse_voxel_octree_view& tree,
                               const binning_options& binning, const kept_field_options& options,
                               std::size_t max_rays)
    : tree_(tree),
      options_(checked(options, tree.node_count())),
      capacity_(tree.empty() ? 0 : options.budget_bytes / bytes_a_slot(options.resolution)),
      marks_(exec, tree, binning),
      slots_(exec, std::vector<detail::field_slot>(capacity_)),
      fields_(exec, std::vector<resident_field>(capacity_)),
      words_(exec, capacity_ * options.resolution * options.resolution),
      hits_(exec, capacity_ * options.resolution * options.resolution),
      free_slots_(exec, capacity_),
      list_(exec, 2 * capacity_),
      through_(exec, capacity_),
      field_of_ray_(exec, max_rays),
      missing_keys_(exec, max_rays),
      state_(exec, std::vector<detail::field_store_state>(1)) {
  options_.recast = detail::min(options.recast, options.resolution * options.resolution);
  std::size_t entries = 2;
  while (entries < 2 * capacity_) entries *= 2;
  table_ = buffer<std::uint64_t, Exec>(exec, entries);
  settled_ = buffer<std::uint8_t, Exec>(exec, capacity_);
  while (max_rays / stride_ > 8 * std::size_t(tree.leaf_count()) && stride_ < 32) stride_ *= 2;
  wanted_ = buffer<std::uint32_t, Exec>(exec, entries);
  wanted_through_ = buffer<std::uint32_t, Exec>(exec, entries);
  exec.fill_bytes(table_.data(), 0xff, table_.bytes());
  ::thrust::fill_n(exec.thrust(), wanted_.data(), entries, detail::no_key);
}

template <class Exec>
void field_store<Exec>::begin_sample(const Exec& exec, std::uint32_t sample) {
  sample_ = sample;
  counted_samples_ += counts_rays() ? 1 : 0;
  exec.for_each(1, detail::begin_store_sample{state_.data()});
  exec.for_each(capacity_, detail::evict_fields{slots_.view(), fields_.data(), state_.data(), sample,
                                                options_.idle_samples});
  exec.fill_bytes(table_.data(), 0xff, table_.bytes());  // no_entry
  const array_view<std::uint32_t> free_through(list_.data(), capacity_);
  ::thrust::transform_inclusive_scan(exec.thrust(), slots_.data(), slots_.data() + capacity_,
                                     free_through.data(), detail::is_free{}, ::thrust::plus<std::uint32_t>());
  exec.for_each(capacity_,
                detail::index_slots{view(), free_through.data(), free_slots_.data(), state_.data()});
}

template <class Exec>
void field_store<Exec>::end_sample(const Exec& exec) {
  const bool is_power_of_two = (sample_ & (sample_ - 1)) == 0;
  if (sample_ == 0 || !is_power_of_two) return;
  exec.for_each(1, detail::adapt_pressure{state_.data()});
  marks_.mark(exec, counted_samples_, capacity_, &state_.data()->pressure);
}

template <class Exec>
template <class Surfaces, class Caster>
guide_view field_store<Exec>::prepare(const Exec& exec, const kept_field_wave<Surfaces>& wave,
                                      const Caster& caster, std::size_t caster_buffer_bytes) {
  static_assert(is_ray_caster_v<Caster, Exec>,
                "caster: needs ray_hit operator()(const ray&) const, or cast(exec, rays, hits) const");
  detail::require(wave.ray_count <= field_of_ray_.size(), "ray_count", wave.ray_count, "at most max_rays");
  detail::require_product_resolution(wave.points.resolution, "kept.resolution", options_.resolution);
  find(exec, wave);
  list(exec, wave.seed);
  const detail::kept_fields_view kept{slots_.view(),       fields_.data(),  words_.data(), hits_.data(),
                                      options_.resolution, options_.recast, sample_};
  build(exec, detail::kept_field_builder<kept_field_wave<Surfaces>>{wave, kept}, caster, caster_buffer_bytes);
  const array_view<const std::uint32_t> field_of_ray(field_of_ray_.data(), wave.ray_count);
  const std::size_t run = detail::count_served::run;
  exec.for_each_block((wave.ray_count + run - 1) / run, 0,
                      detail::count_served{field_of_ray, fields_.data(), state_.data()});
  return {field_of_ray, {fields_.data(), words_.data(), options_.resolution, wave.points}};
}

/// Gives rays their slots, new ones where there is room.
template <class Exec>
template <class Surfaces>
void field_store<Exec>::find(const Exec& exec, const kept_field_wave<Surfaces>& wave) {
  using rays_type = detail::wave_rays<Surfaces>;
  const auto n = static_cast<std::uint32_t>(wave.ray_count);
  const detail::use_slot use{view(), field_of_ray_.data(), sample_, wave.seed};
  exec.for_each(detail::max<std::size_t>(capacity_, 1),
                detail::begin_store_wave{slots_.view(), settled_.view(), state_.data(), sample_});
  exec.for_each(n, detail::find_fields<rays_type>{{wave.surfaces, wave.mode},
                                                  tree_,
                                                  marks_.view(),
                                                  use,
                                                  wanted(),
                                                  missing_keys_.data(),
                                                  state_.data(),
                                                  n,
                                                  counted()});
  const detail::count_births births = bear(exec);
  exec.for_each(exec::device_count{&state_.data()->missing, n},
                detail::find_missing_fields{tree_, use, missing_keys_.data(), state_.data(), births});
}

/// Gives free slots to wanted keys; what is left is to count them.
template <class Exec>
detail::count_births field_store<Exec>::bear(const Exec& exec) {
  const std::uint32_t cells = options_.resolution * options_.resolution;
  ::thrust::transform_inclusive_scan(exec.thrust(), wanted_.data(), wanted_.data() + wanted_.size(),
                                     wanted_through_.data(), detail::is_wanted{},
                                     ::thrust::plus<std::uint32_t>());
  const detail::bear_fields births{view(),
                                   wanted(),
                                   wanted_through_.data(),
                                   free_slots_.data(),
                                   state_.data(),
                                   options_.max_wave_cones / cells};
  exec.for_each(wanted_.size(), births);
  return {births, state_.data()};
}

/// Lists the slots to build.
template <class Exec>
void field_store<Exec>::list(const Exec& exec, std::uint64_t seed) {
  if (capacity_ == 0) return;
  if (options_.max_wave_cones == detail::build_limits::none)
    return exec.for_each(capacity_, detail::list_all_builds{slots_.view(), list_.data(), state_.data()});
  ::thrust::transform_inclusive_scan(exec.thrust(), slots_.data(), slots_.data() + capacity_, through_.data(),
                                     detail::is_to_build{}, ::thrust::plus<std::uint64_t>());
  const detail::build_limits limits{options_.max_wave_cones, options_.resolution * options_.resolution,
                                    refresh_cones()};
  exec.for_each(capacity_, detail::list_builds{slots_.view(), through_.data(), limits, list_.data(),
                                               state_.data(), seed});
}

/// Builds the listed slots' fields.
template <class Exec>
template <class Builder, class Caster>
void field_store<Exec>::build(const Exec& exec, const Builder& builder, const Caster& caster,
                              std::size_t buffer_bytes) {
  if constexpr (is_inline_caster_v<Caster>) {
    using build_type = detail::build_kept_fields<Builder, detail::inline_hits<Caster>>;
    exec.for_each_block(exec::device_count{&state_.data()->builds, capacity_},
                        detail::field_scratch_bytes(options_.resolution, Exec::warps_per_block),
                        detail::build_listed_fields<build_type>{{builder, {caster}, listed(true), true},
                                                                {builder, {caster}, listed(false), false},
                                                                state_.data()});
  } else {
    const std::uint32_t* const counts[2] = {&state_.data()->part, &state_.data()->all};
    const std::uint32_t cells = builder.cone_count(true);
    const std::size_t room = detail::max<std::size_t>(cells, buffer_bytes / (sizeof(ray) + sizeof(ray_hit)));
    const buffer<ray, Exec> cones(exec, detail::min(room, capacity_ * cells));
    const buffer<ray_hit, Exec> hits(exec, cones.size());
    for (const bool whole : {true, false})
      build_batches(exec, builder, caster, whole, read_element(exec, counts[whole]), cones.view(),
                    hits.view());
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
    const std::size_t n = detail::min(at_once, count - first);
    const std::uint32_t* const list = listed(whole) + first;
    exec.for_each_block(n, 0, detail::write_kept_cones<Builder>{builder, cones, list, whole});
    caster.cast(exec, array_view<const ray>(cones.data(), n * cones_a_field),
                array_view<ray_hit>(hits.data(), n * cones_a_field));
    const detail::stored_hits found{hits, 0, cones_a_field};
    exec.for_each_block(n, detail::field_scratch_bytes(options_.resolution, Exec::warps_per_block),
                        detail::build_kept_fields<Builder, detail::stored_hits>{builder, found, list, whole});
  }
}

template <class Exec>
kept_field_statistics field_store<Exec>::statistics(const Exec& exec) const {
  const detail::field_store_state state = read_element(exec, state_.data());
  kept_field_statistics result;
  result.capacity = static_cast<std::uint32_t>(capacity_);
  result.live = sample_ > 0 ? result.capacity - (state.free - state.taken) : 0;
  result.bytes_a_slot = bytes_a_slot(options_.resolution);
  result.born = state.born;
  result.freed = state.born - result.live;
  result.refreshed = state.refreshed;
  result.refused = state.refused_births + state.delayed_births;
  return result;
}

template <class Exec>
std::size_t field_store<Exec>::slot_bytes() const {
  return slots_.bytes() + fields_.bytes() + words_.bytes() + hits_.bytes() + table_.bytes() +
         settled_.bytes() + wanted_.bytes() + wanted_through_.bytes() + free_slots_.bytes() + list_.bytes() +
         through_.bytes();
}

}  // namespace wfpg
