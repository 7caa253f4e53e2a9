// Kept fields: incident radiance fields that live on across depths and samples, in slots under a byte budget,
// keyed by (octree node, orientation). A slot remembers what each cell's cone hit, and what paths found along
// its directions; a refresh reads the cache anew through those hits and casts only a part of the cones again.
// Fields are the paper's (section 3.3), and their nodes are chosen as its bins are (Algorithm 2); that they
// are kept and that they learn is wfpg's own.
//
// A sample:  begin_sample, then for each wave prepare, or find_and_serve where it would build none, then
//            end_sample. Nothing is read back to the host with an inline caster.
//
// Cost of a wave of n rays: O(n · depth) look-ups; F² cones a new slot, F²/R a refreshed one; O(F²) either.
// Memory: the budget, 4 bytes a ray, 8 bytes a leaf and 4 an inner node; where fields learn, in a sample, 16
// bytes a cell and 8 a value.
#pragma once

#include <wfpg/bins/wave_rays.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/detail/allot_slots.hpp>
#include <wfpg/guides/octree/detail/bin_marks.hpp>
#include <wfpg/guides/octree/detail/field_slots.hpp>
#include <wfpg/guides/octree/detail/kept_field.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/learnt_radiance.hpp>
#include <wfpg/guides/octree/transient_fields.hpp>

#include <thrust/fill.h>
#include <thrust/functional.h>
#include <thrust/transform_scan.h>

#include <vector>

namespace wfpg {

/// How fields are kept.
struct kept_field_options {
  std::uint32_t resolution = 24;  ///< cells along a field's side, in [2, 128]
  std::uint32_t recast = 32;      ///< R: a refresh casts one cone in so many again, at least 1
  std::size_t budget_bytes = std::size_t(24) << 20;  ///< of the slots; one takes about 10 F² bytes, or 8
  bool learn = true;          ///< from paths: where path_recorder_view::scatter() is called, or by itself
  float cone_samples = 1.0f;  ///< what a cell's cone counts for beside so many paths, positive and finite
  std::uint64_t max_wave_cones =
      detail::build_limits::none;   ///< cones of a wave; what would need more waits, or goes unguided
  std::uint32_t idle_samples = 16;  ///< a slot that no ray used for so many is freed, at least 1
};

/// What fields are made for in one wave.
///   Surfaces  (std::uint32_t ray) -> surface<Bsdf>
template <class Surfaces>
struct kept_field_wave {
  std::size_t ray_count = 0;                   ///< rays of the wave, at most max_rays
  Surfaces surfaces;                           ///< where they are
  exitance_cache_view cache;                   ///< what cones read
  field_options options;                       ///< filter and floor
  guiding_mode mode = guiding_mode::oriented;  ///< what fields cover
  float fraction = 0.7f;                       ///< of guided samples in the mixture
  std::uint64_t seed = 0;                      ///< of the sample and depth
  product_points points;                       ///< P divides the store's resolution
  depth_statistics* statistics = nullptr;      ///< on the device: the wave's counts are added; null: nowhere
};

/// Owns the slots, in the memory of `Exec`. The octree must outlive it. Results do not depend on the number
/// of threads.
template <class Exec>
class field_store {
 public:
  field_store() = default;
  /// Serves waves of up to `max_rays` rays, and learns up to `max_values`, at most 2³¹, in a sample. Throws
  /// out_of_memory; std::invalid_argument where an option is out of its range, or the octree has 2²⁸ nodes or
  /// more.
  field_store(const Exec& exec, const sparse_voxel_octree_view& tree, const binning_options& binning,
              const kept_field_options& options, std::size_t max_rays, std::size_t max_values = 0);

  /// Begins a sample, counted from 1: frees slots that are no longer used.
  void begin_sample(const Exec& exec, std::uint32_t sample);

  /// Counts a wave's rays and guides none. `Rays`: (std::size_t) -> ray_to_bin.
  template <class Rays>
  void count(const Exec& exec, std::size_t n, const Rays& rays) {
    if (counts_rays()) exec.for_each(n, detail::count_rays<Rays>{rays, tree_, marks_.view(), counted()});
  }

