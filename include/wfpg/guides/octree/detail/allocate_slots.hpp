// Kernels that divide what is scarce among kept fields. Slots go to keys that want them, and come back from
// fields that no ray uses. Cones go to fields that are due. The order is that of slots or of the keys'
// hashes, so no result depends on the timing of threads.
//
// Cost: O(slots) a sample; O(buckets) a wave that misses slots.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/guides/octree/detail/find_fields.hpp>
#include <wfpg/guides/octree/guide_view.hpp>

namespace wfpg::detail {

/// Kernel of one block: allocates free slots to wanted keys, in the order of their buckets. Each of `parts`
/// parts of the buckets is one warp's. Most waves miss no slot, and the kernel returns at once.
struct allocate_fields {
  static constexpr int parts = 16;

  // Table and slots that new fields are inserted into.
  field_slots_view slots;
  wanted_keys wanted;
  // A bucket: the number of wanted keys of its part, up to and including it.
  std::uint32_t* wanted_prefix;
  const std::uint32_t* free_slots;
  const field_wave_counts* counts;
  field_store_state* state;
  // Slots that this wave may allocate, by the limit on cones.
  std::uint64_t most;

  static constexpr std::size_t scratch_bytes() { return sizeof(std::uint32_t) * parts; }

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    if (counts->missing == 0) return;
    const int buckets = static_cast<int>(wanted.mask) + 1, size = max(buckets / parts, 1), n = buckets / size;
    block.for_each_warp(n, [&](const auto& warp, int part) {
      warp.inclusive_scan(size, wanted_prefix + part * size,
                          [&](int i) { return wanted.buckets[part * size + i] != no_key ? 1u : 0u; });
    });
    block.sync();
    std::uint32_t* const prefix = block.template scratch<std::uint32_t>(parts);
    block.for_each_warp(1, [&](const auto& warp, int) {
      warp.inclusive_scan(n, prefix, [&](int part) { return wanted_prefix[(part + 1) * size - 1]; });
    });
    block.sync();
    const std::uint32_t taken = state->taken, room = state->free - taken;
    const auto allowed = static_cast<std::uint32_t>(min<std::uint64_t>(room, most));
    block.for_each(buckets, [&](int i) {
      const std::uint32_t key = wanted.buckets[i];
      if (key == no_key) return;
      wanted.buckets[i] = no_key;
      const int part = i / size;
      const std::uint32_t rank = wanted_prefix[i] - 1 + (part > 0 ? prefix[part - 1] : 0);
      if (rank < allowed) allocate(key, free_slots[taken + rank]);
    });
    block.sync();
    block.for_each(1, [&](int) { count(prefix[n - 1], room, min(prefix[n - 1], allowed)); });
  }

 private:
  // Resets the slot, and makes it the field of `key`. All its cells are cast next.
  WFPG_HD void allocate(std::uint32_t key, std::uint32_t slot) const {
    slots.slots[slot] = {};
    slots.slots[slot].key = key;
    slots.insert(slot);
  }
  // `asked`: keys that want a slot. `room`: free slots. Refused keys lack a slot; delayed ones exceed the
  // limit on cones.
  WFPG_HD void count(std::uint32_t asked, std::uint32_t room, std::uint32_t allocated) const {
    const std::uint32_t refused = asked > room ? asked - room : 0;
    state->taken += allocated;
    state->allocated += allocated;
    state->refused += refused;
    state->waiting = max(state->waiting, asked - allocated);
    state->delayed += asked - refused - allocated;
  }
};

/// Limits of what one wave casts. Whole fields come first, since rays without one are not guided.
struct build_limits {
  static constexpr std::uint64_t none = ~0ull;

  // Of the wave: kept_field_options::max_wave_cones.
  std::uint64_t most_cones;
  std::uint32_t cells;  // cones of a whole field
  std::uint32_t part;   // cones of a refresh

  // Whole fields that are built, of those wanted.
  WFPG_HD std::uint32_t all(std::uint32_t wanted) const {
    return static_cast<std::uint32_t>(min<std::uint64_t>(wanted, most_cones / cells));
  }
  // Refreshes that are made, of those wanted, with the cones that `all` whole fields leave.
  WFPG_HD std::uint32_t parts(std::uint32_t wanted, std::uint32_t all) const {
    return static_cast<std::uint32_t>(
        min<std::uint64_t>(wanted, (most_cones - std::uint64_t(all) * cells) / part));
  }
};

/// Counts of a slot for a scan: 1 in the upper 32 bits to build it whole, 1 in the lower 32 to refresh it.
struct is_to_build {
  WFPG_HD std::uint64_t operator()(const field_slot& s) const {
    if (s.origin == field_slot::unpicked) return 0;
    return s.builds == 0 ? 1ull << 32 : 1ull;
  }
};

