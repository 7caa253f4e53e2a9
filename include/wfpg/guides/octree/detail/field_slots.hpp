// The slots of kept fields: which holds which field, how a wave's rays find theirs through a hash table of
// (node, orientation) keys, and what they ask for on the way. Who gets it is allot_slots.hpp's.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/detail/bin_marks.hpp>
#include <wfpg/guides/octree/guide_view.hpp>

namespace wfpg::detail {

inline constexpr std::uint32_t no_slot = no_field;
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
  // A slot: 1 once nothing is left to note of it in this sample. Most rays need to read no more of their slot
  // than this, and what all of them read is few cache lines.
  std::uint8_t* settled = nullptr;

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

/// What became of one wave.
struct field_wave_counts {
  std::uint32_t missing = 0;   ///< 1 where some ray found no slot at first
  std::uint32_t unbinned = 0;  ///< rays outside every voxel
  std::uint32_t unserved = 0;  ///< rays that got no field
  std::uint32_t served = 0;    ///< rays that got one
  std::uint32_t all = 0;       ///< builds that cast all cells
  std::uint32_t part = 0;      ///< builds that cast a part of them
  std::uint32_t builds = 0;    ///< both
};

/// What the host never has to read in a sample.
struct field_store_state {
  std::uint32_t pressure = 2 * mark_threshold::pressure_unit;
  std::uint32_t free = 0;            ///< slots in the list of free ones, made at the beginning of a sample
  std::uint32_t taken = 0;           ///< of that list
  std::uint32_t refused_births = 0;  ///< in this sample, for want of a free slot
  std::uint32_t delayed_births = 0;  ///< in this sample, for the limit on cones
  std::uint32_t waiting = 0;         ///< fields that one wave of this sample asked for in vain, at most
  std::uint32_t used = 0;            ///< fields of the bins that there are, where these are chosen anew
  // Since the beginning:
  std::uint64_t born = 0, refreshed = 0;
};

/// The slots to build in a wave: those to cast whole, from the number of slots on those to refresh.
struct build_list {
  std::uint32_t* list = nullptr;
  field_wave_counts* counts = nullptr;

  /// In any order: fields do not depend on each other.
  WFPG_HD void add(std::uint32_t slot, bool whole, std::size_t slots) const {
    const std::uint32_t rank = atomic_add(whole ? &counts->all : &counts->part, 1);
    list[(whole ? 0 : slots) + rank] = slot;
    atomic_add(&counts->builds, 1);
  }
};

/// How a wave's rays ask for builds.
enum class wanted_builds : std::uint32_t {
  none,    ///< not in this wave
  marked,  ///< list_builds() chooses among the slots
  listed,  ///< all are built
};

/// Notes that a ray of the wave has a slot.
struct use_slot {
  field_slots_view slots;
  std::uint32_t sample;
  std::uint64_t seed;
  wanted_builds wanted;
  build_list builds;

  WFPG_HD void operator()(std::uint32_t slot, std::size_t ray) const {
    if (atomic_load_cached(slots.settled + slot) != 0) return;
    field_slot& s = slots.slots[slot];
    const bool is_due = s.is_due(sample);
    if (atomic_load(&s.last_used) != sample) {
      atomic_store(&s.last_used, sample);
      if (!is_due) atomic_store(slots.settled + slot, std::uint8_t(1));
    }
    if (is_due && wanted != wanted_builds::none) want_build(s, slot, ray);
  }

 private:
  // The least random number picks the origin, whichever ray comes first.
  WFPG_HD void want_build(field_slot& s, std::uint32_t slot, std::size_t ray) const {
    const std::uint64_t candidate = (hash(seed, ray) & ~0xffffffffull) | ray;
    if (candidate >= atomic_load(&s.origin)) return;
    const bool is_first = atomic_min(&s.origin, candidate) == field_slot::unpicked;
    if (is_first && wanted == wanted_builds::listed) builds.add(slot, s.builds == 0, slots.slots.size());
  }
};

/// Rays whose own field is missing are marked with its key, where others have their slot.
struct missing_key {
  static constexpr std::uint32_t mark = 0x80000000u;
  static constexpr std::uint32_t most_nodes = mark / orientations;

  WFPG_HD static std::uint32_t marked(std::uint32_t key) { return key | mark; }
  WFPG_HD static bool is_marked(std::uint32_t field) { return field >= mark && field != no_slot; }
  WFPG_HD static std::uint32_t key(std::uint32_t field) { return field & ~mark; }
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

/// What became of a wave's rays: sums of `served`, `unserved` and 0, of up to 65,535 rays at once.
struct ray_counts {
  static constexpr std::uint32_t served = 1;
  static constexpr std::uint32_t unserved = 1u << 16;

  field_wave_counts* counts;
  depth_statistics* statistics;  // null: none are wanted

