// The administration of kept fields: which slot holds which field, who uses it, what is to be built. Slots
// are found through a hash table of (node, orientation) keys; births, builds and evictions are listed by
// scans in the order of the slots or of the keys' hashes, so that no result depends on the timing of threads.
#pragma once

#include <wfpg/detail/atomic.hpp>
#include <wfpg/detail/bin_marks.hpp>
#include <wfpg/detail/math.hpp>
#include <wfpg/guide_view.hpp>
#include <wfpg/spatial_binner.hpp>
#include <wfpg/types.hpp>

namespace wfpg::detail {

inline constexpr std::uint32_t no_slot = guide_view::no_field;
inline constexpr std::uint32_t no_key = 0xffffffffu;

/// What is known of a slot, beside its field.
struct field_slot {
  static constexpr std::uint64_t unpicked = ~0ull;

  std::uint32_t key = no_key;       ///< node · orientations + orientation; no_key: free
  std::uint32_t last_used = 0;      ///< sample in which a ray had its field
  std::uint32_t last_built = 0;     ///< sample
  std::uint32_t builds = 0;         ///< 0: all of its cells are to be cast
  std::uint64_t origin = unpicked;  ///< the ray that its next build starts from, below a random number

  /// Fields settle as samples accumulate: an eighth of them may pass between two builds, and a quarter once
  /// there are many.
  WFPG_HD bool is_due(std::uint32_t sample) const {
    const std::uint64_t passed = sample - last_built;
    return builds == 0 || (passed >= 1 && (sample <= 32 ? 8 : 4) * passed >= sample);
  }
};

/// Slots and the table that finds them.
struct field_slots_view {
  static constexpr std::uint64_t no_entry = ~0ull;

  array_view<field_slot> slots;
  // Keys above their slots, by the keys' hashes, linear probing, at most half full.
  std::uint64_t* table = nullptr;
  std::uint32_t table_mask = 0;
  // A slot: 1 where the waves before have left nothing to note of it in this sample. Most rays need to read
  // no more of their slot than this, and what all of them read is few cache lines.
  const std::uint8_t* settled = nullptr;

  WFPG_HD static std::uint32_t hash_key(std::uint32_t key) {
    return static_cast<std::uint32_t>(key * 0x9e3779b97f4a7c15ull >> 32);
  }

  WFPG_HD std::uint32_t find(std::uint32_t key) const {
    for (std::uint32_t i = hash_key(key);; ++i) {
      const std::uint64_t entry = table[i & table_mask];
      if (entry == no_entry || entry >> 32 == key) return static_cast<std::uint32_t>(entry);
    }
  }
  WFPG_HD void insert(std::uint32_t slot) const {
    const std::uint32_t key = slots[slot].key;
    const std::uint64_t entry = std::uint64_t(key) << 32 | slot;
    std::uint32_t i = hash_key(key);
    while (atomic_compare_exchange(table + (i & table_mask), no_entry, entry) != no_entry) ++i;
  }
};

/// What the host never has to read in a sample.
struct field_store_state {
  std::uint32_t pressure = 2;        ///< see mark_threshold; doubled when births were refused
  std::uint32_t free = 0;            ///< slots in the list of free ones, made at the beginning of a sample
  std::uint32_t taken = 0;           ///< of that list
  std::uint32_t refused_births = 0;  ///< in this sample, for want of a free slot
  std::uint32_t refused_births_before = 0;  ///< in the sample before
  std::uint32_t delayed_births = 0;         ///< in this sample, for the limit on cones
  std::uint32_t refused_since_mark = 0;
  // Of the last wave:
  std::uint32_t missing = 0;   ///< the wave's size where some ray found no slot at first, else 0
  std::uint32_t unbinned = 0;  ///< rays outside every voxel
  std::uint32_t unserved = 0;  ///< rays that got no field
  std::uint32_t served = 0;    ///< rays whose field was there
  std::uint32_t all = 0;       ///< builds that cast all cells
  std::uint32_t part = 0;      ///< builds that cast a part of them
  std::uint32_t builds = 0;    ///< both
  // Since the beginning:
  std::uint64_t born = 0, refreshed = 0;
};

/// A ray of the wave gets a slot.
struct use_slot {
  field_slots_view slots;
  std::uint32_t* field_of_ray;
  std::uint32_t sample;
  std::uint64_t seed;