  /// Finds or makes the fields of a wave's rays, and refreshes those that are due; what kernels sample from,
  /// until the next call. A ray without room for its field has its nearest ancestor's, or none. After 32
  /// samples little is left to make: one wave in 8 does then, but for 4 samples after nodes were chosen anew,
  /// and the others use what there is. A batch caster gets at most `caster_buffer_bytes` of cones at once,
  /// and the host reads how many fields are built. Throws std::invalid_argument beyond max_rays, or where P
  /// does not divide; what a caster throws, and then the wave's fields are built again.
  template <class Surfaces, class Caster>
  guide_view prepare(const Exec& exec, const kept_field_wave<Surfaces>& wave, const Caster& caster,
                     std::size_t caster_buffer_bytes);

  /// Whether the next wave makes or refreshes fields.
  bool builds_in_wave() const { return sample_ <= busy_until_ || (sample_ + waves_) % turns == 0; }
  /// Finds the fields of a wave's rays, makes none, and draws from those that there are in the same pass:
  ///   Serve  (std::size_t ray, std::uint32_t field), the number of one of fields(), or no_field
  /// For waves in which prepare() would make none either. Throws std::invalid_argument beyond max_rays, or
  /// where P does not divide.
  template <class Surfaces, class Serve>
  void find_and_serve(const Exec& exec, const kept_field_wave<Surfaces>& wave, const Serve& serve);
  /// All fields, with a wave's points for products.
  resident_fields fields(const product_points& points) const {
    return {fields_.data(), words_.data(), options_.resolution, points};
  }

  /// Where the sample's paths tell what they found; empty where fields do not learn.
  learnt_radiance_view learnt() const {
    if (!learns()) return {};
    return {array_view<const resident_field>(fields_.data(), capacity_), options_.resolution, queue_.view()};
  }

  /// Ends the sample: fields learn, unless nothing was `told` to learnt(); after samples 1, 2, 4, 8, ...
  /// chooses the nodes anew by the rays counted so far.
  void end_sample(const Exec& exec, bool told = true);

  /// Forgets what fields learnt.
  void forget(const Exec& exec) {
    exec.fill_bytes(learnt_.data(), 0, learnt_.bytes());
    if (learns()) queue_.clear(exec);
  }

  /// Geometry moved inside `bounds`, or light in a way that hits do not tell: fields from which they may be
  /// seen are cast anew when they are next used, or within 8 samples after 32 more. Light that changes on
  /// surfaces needs no call.
  void invalidate(const Exec& exec, const bounds3& bounds) {
    expect_builds(32);
    exec.for_each(capacity_, detail::invalidate_fields{view(), fields_.data(), tree_, bounds});
  }
  /// The same everywhere.
  void invalidate_all(const Exec& exec) { invalidate(exec, {vec3(-1.0e18f), vec3(1.0e18f)}); }

  /// On the device.
  const detail::field_store_state* state() const { return state_.data(); }
  /// Of the last wave, on the device.
  const detail::field_wave_counts* last_wave() const { return other_counts(); }
  /// Cones of a refresh.
  std::uint32_t refresh_cones() const { return detail::refresh_cones(options_.resolution, options_.recast); }
  /// Waits for the work before it.
  kept_field_statistics statistics(const Exec& exec) const;
  /// A slot: node · orientations + orientation of its field, 0xffffffff where it is free. Waits for the work
  /// before it.
  std::vector<std::uint32_t> keys(const Exec& exec) const;
  /// Of the slots and all that finds them.
  std::size_t slot_bytes() const;
  /// Of what decides the level: running counts and bins.
  std::size_t level_bytes() const { return marks_.bytes(); }
  /// Of a wave in flight.
  std::size_t wave_bytes() const { return field_of_ray_.bytes() + counts_.bytes() + state_.bytes(); }

  /// Of what a sample learns.
  std::size_t value_bytes() const { return queue_.bytes(); }

  /// Bytes of the budget that one slot takes at a resolution.
  static std::size_t bytes_a_slot(std::uint32_t resolution, bool learns = true) {
    const std::size_t cells = std::size_t(resolution) * resolution;
    const std::size_t a_cell = sizeof(cone_hit) + (learns ? sizeof(rough_mean) : 0);
    return a_cell * cells + sizeof(detail::field_slot) + sizeof(resident_field) +
           (grid_distribution::words(resolution) + words_a_slot) * sizeof(std::uint32_t);
  }

 private:
  friend struct detail::store_state;

  // Through-counts (2), list of builds (2), free list, what is settled, and at most 4 entries each of the
  // table (2) and of wanted keys with their own through-counts.
  static constexpr std::size_t words_a_slot = 2 + 2 + 1 + 1 + 8 + 4 + 4;