/// Kernel: lists the slots to build under a limit. Slots that do not fit wait. The list starts at a slot that
/// the seed picks, so that the same slots do not wait in each wave.
struct list_builds {
  array_view<field_slot> slots;
  // A slot: the numbers of slots to build up to and including it, whole ones above.
  const std::uint64_t* prefix;
  build_limits limits;
  build_list builds;
  std::uint64_t seed;

  WFPG_HD void operator()(std::size_t i) const {
    field_slot& s = slots[i];
    if (i > 0 && s.origin == field_slot::unpicked) return;
    const std::uint64_t total = prefix[slots.size() - 1];
    const auto wholes = static_cast<std::uint32_t>(total >> 32), parts = static_cast<std::uint32_t>(total);
    const std::uint32_t most_wholes = limits.all(wholes), most_parts = limits.parts(parts, most_wholes);
    if (i == 0) {
      builds.counts->all = most_wholes;
      builds.counts->part = most_parts;
      builds.counts->builds = most_wholes + most_parts;
    }
    if (s.origin == field_slot::unpicked) return;
    const bool whole = s.builds == 0;
    // Rank in a list that starts `seed % total` entries later, cyclically.
    const std::uint32_t rank = whole ? rotated(static_cast<std::uint32_t>(prefix[i] >> 32) - 1, wholes)
                                     : rotated(static_cast<std::uint32_t>(prefix[i]) - 1, parts);
    if (rank < (whole ? most_wholes : most_parts))
      builds.list[whole ? rank : slots.size() + rank] = static_cast<std::uint32_t>(i);
    else
      s.origin = field_slot::unpicked;  // waits
  }

 private:
  WFPG_HD std::uint32_t rotated(std::uint32_t rank, std::uint32_t total) const {
    const auto first = static_cast<std::uint32_t>(seed % total);
    return rank >= first ? rank - first : rank + (total - first);
  }
};

/// Kernel: begins a sample. Frees slots that no ray used for `idle_samples` samples; where allocations were
/// refused in the last sample, for one. Clears `noted` of every slot.
struct begin_slots {
  field_slots_view slots;
  resident_field* fields;
  const field_store_state* state;
  field_wave_counts* counts;
  std::uint32_t sample;
  std::uint32_t idle_samples;

  WFPG_HD void operator()(std::size_t i) const {
    if (i == 0) *counts = {};
    if (i >= slots.slots.size()) return;
    field_slot& s = slots.slots[i];
    slots.noted[i] = 0;
    const std::uint32_t most = state->refused > 0 ? 1 : idle_samples;
    if (s.key == no_key || sample - s.last_used <= most) return;
    s = {};
    fields[i] = {};
  }
};

/// Counts free slots for a scan: 1 for a free one.
struct is_free {
  WFPG_HD std::uint32_t operator()(const field_slot& s) const { return s.key == no_key ? 1u : 0u; }
};

/// Kernel: inserts live slots into the table, and lists free ones. Resets the sample's counts.
struct index_slots {
  field_slots_view slots;
  const std::uint32_t* free_prefix;
  std::uint32_t* free_slots;
  field_store_state* state;
  WFPG_HD void operator()(std::size_t i) const {
    const std::size_t n = slots.slots.size();
    if (i == 0) {
      state->free = n > 0 ? free_prefix[n - 1] : 0;
      state->refused = state->delayed = state->waiting = 0;
      state->taken = 0;
    }
    if (i >= n) return;
    if (slots.slots[i].key == no_key)
      free_slots[free_prefix[i] - 1] = static_cast<std::uint32_t>(i);
    else
      slots.insert(static_cast<std::uint32_t>(i));
  }
};

/// Kernel: forgets the builds that a wave asked for, where it ended before they were made.
struct forget_wave_builds {
  array_view<field_slot> slots;
  field_wave_counts* counts;
  WFPG_HD void operator()(std::size_t i) const {
    if (i == 0) *counts = {};
    if (i < slots.size()) slots[i].origin = field_slot::unpicked;
  }
};

/// Kernel: counts the fields that rays used after sample `after`. The `last_used` of a free slot is 0.
struct count_used {
  array_view<const field_slot> slots;
  std::uint32_t after;
  field_store_state* state;
  WFPG_HD void operator()(std::size_t i) const {
    if (slots[i].last_used > after) atomic_add(&state->used, 1);
  }
};

/// Kernel of one thread: adapts the pressure on the size of bins.
struct update_pressure {
  field_store_state* state;
  std::uint64_t slots;
  std::uint32_t sample;

  WFPG_HD void operator()(std::size_t) const {
    state->pressure = build_schedule::next_pressure(
        state->pressure, std::uint64_t(state->used) + state->waiting, slots, sample, state->refused > 0);
  }
};

}  // namespace wfpg::detail