  WFPG_HD void operator()(std::uint32_t slot, std::size_t ray) const {
    field_of_ray[ray] = slot;
    if (slots.settled[slot] != 0) return;
    field_slot& s = slots.slots[slot];
    if (atomic_load(&s.last_used) != sample) atomic_store(&s.last_used, sample);
    if (!s.is_due(sample)) return;
    // The least random number picks the origin, whichever ray comes first.
    const std::uint64_t candidate = (hash(seed, ray) & ~0xffffffffull) | ray;
    if (candidate < atomic_load(&s.origin)) atomic_min(&s.origin, candidate);
  }
};

/// Keys that want a slot, one a bucket: the least key has it, the others ask again in the next wave.
struct wanted_keys {
  std::uint32_t* buckets = nullptr;
  std::uint32_t mask = 0;

  WFPG_HD void ask(std::uint32_t key) const {
    std::uint32_t* const bucket = buckets + (field_slots_view::hash_key(key) >> 7 & mask);
    if (atomic_load(bucket) > key) atomic_min(bucket, key);
  }
};

/// Finds rays' slots, and counts the rays where `counted`. `Rays`: (std::size_t) -> ray_to_bin.
template <class Rays>
struct find_fields {
  Rays rays;
  sparse_voxel_octree_view tree;
  bin_marks_view marks;
  use_slot use;
  wanted_keys wanted;
  std::uint32_t* missing_keys;
  field_store_state* state;
  std::uint32_t wave_size;
  counted_rays counted;

  WFPG_HD void operator()(std::size_t i) const {
    use.field_of_ray[i] = no_slot;
    missing_keys[i] = no_key;
    const ray_to_bin ray = rays(i);
    if (!ray.active) return;
    const node_id leaf = leaf_of(tree, ray);
    if (leaf == invalid_node) {
      atomic_add(&state->unbinned, 1);
      return;
    }
    if (counted.includes(i)) marks.count(leaf, counted.stride);
    const std::uint32_t key = marks.bin(leaf) * orientations + ray.orientation;
    const std::uint32_t slot = use.slots.find(key);
    if (slot != no_slot) {
      use(slot, i);
      return;
    }
    missing_keys[i] = key;
    wanted.ask(key);
    atomic_store(&state->missing, wave_size);
  }
};

/// Counts rays, where nothing is guided yet.
template <class Rays>
struct count_rays {
  Rays rays;
  sparse_voxel_octree_view tree;
  bin_marks_view marks;
  counted_rays counted;
  WFPG_HD void operator()(std::size_t i) const {
    if (!counted.includes(i)) return;
    const ray_to_bin ray = rays(i);
    if (!ray.active) return;
    const node_id leaf = leaf_of(tree, ray);
    if (leaf != invalid_node) marks.count(leaf, counted.stride);
  }
};

struct is_wanted {
  WFPG_HD std::uint32_t operator()(std::uint32_t key) const { return key != no_key ? 1u : 0u; }
};

/// Wanted keys that get one of the free slots, in the order of their buckets.
struct bear_fields {
  field_slots_view slots;
  wanted_keys wanted;
  const std::uint32_t* wanted_through;  // a bucket: wanted keys up to and with it
  const std::uint32_t* free_slots;
  const field_store_state* state;
  std::uint64_t most;

  WFPG_HD std::uint32_t allowed() const {
    return static_cast<std::uint32_t>(min<std::uint64_t>(state->free - state->taken, most));
  }
  WFPG_HD void operator()(std::size_t i) const {
    const std::uint32_t key = wanted.buckets[i];
    if (key == no_key) return;
    wanted.buckets[i] = no_key;
    const std::uint32_t rank = wanted_through[i] - 1;
    if (rank >= allowed()) return;
    const std::uint32_t slot = free_slots[state->taken + rank];
    slots.slots[slot] = {};
    slots.slots[slot].key = key;
    slots.insert(slot);
  }
};

struct count_births {
  bear_fields births;
  field_store_state* state;
  WFPG_HD void operator()() const {
    const std::uint32_t wanted = births.wanted_through[births.wanted.mask];
    const std::uint32_t room = state->free - state->taken;
    const std::uint32_t refused = wanted > room ? wanted - room : 0;
    const std::uint32_t born = min(wanted, births.allowed());
    state->taken += born;
    state->born += born;
    state->refused_births += refused;
    state->delayed_births += wanted - refused - born;
    state->refused_since_mark += refused;
  }
};

/// Rays whose own field was missing: it has been born, or an ancestor's serves, or none does. Counts the
/// births: there were none where no field was missing.
struct find_missing_fields {
  sparse_voxel_octree_view tree;
  use_slot use;
  const std::uint32_t* missing_keys;
  field_store_state* state;
  count_births births;

