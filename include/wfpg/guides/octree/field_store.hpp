// Stores kept fields: incident radiance fields that stay across depths and samples, in slots under a byte
// budget. Each is keyed by (octree node, orientation). A slot stores what each cell's cone hit, and what
// paths found along its directions. A refresh reads the cache anew through those hits, and casts only a part
// of the cones again.
//
// Source: fields are those of Yalciner and Akyuz (2024), section 3.3. Nodes are chosen by its Algorithm 2.
// Keeping fields and learning are wfpg's own.
//
// A sample:  begin_sample, then for each wave prepare, or find_and_sample where it would build none, then
//   aim where the cache changed, then end_sample; with ranks share before that. Nothing is read back to the
//   host with an inline caster.
//
// Cost of a wave of n rays: O(n · depth) look-ups. A new slot casts F² cones, and a refresh F²/R; either
// takes O(F²). Memory: the budget, 4 bytes a ray, 8 bytes a leaf and 4 an inner node. Where fields learn, a
// sample takes 16 bytes a cell and 8 a value more.
#pragma once

#include <wfpg/bins/wave_rays.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/build_schedule.hpp>
#include <wfpg/guides/octree/detail/bin_marks.hpp>
#include <wfpg/guides/octree/detail/bright_nodes.hpp>
#include <wfpg/guides/octree/detail/field_pool.hpp>
#include <wfpg/guides/octree/detail/field_ranks.hpp>
#include <wfpg/guides/octree/detail/rank_builds.hpp>
#include <wfpg/guides/octree/detail/slot_table.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/kept_field.hpp>
#include <wfpg/guides/octree/options.hpp>

#include <optional>
#include <vector>

namespace wfpg {

/// Input of one wave: its rays, and how their fields are built.
///   Surfaces  (std::uint32_t ray) -> surface<Bsdf>
template <class Surfaces>
struct kept_field_wave {
  std::size_t ray_count = 0;                   ///< rays of the wave, at most max_rays
  Surfaces surfaces;                           ///< where the rays have hit
  exitance_cache_view cache;                   ///< read by cones
  field_options options;                       ///< filter and floor
  guiding_mode mode = guiding_mode::oriented;  ///< decides between hemispheres and spheres
  float fraction = 0.7f;                       ///< of guided directions in the mixture
  std::uint64_t seed = 0;                      ///< of the sample and depth
  product_points points;                       ///< of products; P divides the store's resolution
  /// On the device: the wave's counts are added to it. Null: they are not counted.
  depth_statistics* statistics = nullptr;
  bool learns_fraction = true;      ///< fields keep what they learnt of it; false: they have `fraction`
  recorded_runs guided_paths = {};  ///< rays of other paths get no field
  /// Index of path 0 among the paths of all ranks; no_path without ranks.
  std::uint32_t first_path = no_path;
};

/// Owns the slots, in the memory of `Exec`. The octree must outlive it. Results do not depend on the number
/// of threads.
template <class Exec>
class field_store {
 public:
  /// An empty store, which can only be assigned to.
  field_store() = default;
  /// Makes a store for waves of up to `max_rays` rays over one octree. Fields learn up to `max_values` values
  /// in a sample, at most 2^31; 0: they do not learn. `ranks`: joins ranks with equal stores over the rays of
  /// all of them, `max_rays` in a wave; null: this is the only one. `own_rays`: this rank's part of max_rays.
  ///
  /// Throws out_of_memory. Throws std::invalid_argument where an option is out of its range, or the octree
  /// has 2^28 nodes or more.
  field_store(const Exec& exec, const sparse_voxel_octree_view& tree, const binning_options& binning,
              const kept_field_options& options, std::size_t max_rays, std::size_t max_values = 0,
              communicator* ranks = nullptr, std::optional<std::size_t> own_rays = {});

  /// Begins a sample, counted from 1. Frees the slots that no ray used for idle_samples samples. O(slots).
  /// `age`: the sample's number since light was last forgotten. Fields are due as in the sample of that
  /// number.
  void begin_sample(const Exec& exec, std::uint32_t sample, std::uint32_t age);

  /// Counts a wave's rays for bins, and guides none. For samples before guiding starts, so that bins are
  /// known then. `Rays`: (std::size_t) -> ray_to_bin, active for one path in
  /// 2^log2_divisor. O(n).
  template <class Rays>
  void count(const Exec& exec, std::size_t n, const Rays& rays, std::uint32_t log2_divisor = 0) {
    if (schedule_.counts_rays())
      exec.for_each(n, detail::count_rays<Rays>{rays, tree_, marks_.view(), schedule_.counted(log2_divisor)});
  }

