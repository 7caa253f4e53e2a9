// Owns the slots of kept fields: their keys, the table that finds them, and the list of free slots. It also
// frees unused slots, and lists the slots to build in a wave.
//
// Cost: O(slots) a sample. Memory: 24 bytes a slot and slot_table::words_a_slot words.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/guides/octree/detail/allocate_slots.hpp>

#include <thrust/functional.h>
#include <thrust/transform_scan.h>

#include <vector>

namespace wfpg::detail {

/// Slots and all that finds them, in the memory of `Exec`.
template <class Exec>
class slot_table {
 public:
  /// Words of a slot beside field_slot, at most: prefix sums 2, list of builds 2, free list 1, noted 1. The
  /// table has up to 4 entries of 2 words a slot, and wanted keys up to 4 with as many prefix sums.
  static constexpr std::size_t words_a_slot = 2 + 2 + 1 + 1 + 8 + 4 + 4;

  slot_table() = default;
  slot_table(const Exec& exec, std::size_t slots)
      : slots_(exec, std::vector<field_slot>(slots)),
        noted_(exec, slots),
        free_slots_(exec, slots),
        list_(exec, 2 * slots),
        prefix_(exec, slots),
        state_(exec, std::vector<field_store_state>(1)) {
    std::size_t entries = 2;
    while (entries < 2 * slots) entries *= 2;
    table_ = buffer<std::uint64_t, Exec>(exec, entries);
    wanted_ = buffer<std::uint32_t, Exec>(
        exec, min<std::size_t>(entries, build_schedule_constants::max_allocations));
    wanted_prefix_ = buffer<std::uint32_t, Exec>(exec, wanted_.size());
    clear_table(exec);
    exec.fill_bytes(noted_.data(), 0, noted_.bytes());
    // All bits of no_key are set.
    exec.fill_bytes(wanted_.data(), 0xff, wanted_.bytes());
  }

  std::size_t size() const { return slots_.size(); }
  field_slots_view view() const {
    return {slots_.view(), table_.data(), static_cast<std::uint32_t>(table_.size() - 1), noted_.data()};
  }
  /// The buckets of wanted keys, which ranks exchange.
  array_view<std::uint32_t> wanted_buckets() const { return wanted_.view(); }
  /// An element a slot, unused until a wave lists its builds.
  array_view<std::uint64_t> scratch() const { return prefix_.view(); }
  wanted_keys wanted() const { return {wanted_.data(), static_cast<std::uint32_t>(wanted_.size() - 1)}; }
  field_store_state* state() const { return state_.data(); }
  /// The slots to build in a wave: those to build whole, or those to refresh.
  const std::uint32_t* listed(bool whole) const { return list_.data() + (whole ? 0 : size()); }
  build_list builds(field_wave_counts* counts) const { return {list_.data(), counts}; }

  /// Begins a sample: frees slots that no ray used for `idle_samples` samples, then rebuilds the table and
  /// the list of free slots. O(slots).
  void begin_sample(const Exec& exec, resident_field* fields, field_wave_counts* counts, std::uint32_t sample,
                    std::uint32_t idle_samples) {
    const std::size_t n = max<std::size_t>(size(), 1);
    exec.for_each(n, begin_slots{view(), fields, state(), counts, sample, idle_samples});
    clear_table(exec);
    const array_view<std::uint32_t> free_prefix(list_.data(), size());
    ::thrust::transform_inclusive_scan(exec.thrust(), slots_.data(), slots_.data() + size(),
                                       free_prefix.data(), is_free{}, ::thrust::plus<std::uint32_t>());
    exec.for_each(n, index_slots{view(), free_prefix.data(), free_slots_.data(), state()});
  }

  /// Forgets the builds of a wave that ended early, such as by a caster's exception.
  void forget_wave(const Exec& exec, field_wave_counts* counts) {
    exec.for_each(max<std::size_t>(size(), 1), forget_wave_builds{slots_.view(), counts});
  }

  /// Allocates free slots to wanted keys, at most `most` of them.
  void allocate(const Exec& exec, const field_wave_counts* counts, std::uint64_t most) {
    exec.for_each_block(
        1, allocate_fields::scratch_bytes(),
        allocate_fields{view(), wanted(), wanted_prefix_.data(), free_slots_.data(), counts, state(), most});
  }

  /// Lists the slots to build under limits. `seed` decides which slots come first.
  void list_builds_within(const Exec& exec, const build_limits& limits, field_wave_counts* counts,
                          std::uint64_t seed) {
    if (size() == 0) return;
    ::thrust::transform_inclusive_scan(exec.thrust(), slots_.data(), slots_.data() + size(), prefix_.data(),
                                       is_to_build{}, ::thrust::plus<std::uint64_t>());
    exec.for_each(size(), list_builds{slots_.view(), prefix_.data(), limits, builds(counts), seed});
  }

  /// Adapts the pressure on the size of bins to the fields used since half of all samples.
  void adapt_pressure(const Exec& exec, std::uint32_t sample) {
    exec.fill_bytes(&state()->used, 0, sizeof(std::uint32_t));
    exec.for_each(size(), count_used{slots_.view(), sample / 2, state()});
    exec.for_each(1, update_pressure{state(), size(), sample});
  }

  std::vector<field_slot> to_host(const Exec& exec) const { return slots_.to_host(exec); }
  /// Takes saved slots and state. The table is rebuilt when the next sample begins.
  void restore(const Exec& exec, const std::vector<field_slot>& slots, const field_store_state& state) {
    exec.copy_from_host(slots_.data(), slots.data(), slots_.bytes());
    exec.copy_from_host(state_.data(), &state, sizeof state);
  }

  /// Bytes of the slots and of all that finds them.
  std::size_t bytes() const {
    return slots_.bytes() + table_.bytes() + noted_.bytes() + wanted_.bytes() + wanted_prefix_.bytes() +
           free_slots_.bytes() + list_.bytes() + prefix_.bytes();
  }
  std::size_t state_bytes() const { return state_.bytes(); }

 private:
  void clear_table(const Exec& exec) { exec.fill_bytes(table_.data(), 0xff, table_.bytes()); }  // no_entry

  buffer<field_slot, Exec> slots_;
  buffer<std::uint64_t, Exec> table_;
  buffer<std::uint8_t, Exec> noted_;
  buffer<std::uint32_t, Exec> wanted_, wanted_prefix_;
  buffer<std::uint32_t, Exec> free_slots_;
  buffer<std::uint32_t, Exec> list_;    // slots to build whole, then to refresh
  buffer<std::uint64_t, Exec> prefix_;  // a slot
  buffer<field_store_state, Exec> state_;
};

}  // namespace wfpg::detail
