// Implementation of field_store.hpp.
#pragma once

#include <wfpg/guides/octree/field_store.hpp>

namespace wfpg {

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
                               std::size_t max_rays, std::size_t max_values, communicator* ranks,
                               std::optional<std::size_t> own_rays)
    : tree_(tree),
      options_(completed(checked(options, tree.node_count()), max_values)),
      schedule_(max_rays, tree.leaf_count()),
      marks_(exec, tree, binning, ranks != nullptr),
      table_(exec,
             tree.empty() ? 0 : options.budget_bytes / bytes_a_slot(options.resolution, options_.learn)),
      pool_(exec, table_.size(), options_.resolution, options_.learn ? max_values : 0, ranks),
      ranks_(exec, table_.size(), options_.learn, ranks),
      bright_(exec),
      field_of_ray_(exec, own_rays.value_or(max_rays)),
      counts_(exec, std::vector<field_wave_counts>(2)) {}

template <class Exec>
void field_store<Exec>::begin_sample(const Exec& exec, std::uint32_t sample, std::uint32_t age) {
  schedule_.begin_sample(sample, age);
  adapted_ = false;
  table_.begin_sample(exec, pool_.fields(), counts(), sample, options_.idle_samples);
  schedule_.count_sample();  // last: a call that threw is made again
}

template <class Exec>
void field_store<Exec>::share(const Exec& exec, detail::rank_exchange<Exec>& all, bool recorded) {
  const array_view<field_slot> slots = table_.view().slots;
  ranks_.share_use(exec, all, slots);
  if (recorded) {
    ranks_.share_fractions(exec, all, slots, schedule_.sample(), pool_.fractions());
    pool_.share(all);
  }
  if (schedule_.counts_rays()) marks_.share(exec, all);
}

template <class Exec>
void field_store<Exec>::end_sample(const Exec& exec, bool recorded, std::uint32_t log2_divisor) {
  if (recorded) pool_.learn(exec, table_.view().slots, schedule_.sample());
  const bool changes = log2_divisor != log2_divisor_;
  if (!schedule_.chooses_bins() && !changes) return;
  schedule_.expect_builds(build_schedule_constants::busy_samples);
  // In the first sample bins are as large as they may be. Where few paths are guided, few fields are used.
  if (schedule_.age() > 1 && log2_divisor_ == 0 && !adapted_) table_.adapt_pressure(exec, schedule_.age());
  adapted_ = true;
  marks_.mark(exec, schedule_.counted_samples(), table_.size(), &table_.state()->pressure, log2_divisor);
  log2_divisor_ = log2_divisor;
  if (changes && log2_divisor == 0) schedule_.begin_anew();
}

template <class Exec>
template <class Surfaces, class Caster>
guide_view field_store<Exec>::prepare(const Exec& exec, const kept_field_wave<Surfaces>& wave,
                                      const Caster& caster, std::size_t caster_buffer_bytes) {
  static_assert(is_ray_caster_v<Caster, Exec>,
                "caster: needs ray_hit operator()(const ray&) const, or cast(exec, rays, hits) const");
  begin_wave(exec, wave);
  find(exec, wave);
  const kept_fields_view kept{table_.view(),
                              pool_.fields(),
                              pool_.words(),
                              pool_.hits(),
                              pool_.means(),
                              pool_.fractions(),
                              options_.cone_samples,
                              options_.resolution,
                              options_.recast,
                              schedule_.sample(),
                              &table_.state()->refreshed,
                              ranks_.origins(),
                              bright_.view()};
  if (builds_in_wave()) {
    const kept_field_builder<kept_field_wave<Surfaces>> builder{wave, kept};
    if (ranks_) {
      ranks_.send_origins(exec, builder, rays_of(wave), wave.ray_count, field_of_ray_.data(),
                          table_.listed(true), counts());
      build_of_ranks(exec, builder, caster, caster_buffer_bytes);
    } else {
      build(exec, builder, caster, caster_buffer_bytes);
    }
  }
  end_wave();
  return {{field_of_ray_.data(), wave.ray_count}, fields(wave.points)};
}

template <class Exec>
template <class Surfaces, class Sampler>
void field_store<Exec>::find_and_sample(const Exec& exec, const kept_field_wave<Surfaces>& wave,
                                        const Sampler& sampler) {
  begin_wave(exec, wave);
  exec.for_each_run(wave.ray_count, detail::find_and_sample<wave_rays<Surfaces>, Sampler>{
                                        finder(wave, detail::wanted_builds::none), sampler, other_counts()});
  end_wave();
}