  /// Finds or makes the fields of a wave's rays, and refreshes those that are due. Returns what kernels
  /// sample from, until the next call. A ray without room for its field has its nearest ancestor's, or none.
  /// build_schedule decides which waves build.
  ///
  /// A batch caster gets at most `caster_buffer_bytes` of cones at once, but at least one field's. The host
  /// then reads how many fields are built.
  ///
  /// Throws std::invalid_argument beyond max_rays, or where P does not divide the resolution. Throws what the
  /// caster throws; the wave's fields are then built again.
  template <class Surfaces, class Caster>
  guide_view prepare(const Exec& exec, const kept_field_wave<Surfaces>& wave, const Caster& caster,
                     std::size_t caster_buffer_bytes);

  /// Whether the next wave makes or refreshes fields.
  bool builds_in_wave() const { return schedule_.builds_in_wave(); }
  /// Finds the fields of a wave's rays and samples them in one pass; makes no field.
  ///   Sampler  (std::size_t ray, std::uint32_t field), the number of one of fields(), or no_field
  ///
  /// For waves in which prepare() would build none: builds_in_wave() is false. One pass stores no field
  /// numbers. Throws std::invalid_argument beyond max_rays, or where P does not divide the resolution.
  template <class Surfaces, class Sampler>
  void find_and_sample(const Exec& exec, const kept_field_wave<Surfaces>& wave, const Sampler& sampler);
  /// All fields, with a wave's points for products. Valid until the next wave is prepared.
  resident_fields fields(const product_points& points) const { return pool_.view(points); }

  /// Where kernels deposit what the sample's paths found; empty where fields do not learn. `with_fractions`:
  /// fields also learn their fractions of guided directions.
  learnt_radiance_view learnt(bool with_fractions = true) const { return pool_.learnt(with_fractions); }

  /// Adds what a sample's end needs of other ranks to an exchange, which must run before end_sample(). Only
  /// with ranks. `recorded`: as there.
  void share(const Exec& exec, detail::rank_exchange<Exec>& all, bool recorded);
  /// Ends the sample. Fields learn if anything was `recorded` in learnt(). After samples 1, 2, 4, 8, ...
  /// chooses bins anew by the rays counted so far. Also where another part of the paths is guided from the
  /// next sample on: one in 2^log2_divisor. Bins are then as much larger, so that they have as many guided
  /// rays. O(cells of fields used + values), and O(nodes) where bins are chosen.
  void end_sample(const Exec& exec, bool recorded = true, std::uint32_t log2_divisor = 0);

  /// Call after the cache changed. Refreshes then aim cones at nodes that are far brighter in it than what
  /// surrounds them. O(nodes of a level).
  void aim(const Exec& exec, const exitance_cache_view& cache) { bright_.find(exec, cache); }
  /// Forgets what fields learnt. Hits stay, and each field is built anew from them when it is next used and
  /// max_wave_cones has room. The next sample has the age 1.
  void forget(const Exec& exec) {
    schedule_.expect_builds(build_schedule_constants::invalidated_samples);
    pool_.forget(exec);
  }

  /// Call after geometry moved inside `bounds`, or light changed in a way that hits do not see. Fields that
  /// may see it cast all their cones when they are next used. Light that changes on surfaces needs no call.
  void invalidate(const Exec& exec, const bounds3& bounds) {
    schedule_.expect_builds(build_schedule_constants::invalidated_samples);
    exec.for_each(table_.size(), invalidate_fields{table_.view(), pool_.fields(), tree_, bounds});
  }
  /// Call after geometry moved anywhere: all fields cast all their cones when they are next used.
  void invalidate_all(const Exec& exec) { invalidate(exec, {vec3(-1.0e18f), vec3(1.0e18f)}); }