  WFPG_HD void add(std::uint32_t sum) const {
    const std::uint32_t with = sum & 0xffffu, without = sum >> 16;
    if (with > 0) atomic_add(&counts->served, with);
    if (without > 0) atomic_add(&counts->unserved, without);
    if (!statistics) return;
    if (with > 0) atomic_add(&statistics->rays, std::uint64_t(with));
    if (without > 0) atomic_add(&statistics->unbinned, std::uint64_t(without));
  }
  WFPG_HD void unbinned() const {
    atomic_add(&counts->unbinned, 1);
    if (statistics) atomic_add(&statistics->unbinned, std::uint64_t(1));
  }
};

/// The slot of a ray whose own field is missing: its nearest ancestor's with one, or none. What finds a field
/// tells what became of its ray.
struct use_ancestor {
  sparse_voxel_octree_view tree;
  use_slot use;

  WFPG_HD std::uint32_t operator()(std::uint32_t key, std::size_t ray, std::uint32_t& field) const {
    std::uint32_t slot = no_slot;
    for (node_id node = key / orientations; slot == no_slot && node != invalid_node; node = tree.parent(node))
      slot = use.slots.find(node * orientations + key % orientations);
    field = slot;
    if (slot == no_slot) return ray_counts::unserved;
    use(slot, ray);
    return ray_counts::served;
  }
};

/// Finds rays' slots, and counts the rays where `counted`. `Rays`: (std::size_t) -> ray_to_bin.
template <class Rays>
struct find_field {
  Rays rays;
  ray_counts counts;
  bin_marks_view marks;
  use_ancestor ancestor;
  wanted_keys wanted;
  counted_rays counted;

  WFPG_HD std::uint32_t operator()(std::size_t i, std::uint32_t& field) const {
    const use_slot& use = ancestor.use;
    const ray_to_bin ray = rays(i);
    const node_id leaf = ray.active ? leaf_of(ancestor.tree, ray) : invalid_node;
    if (leaf == invalid_node) {
      field = no_slot;
      if (ray.active) counts.unbinned();
      return 0;
    }
    if (counted.includes(i)) marks.count(leaf, counted.stride);
    const std::uint32_t key = marks.bin(leaf) * orientations + ray.orientation;
    const std::uint32_t slot = use.slots.find(key);
    if (slot != no_slot) {
      field = slot;
      use(slot, i);
      return ray_counts::served;
    }
    if (use.wanted == wanted_builds::none) return ancestor(key, i, field);
    field = missing_key::marked(key);
    wanted.ask(key);
    atomic_store(&counts.counts->missing, 1u);
    return 0;
  }
};

/// A wave's rays, so many a block.
struct ray_blocks {
  static constexpr std::size_t length = 2048;

  std::size_t rays;
  std::uint32_t* field_of_ray;
  ray_counts counts;

  std::size_t size() const { return max<std::size_t>((rays + length - 1) / length, 1); }

  /// find(ray, field) gives the rays of block i their fields.
  template <class Block, class Find>
  WFPG_HD void find(Block& block, std::size_t i, const Find& find) const {
    const std::size_t first = i * length;
    const auto n = static_cast<int>(min(length, rays - first));
    const std::uint32_t sum = block.sum(n, [&](int k) {
      const std::size_t ray = first + static_cast<std::size_t>(k);
      return find(ray, field_of_ray[ray]);
    });
    block.for_each(1, [&](int) { counts.add(sum); });
  }
};

/// Fields are written, to be built next.
template <class Rays>
struct find_fields {
  static constexpr bool waits_for_memory = true;

  find_field<Rays> find;
  ray_blocks blocks;
  field_wave_counts* next;  // of the wave after this one

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    if (i == 0) block.for_each(1, [&](int) { *next = {}; });
    blocks.find(block, i, find);
  }
};

/// The rays that find_fields left marked: their fields have been born, or an ancestor's serve, or none do.
struct find_missing_fields {
  ray_blocks blocks;
  use_ancestor own_or_ancestor;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    if (blocks.counts.counts->missing == 0) return;
    blocks.find(block, i, [&](std::size_t ray, std::uint32_t& field) {
      return missing_key::is_marked(field) ? own_or_ancestor(missing_key::key(field), ray, field) : 0u;
    });
  }
};

/// Fields are found and drawn from at once: serve(ray, field).
template <class Rays, class Serve>
struct find_and_serve {
  find_field<Rays> find;
  Serve serve;
  field_wave_counts* next;

  template <class Run>
  WFPG_HD void operator()(const Run& run) const {
    typename Run::template varying<std::uint32_t> fields;
    const std::uint32_t sum = run.sum([&](std::size_t ray, int i) { return find(ray, fields[i]); });
    run.once([&] {
      find.counts.add(sum);
      if (run.first() == 0) *next = {};
    });
    run.for_each([&](std::size_t ray, int i) { serve(ray, fields[i]); });
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

}  // namespace wfpg::detail