template <class Exec>
template <class Surfaces>
void field_store<Exec>::begin_wave(const Exec& exec, const kept_field_wave<Surfaces>& wave) {
  require(wave.ray_count <= field_of_ray_.size(), "ray_count", wave.ray_count, "at most max_rays");
  detail::require_product_resolution(wave.points.resolution, "kept.resolution", options_.resolution);
  if (in_wave_) table_.forget_wave(exec, counts());
  in_wave_ = true;
}

/// Returns what finds a ray's slot.
template <class Exec>
template <class Surfaces>
detail::find_field<wave_rays<Surfaces>> field_store<Exec>::finder(const kept_field_wave<Surfaces>& wave,
                                                                  detail::wanted_builds wanted_now) {
  const detail::use_slot use{table_.view(), schedule_.sample(), schedule_.light_age(),
                             wave.seed,     wanted_now,         table_.builds(counts())};
  return {rays_of(wave),   {counts(), wave.statistics},
          marks_.view(),   {tree_, use},
          table_.wanted(), schedule_.counted(wave.guided_paths.log2_divisor())};
}

/// Gives rays their slots, new ones where there is room.
template <class Exec>
template <class Surfaces>
void field_store<Exec>::find(const Exec& exec, const kept_field_wave<Surfaces>& wave) {
  using detail::wanted_builds;
  const auto find = finder(wave, !builds_in_wave()  ? wanted_builds::none
                                 : chooses_builds() ? wanted_builds::marked
                                                    : wanted_builds::listed);
  const detail::ray_blocks blocks{wave.ray_count, field_of_ray_.data(), find.counts};
  exec.for_each_block(blocks.size(), 0,
                      detail::find_fields<wave_rays<Surfaces>>{find, blocks, other_counts()});
  if (!builds_in_wave()) return;
  const std::uint32_t cells = pool_.cells_a_field();
  if (ranks_) ranks_.share_wanted(exec, table_.wanted_buckets(), counts());
  table_.allocate(exec, counts(), options_.max_wave_cones / cells);
  exec.for_each_block(blocks.size(), 0,
                      detail::find_missing_fields<wave_rays<Surfaces>>{blocks, find.ancestor, find.rays});
  if (ranks_) ranks_.share_origins(exec, table_.view().slots, table_.scratch());
  if (chooses_builds())
    table_.list_builds_within(exec, {options_.max_wave_cones, cells, refresh_cones()}, counts(), wave.seed);
}

/// Builds the listed slots' fields.
template <class Exec>
template <class Builder, class Caster>
void field_store<Exec>::build(const Exec& exec, const Builder& builder, const Caster& caster,
                              std::size_t buffer_bytes) {
  if constexpr (is_inline_caster_v<Caster>) {
    using build_type = build_kept_fields<Builder, inline_hits<Caster>>;
    exec.for_each_block(exec::device_count{&counts()->builds, table_.size()},
                        kept_scratch_bytes(options_.resolution, Exec::warps_per_block),
                        build_listed_fields<build_type>{{builder, {caster}, table_.listed(true), true},
                                                        {builder, {caster}, table_.listed(false), false},
                                                        counts()});
  } else {
    const std::uint32_t cells = builder.cone_count(true);
    const std::size_t room = max<std::size_t>(cells, buffer_bytes / (sizeof(ray) + sizeof(ray_hit)));
    const buffer<ray, Exec> cones(exec, min(room, table_.size() * cells));
    const buffer<ray_hit, Exec> hits(exec, cones.size());
    for (const bool whole : {true, false})
      build_batches(exec, builder, caster, whole,
                    read_element(exec, whole ? &counts()->all : &counts()->part), cones.view(), hits.view());
  }
}

/// Builds the listed slots' fields. Ranks share the cones, and exchange what these hit.
template <class Exec>
template <class Builder, class Caster>
void field_store<Exec>::build_of_ranks(const Exec& exec, const Builder& builder, const Caster& caster,
                                       std::size_t buffer_bytes) {
  const std::size_t of_wholes = ranks_.builds(true) * builder.cone_count(true);
  const array_view<cone_hit> found =
      ranks_.begin_hits(exec, of_wholes + ranks_.builds(false) * builder.cone_count(false));
  if (found.empty()) return;
  for (const bool whole : {true, false})
    cast_part(exec, builder, caster, buffer_bytes, whole, found.data() + (whole ? 0 : of_wholes));
  ranks_.share_hits(found);
  for (const bool whole : {true, false})
    exec.for_each_block(ranks_.builds(whole), kept_scratch_bytes(options_.resolution, Exec::warps_per_block),
                        detail::finish_listed_fields<Builder>{builder, table_.listed(whole), whole,
                                                              found.data() + (whole ? 0 : of_wholes)});
}