  static const kept_field_options& checked(const kept_field_options& options, std::uint32_t nodes);
  static kept_field_options completed(kept_field_options options, std::size_t max_values);
  detail::field_slots_view view() const { return {slots_.view(), table_.data(), mask(), settled_.data()}; }
  detail::wanted_keys wanted() const {
    return {wanted_.data(), static_cast<std::uint32_t>(wanted_.size() - 1)};
  }
  // Once there is little to build, waves take turns: one field keeps a GPU as long as a hundred.
  static constexpr std::uint32_t turns = 8;
  // Bins that are chosen anew ask for fields that are not there yet: in so many samples all waves make some.
  static constexpr std::uint32_t busy_samples = 4;
  void expect_builds(std::uint32_t samples) { busy_until_ = max(busy_until_, sample_ + samples); }
  bool learns() const { return learnt_.size() > 0; }
  bool limits_builds() const { return options_.max_wave_cones != detail::build_limits::none; }
  std::uint32_t cells_a_field() const { return options_.resolution * options_.resolution; }
  std::uint32_t words_a_field() const { return grid_distribution::words(options_.resolution); }
  // Of the wave that is made, and of the one before or after it.
  detail::field_wave_counts* counts() { return counts_.data() + waves_ % 2; }
  detail::field_wave_counts* other_counts() const { return counts_.data() + (waves_ + 1) % 2; }
  // Counts settle soon, and sooner where a leaf has many rays of a wave.
  bool counts_rays() const { return sample_ <= 8 || sample_ % (sample_ <= 32 ? 4 : 16) == 0; }
  detail::counted_rays counted() const {
    if (!counts_rays()) return {0, 0};
    return {stride_, sample_ % stride_};
  }
  std::uint32_t mask() const { return static_cast<std::uint32_t>(table_.size() - 1); }

  template <class Surfaces>
  void begin_wave(const Exec& exec, const kept_field_wave<Surfaces>& wave);
  void end_wave() {
    ++waves_;
    in_wave_ = false;
  }
  template <class Surfaces>
  detail::find_field<wave_rays<Surfaces>> finder(const kept_field_wave<Surfaces>& wave,
                                                 detail::wanted_builds wanted_now);
  template <class Surfaces>
  void find(const Exec& exec, const kept_field_wave<Surfaces>& wave);
  void bear(const Exec& exec);
  void learn(const Exec& exec);
  void list(const Exec& exec, std::uint64_t seed, const detail::build_list& builds);
  template <class Builder, class Caster>
  void build(const Exec& exec, const Builder& builder, const Caster& caster, std::size_t buffer_bytes);
  template <class Builder, class Caster>
  void build_batches(const Exec& exec, const Builder& builder, const Caster& caster, bool whole,
                     std::size_t count, array_view<ray> cones, array_view<ray_hit> hits);
  const std::uint32_t* listed(bool whole) const { return list_.data() + (whole ? 0 : capacity_); }

  sparse_voxel_octree_view tree_;
  kept_field_options options_;
  std::size_t capacity_ = 0;  // slots
  std::uint32_t sample_ = 0;
  std::uint32_t counted_samples_ = 0;
  std::uint32_t stride_ = 1;       // of the rays that are counted
  std::uint32_t waves_ = 0;        // of the sample
  std::uint32_t busy_until_ = 32;  // sample
  bool in_wave_ = false;           // also after one whose caster threw
  bool adapted_ = false;           // bins to this sample: not twice where its end is made again
  detail::bin_marks<Exec> marks_;
  buffer<detail::field_slot, Exec> slots_;
  buffer<resident_field, Exec> fields_;  // a slot
  buffer<std::uint32_t, Exec> words_;    // a slot: its distribution
  buffer<cone_hit, Exec> hits_;          // a slot: its cells
  buffer<rough_mean, Exec> learnt_;      // the same, where fields learn
  detail::value_queue<Exec> queue_;
  buffer<std::uint64_t, Exec> table_;
  buffer<std::uint8_t, Exec> settled_;
  buffer<std::uint32_t, Exec> wanted_, wanted_through_;
  buffer<std::uint32_t, Exec> free_slots_, list_;  // list: to cast whole, then to refresh
  buffer<std::uint64_t, Exec> through_;            // a slot: scans
  buffer<std::uint32_t, Exec> field_of_ray_;
  buffer<detail::field_store_state, Exec> state_;
  buffer<detail::field_wave_counts, Exec> counts_;
};

}  // namespace wfpg

#include <wfpg/guides/octree/detail/field_store_impl.hpp>