  WFPG_HD void operator()(std::size_t i) const {
    if (i == 0) births();
    if (missing_keys[i] == no_key) return;
    const std::uint32_t orientation = missing_keys[i] % orientations;
    std::uint32_t slot = no_slot;
    for (node_id node = missing_keys[i] / orientations; slot == no_slot && node != invalid_node;
         node = tree.parent(node))
      slot = use.slots.find(node * orientations + orientation);
    if (slot == no_slot)
      atomic_add(&state->unserved, 1);
    else
      use(slot, i);
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

/// The slots to build in this wave, where nothing limits them: those to cast whole, from the number of slots
/// on those to refresh. In any order: fields do not depend on each other.
struct list_all_builds {
  array_view<field_slot> slots;
  std::uint32_t* list;
  field_store_state* state;

  WFPG_HD void operator()(std::size_t i) const {
    if (slots[i].origin == field_slot::unpicked) return;
    const bool whole = slots[i].builds == 0;
    const std::uint32_t rank = atomic_add(whole ? &state->all : &state->part, 1);
    list[(whole ? 0 : slots.size()) + rank] = static_cast<std::uint32_t>(i);
    atomic_add(&state->builds, 1);
    if (!whole) atomic_add(&state->refreshed, 1);
  }
};

/// The same under a limit. Where it passes over some, others are the first in the next wave.
struct list_builds {
  array_view<field_slot> slots;
  const std::uint64_t* through;  // a slot: slots to build up to and with it
  build_limits limits;
  std::uint32_t* list;
  field_store_state* state;
  std::uint64_t seed;

  WFPG_HD void operator()(std::size_t i) const {
    field_slot& s = slots[i];
    if (i > 0 && s.origin == field_slot::unpicked) return;
    const std::uint64_t total = through[slots.size() - 1];
    const auto wholes = static_cast<std::uint32_t>(total >> 32), parts = static_cast<std::uint32_t>(total);
    const std::uint32_t most_wholes = limits.all(wholes), most_parts = limits.parts(parts, most_wholes);
    if (i == 0) {
      state->all = most_wholes;
      state->part = most_parts;
      state->builds = most_wholes + most_parts;
      state->refreshed += most_parts;
    }
    if (s.origin == field_slot::unpicked) return;
    const bool whole = s.builds == 0;
    const std::uint32_t rank = whole ? rotated(static_cast<std::uint32_t>(through[i] >> 32) - 1, wholes)
                                     : rotated(static_cast<std::uint32_t>(through[i]) - 1, parts);
    if (rank < (whole ? most_wholes : most_parts))
      list[whole ? rank : slots.size() + rank] = static_cast<std::uint32_t>(i);
    else
      s.origin = field_slot::unpicked;  // waits
  }

 private:
  WFPG_HD std::uint32_t rotated(std::uint32_t rank, std::uint32_t total) const {
    const auto first = static_cast<std::uint32_t>(seed % total);
    return rank >= first ? rank - first : rank + (total - first);
  }
};

/// Frees slots that no ray has used for some samples; where births were refused, for one.
struct evict_fields {
  array_view<field_slot> slots;
  resident_field* fields;
  const field_store_state* state;
  std::uint32_t sample;
  std::uint32_t idle_samples;

  WFPG_HD void operator()(std::size_t i) const {
    field_slot& s = slots[i];
    const std::uint32_t most = state->refused_births_before > 0 ? 1 : idle_samples;
    if (s.key == no_key || sample - s.last_used <= most) return;
    s = {};
    fields[i] = {};
  }
};

struct is_free {
  WFPG_HD std::uint32_t operator()(const field_slot& s) const { return s.key == no_key ? 1u : 0u; }
};

/// Live slots into the table, free ones into their list.
struct index_slots {
  field_slots_view slots;
  const std::uint32_t* free_through;
  std::uint32_t* free_slots;
  field_store_state* state;
  WFPG_HD void operator()(std::size_t i) const {
    if (i + 1 == slots.slots.size()) state->free = free_through[i];
    if (slots.slots[i].key == no_key)
      free_slots[free_through[i] - 1] = static_cast<std::uint32_t>(i);
    else
      slots.insert(static_cast<std::uint32_t>(i));
  }
};

}  // namespace wfpg::detail
