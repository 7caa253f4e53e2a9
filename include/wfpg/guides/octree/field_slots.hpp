// The slots of kept fields as kernels see them: which slot holds which field. A hash table finds a slot by
// its key, made of octree node and orientation. detail/slot_table.hpp owns the memory. wfpg's own.
//
// Cost: a look-up takes O(1) expected, since the table is at most half full. Memory: 25 bytes a slot, and 16
// to 32 of the table.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/guides/octree/build_schedule.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

#include <cstdint>

namespace wfpg {

/// No slot. Rays without a field carry this number.
inline constexpr std::uint32_t no_slot = no_field;
/// No key. A free slot has this one.
inline constexpr std::uint32_t no_key = 0xffffffffu;

/// State of one slot, beside the field in it: 24 bytes.
struct field_slot {
  /// `origin` of a slot that no ray of the wave asked to build.
  static constexpr std::uint64_t unpicked = ~0ull;

  std::uint32_t key = no_key;    ///< node * orientations + orientation; no_key: free
  std::uint32_t last_used = 0;   ///< last sample in which a ray used the field
  std::uint32_t last_built = 0;  ///< last sample in which cones were cast for it
  std::uint32_t builds = 0;      ///< since it was allocated or invalidated; 0: cast all cells next
  /// The ray that the next build starts from, in the lower 32 bits. The upper 32 bits are random, so that the
  /// minimum over rays picks one uniformly, in any order of threads.
  std::uint64_t origin = unpicked;

  /// Whether the field is due for its next build in `sample`, which has this build_schedule::light_age().
  WFPG_HD bool is_due(std::uint32_t sample, std::uint32_t light_age) const {
    return build_schedule::is_due(sample, light_age, builds, last_built);
  }
};

/// Slots, and the hash table that finds them by key. Trivially copyable.
struct field_slots_view {
  /// An empty entry of the table. Its lower half is no_slot, which find() returns.
  static constexpr std::uint64_t no_entry = ~0ull;

  /// All slots, live and free.
  array_view<field_slot> slots;
  /// Key in the upper 32 bits, slot in the lower 32. Linear probing from the key's hash, at most half full.
  std::uint64_t* table = nullptr;
  std::uint32_t table_mask = 0;  ///< entries of `table`, a power of two, minus 1
  /// One byte a slot: 1 once nothing is left to note of it in this sample. Most rays then read no more of
  /// their slot than this byte. The bytes of all slots fill few cache lines.
  std::uint8_t* noted = nullptr;

  /// Hash of a key, by multiplication (Fibonacci hashing): the upper half of a 64-bit product.
  WFPG_HD static std::uint32_t hash_key(std::uint32_t key) {
    return static_cast<std::uint32_t>(key * 0x9e3779b97f4a7c15ull >> 32);
  }

  /// Returns the slot that has `key`, or no_slot. O(1) expected. Concurrent calls are safe while nothing is
  /// inserted.
  WFPG_HD std::uint32_t find(std::uint32_t key) const {
    for (std::uint32_t i = hash_key(key);; ++i) {
      const std::uint64_t entry = table[i & table_mask];
      if (entry == no_entry || entry >> 32 == key) return static_cast<std::uint32_t>(entry);
    }
  }
  /// Adds a slot under its key. Concurrent calls are safe. Precondition: the key is not in the table, and at
  /// most half the entries are used.
  WFPG_HD void insert(std::uint32_t slot) const {
    const std::uint32_t key = slots[slot].key;
    const std::uint64_t entry = std::uint64_t(key) << 32 | slot;
    std::uint32_t i = hash_key(key);
    while (atomic_compare_exchange(table + (i & table_mask), no_entry, entry) != no_entry) ++i;
  }
};

/// Counts of one wave, in the policy's memory.
struct field_wave_counts {
  /// 1 where some ray found no slot for its key; the wave then allocates.
  std::uint32_t missing = 0;
  std::uint32_t unbinned = 0;       ///< active rays outside every voxel
  std::uint32_t without_field = 0;  ///< rays inside a voxel that got no field
  std::uint32_t with_field = 0;     ///< rays that got a field
  std::uint32_t all = 0;            ///< builds that cast all cells
  std::uint32_t part = 0;           ///< refreshes, which cast a part of the cells
  std::uint32_t builds = 0;         ///< `all` + `part`
};

/// Counters of a field_store, in the policy's memory. No host code has to read them in a sample.
struct field_store_state {
  /// Scales the rays per bin, in units of 1 / pressure_unit: larger makes bins larger.
  std::uint32_t pressure = build_schedule_constants::first_pressure;
  std::uint32_t free = 0;     ///< slots in the free list at the beginning of the sample
  std::uint32_t taken = 0;    ///< of those, allocated in the sample
  std::uint32_t refused = 0;  ///< fields of this sample that found no free slot
  std::uint32_t delayed = 0;  ///< fields of this sample that the limit on cones put off
  std::uint32_t waiting = 0;  ///< fields without a slot in one wave, the maximum over this sample
  /// Fields used in the later half of all samples; counted when bins are chosen anew.
  std::uint32_t used = 0;
  /// Slots allocated since the store was made.
  std::uint64_t allocated = 0, refreshed = 0;  ///< refreshes made since then
};

}  // namespace wfpg