  /// Counters of the store, in the policy's memory.
  const field_store_state* state() const { return table_.state(); }
  /// Counters of the last wave, in the policy's memory. Valid until the next wave begins.
  const field_wave_counts* last_wave() const { return other_counts(); }
  /// Number of cones that one refresh of a field casts: F² / R, rounded up.
  std::uint32_t refresh_cones() const { return wfpg::refresh_cones(options_.resolution, options_.recast); }
  /// Counters since the store was made, and the slots in use. Waits for the work before it.
  kept_field_statistics statistics(const Exec& exec) const;
  /// Key of each slot's field: node * orientations + orientation; 0xffffffff where the slot is free. Waits
  /// for the work before it.
  std::vector<std::uint32_t> keys(const Exec& exec) const;
  /// Bytes of all slots, their fields, and the table that finds them. At most the budget, where it holds a
  /// slot.
  std::size_t slot_bytes() const { return table_.bytes() + pool_.bytes(); }
  /// Bytes of running ray counts and of each leaf's bin.
  std::size_t level_bytes() const { return marks_.bytes(); }
  /// Bytes needed while a wave is in flight: 4 a ray, and counters.
  std::size_t wave_bytes() const {
    return field_of_ray_.bytes() + counts_.bytes() + table_.state_bytes() + ranks_.bytes() + bright_.bytes();
  }
  /// Bytes of the queue of values that one sample learns; 0 where fields do not learn.
  std::size_t value_bytes() const { return pool_.value_bytes(); }

  /// Bytes of the budget that one slot takes, with fields of `resolution`² cells. `learns`: with a 2-byte
  /// mean in each cell.
  static std::size_t bytes_a_slot(std::uint32_t resolution, bool learns = true) {
    return detail::field_pool<Exec>::bytes_a_field(resolution, learns) + sizeof(field_slot) +
           detail::slot_table<Exec>::words_a_slot * sizeof(std::uint32_t);
  }

 private:
  friend struct detail::kept_state;

  static const kept_field_options& checked(const kept_field_options& options, std::uint32_t nodes);
  static kept_field_options completed(kept_field_options options, std::size_t max_values);
  // Whether builds are chosen among slots that rays mark. Ranks do so, to list equal builds in equal order.
  bool chooses_builds() const { return ranks_ || options_.max_wave_cones != detail::build_limits::none; }
  // Of the wave that is made, and of the one before or after it.
  field_wave_counts* counts() { return counts_.data() + schedule_.wave() % 2; }
  field_wave_counts* other_counts() const { return counts_.data() + (schedule_.wave() + 1) % 2; }

  template <class Surfaces>
  void begin_wave(const Exec& exec, const kept_field_wave<Surfaces>& wave);
  void end_wave() {
    schedule_.end_wave();
    in_wave_ = false;
  }
  template <class Surfaces>
  detail::find_field<wave_rays<Surfaces>> finder(const kept_field_wave<Surfaces>& wave,
                                                 detail::wanted_builds wanted_now);
  template <class Surfaces>
  wave_rays<Surfaces> rays_of(const kept_field_wave<Surfaces>& wave) const {
    return {wave.surfaces, wave.mode, wave.guided_paths, wave.first_path};
  }
  template <class Surfaces>
  void find(const Exec& exec, const kept_field_wave<Surfaces>& wave);
  template <class Builder, class Caster>
  void build(const Exec& exec, const Builder& builder, const Caster& caster, std::size_t buffer_bytes);
  template <class Builder, class Caster>
  void build_of_ranks(const Exec& exec, const Builder& builder, const Caster& caster,
                      std::size_t buffer_bytes);
  template <class Builder, class Caster>
  void cast_part(const Exec& exec, const Builder& builder, const Caster& caster, std::size_t buffer_bytes,
                 bool whole, cone_hit* found);
  template <class Builder, class Caster>
  void build_batches(const Exec& exec, const Builder& builder, const Caster& caster, bool whole,
                     std::size_t count, array_view<ray> cones, array_view<ray_hit> hits);

  sparse_voxel_octree_view tree_;
  kept_field_options options_;
  build_schedule schedule_;
  detail::bin_marks<Exec> marks_;
  detail::slot_table<Exec> table_;
  detail::field_pool<Exec> pool_;
  detail::field_ranks<Exec> ranks_;
  detail::bright_nodes<Exec> bright_;  // follows from the cache, so that files do not hold it
  buffer<std::uint32_t, Exec> field_of_ray_;
  buffer<field_wave_counts, Exec> counts_;
  bool in_wave_ = false;            // also after one whose caster threw
  std::uint32_t log2_divisor_ = 0;  // bins are for rays of one path in 2^this
  bool adapted_ = false;            // bins to this sample: not twice where its end is made again
};

}  // namespace wfpg

#include <wfpg/guides/octree/detail/field_store_impl.hpp>
