// What of kept fields is scarce: slots, given to keys that want them and taken back from fields that nobody
// uses, and cones, given to fields that want to be built. Both in the order of the slots or of the keys'
// hashes, so that no result depends on the timing of threads.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/guides/octree/detail/field_slots.hpp>
#include <wfpg/guides/octree/guide_view.hpp>

namespace wfpg::detail {

/// Gives the free slots to wanted keys, in the order of their buckets; one block, in which each of `parts`
/// parts of the buckets is a warp's. There is nothing to do in most waves.
struct bear_fields {
  static constexpr int parts = 16;

  field_slots_view slots;
  wanted_keys wanted;
  std::uint32_t* wanted_through;  // a bucket: wanted keys of its part up to and with it
  const std::uint32_t* free_slots;
  const field_wave_counts* counts;
  field_store_state* state;
  std::uint64_t most;

  static constexpr std::size_t scratch_bytes() { return sizeof(std::uint32_t) * parts; }

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t) const {
    if (counts->missing == 0) return;
    const int buckets = static_cast<int>(wanted.mask) + 1, size = max(buckets / parts, 1), n = buckets / size;
    block.for_each_warp(n, [&](const auto& warp, int part) {
      warp.inclusive_scan(size, wanted_through + part * size,
                          [&](int i) { return wanted.buckets[part * size + i] != no_key ? 1u : 0u; });
    });
    block.sync();
    std::uint32_t* const through = block.template scratch<std::uint32_t>(parts);
    block.for_each_warp(1, [&](const auto& warp, int) {
      warp.inclusive_scan(n, through, [&](int part) { return wanted_through[(part + 1) * size - 1]; });
    });
    block.sync();
    const std::uint32_t taken = state->taken, room = state->free - taken;
    const auto allowed = static_cast<std::uint32_t>(min<std::uint64_t>(room, most));
    block.for_each(buckets, [&](int i) {
      const std::uint32_t key = wanted.buckets[i];
      if (key == no_key) return;
      wanted.buckets[i] = no_key;
      const int part = i / size;
      const std::uint32_t rank = wanted_through[i] - 1 + (part > 0 ? through[part - 1] : 0);
      if (rank < allowed) bear(key, free_slots[taken + rank]);
    });
    block.sync();
    block.for_each(1, [&](int) { count(through[n - 1], room, min(through[n - 1], allowed)); });
  }

 private:
  WFPG_HD void bear(std::uint32_t key, std::uint32_t slot) const {
    slots.slots[slot] = {};
    slots.slots[slot].key = key;
    slots.insert(slot);
  }
  WFPG_HD void count(std::uint32_t asked, std::uint32_t room, std::uint32_t born) const {
    const std::uint32_t refused = asked > room ? asked - room : 0;
    state->taken += born;
    state->born += born;
    state->refused_births += refused;
    state->waiting = max(state->waiting, asked - born);
    state->delayed_births += asked - refused - born;
  }
};

/// What one wave may cast.
struct build_limits {
  static constexpr std::uint64_t none = ~0ull;

  std::uint64_t most_cones;
  std::uint32_t cells;  // of a whole field
  std::uint32_t part;   // cones of a refresh

  WFPG_HD std::uint32_t all(std::uint32_t wanted) const {
    return static_cast<std::uint32_t>(min<std::uint64_t>(wanted, most_cones / cells));
  }
  WFPG_HD std::uint32_t parts(std::uint32_t wanted, std::uint32_t all) const {
    return static_cast<std::uint32_t>(
        min<std::uint64_t>(wanted, (most_cones - std::uint64_t(all) * cells) / part));
  }
};

/// 1 above for a slot to build from scratch, 1 below for one to refresh.
struct is_to_build {
  WFPG_HD std::uint64_t operator()(const field_slot& s) const {
    if (s.origin == field_slot::unpicked) return 0;
    return s.builds == 0 ? 1ull << 32 : 1ull;
  }
};

/// The slots to build under a limit. Where it passes over some, others are the first in the next wave.
struct list_builds {
  array_view<field_slot> slots;
  const std::uint64_t* through;  // a slot: slots to build up to and with it
  build_limits limits;
  build_list builds;
  std::uint64_t seed;

  WFPG_HD void operator()(std::size_t i) const {
    field_slot& s = slots[i];
    if (i > 0 && s.origin == field_slot::unpicked) return;
    const std::uint64_t total = through[slots.size() - 1];
    const auto wholes = static_cast<std::uint32_t>(total >> 32), parts = static_cast<std::uint32_t>(total);
    const std::uint32_t most_wholes = limits.all(wholes), most_parts = limits.parts(parts, most_wholes);
    if (i == 0) {
      builds.counts->all = most_wholes;
      builds.counts->part = most_parts;
      builds.counts->builds = most_wholes + most_parts;
    }
    if (s.origin == field_slot::unpicked) return;
    const bool whole = s.builds == 0;
    const std::uint32_t rank = whole ? rotated(static_cast<std::uint32_t>(through[i] >> 32) - 1, wholes)
                                     : rotated(static_cast<std::uint32_t>(through[i]) - 1, parts);
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

/// A sample begins: frees slots that no ray has used for some samples; where births were refused, for one. No
/// slot is settled.
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
    slots.settled[i] = 0;
    const std::uint32_t most = state->refused_births > 0 ? 1 : idle_samples;
    if (s.key == no_key || sample - s.last_used <= most) return;
    s = {};
    fields[i] = {};
  }
};

struct is_free {
  WFPG_HD std::uint32_t operator()(const field_slot& s) const { return s.key == no_key ? 1u : 0u; }
};

/// Live slots into the table, free ones into their list; the sample's counts begin.
struct index_slots {
  field_slots_view slots;
  const std::uint32_t* free_through;
  std::uint32_t* free_slots;
  field_store_state* state;
  WFPG_HD void operator()(std::size_t i) const {
    const std::size_t n = slots.slots.size();
    if (i == 0) {
      state->free = n > 0 ? free_through[n - 1] : 0;
      state->refused_births = state->delayed_births = state->waiting = 0;
      state->taken = 0;
    }
    if (i >= n) return;
    if (slots.slots[i].key == no_key)
      free_slots[free_through[i] - 1] = static_cast<std::uint32_t>(i);
    else
      slots.insert(static_cast<std::uint32_t>(i));
  }
};

}  // namespace wfpg::detail