/// Casts the cones of this rank's part of one list.
template <class Exec>
template <class Builder, class Caster>
void field_store<Exec>::cast_part(const Exec& exec, const Builder& builder, const Caster& caster,
                                  std::size_t buffer_bytes, bool whole, cone_hit* found) {
  const std::uint32_t rank = ranks_.ranks().rank(), cells = builder.cone_count(whole);
  const std::size_t first = ranks_.first_build(whole, rank), n = ranks_.first_build(whole, rank + 1) - first;
  const std::uint32_t* const list = table_.listed(whole) + first;
  found += first * cells;
  if (n == 0) return;
  if constexpr (is_inline_caster_v<Caster>) {
    exec.for_each_block(
        n, detail::aimed_cells::scratch_bytes,
        detail::cast_listed_cones<Builder, inline_hits<Caster>>{builder, {caster}, list, whole, found});
  } else {
    const std::size_t room = max<std::size_t>(cells, buffer_bytes / (sizeof(ray) + sizeof(ray_hit)));
    const buffer<ray, Exec> cones(exec, min(room, n * cells));
    const buffer<ray_hit, Exec> hits(exec, cones.size());
    cast_in_batches(
        exec, caster, n, cells, cones.view(), hits.view(),
        [&](std::size_t begin, std::size_t count, array_view<ray> to) {
          exec.for_each_block(count, detail::aimed_cells::scratch_bytes,
                              write_kept_cones<Builder>{builder, to, list + begin, whole});
        },
        [&](std::size_t begin, std::size_t count, array_view<ray_hit> from) {
          const stored_hits stored{from, 0, cells};
          exec.for_each_block(count, detail::aimed_cells::scratch_bytes,
                              detail::cast_listed_cones<Builder, stored_hits>{builder, stored, list + begin,
                                                                              whole, found + begin * cells});
        });
  }
}

/// Builds the fields of one list through a batch caster.
template <class Exec>
template <class Builder, class Caster>
void field_store<Exec>::build_batches(const Exec& exec, const Builder& builder, const Caster& caster,
                                      bool whole, std::size_t count, array_view<ray> cones,
                                      array_view<ray_hit> hits) {
  const std::uint32_t cones_a_field = builder.cone_count(whole);
  const std::uint32_t* const list = table_.listed(whole);
  cast_in_batches(
      exec, caster, count, cones_a_field, cones, hits,
      [&](std::size_t first, std::size_t n, array_view<ray> to) {
        exec.for_each_block(n, detail::aimed_cells::scratch_bytes,
                            write_kept_cones<Builder>{builder, to, list + first, whole});
      },
      [&](std::size_t first, std::size_t n, array_view<ray_hit> from) {
        const stored_hits found{from, 0, cones_a_field};
        exec.for_each_block(n, kept_scratch_bytes(options_.resolution, Exec::warps_per_block),
                            build_kept_fields<Builder, stored_hits>{builder, found, list + first, whole});
      });
}

template <class Exec>
std::vector<std::uint32_t> field_store<Exec>::keys(const Exec& exec) const {
  std::vector<std::uint32_t> result;
  for (const field_slot& slot : table_.to_host(exec)) result.push_back(slot.key);
  return result;
}

template <class Exec>
kept_field_statistics field_store<Exec>::statistics(const Exec& exec) const {
  const field_store_state counted = read_element(exec, state());
  kept_field_statistics result;
  result.capacity = static_cast<std::uint32_t>(table_.size());
  result.live = schedule_.sample() > 0 ? result.capacity - (counted.free - counted.taken) : 0;
  result.bytes_a_slot = bytes_a_slot(options_.resolution, options_.learn);
  result.allocated = counted.allocated;
  result.freed = counted.allocated - result.live;
  result.refreshed = counted.refreshed;
  result.refused = counted.refused + counted.delayed;
  return result;
}

}  // namespace wfpg
