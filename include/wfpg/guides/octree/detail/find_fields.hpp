// Finds the slots of a wave's rays, and collects what rays ask for: builds of fields that are due, and slots
// for keys without one. allocate_slots.hpp decides who gets a slot.
//
// Cost: O(1) expected a ray, and O(depth) for a ray whose key has no slot.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/detail/bin_marks.hpp>
#include <wfpg/guides/octree/field_slots.hpp>

namespace wfpg::detail {

/// Lists of the slots to build in a wave. Those to cast whole come first; those to refresh begin at entry
/// `slots`.
struct build_list {
  std::uint32_t* list = nullptr;
  field_wave_counts* counts = nullptr;

  /// Appends a slot. The order depends on threads, which is harmless: fields do not depend on each other.
  WFPG_HD void add(std::uint32_t slot, bool whole, std::size_t slots) const {
    const std::uint32_t rank = atomic_add(whole ? &counts->all : &counts->part, 1);
    list[(whole ? 0 : slots) + rank] = slot;
    atomic_add(&counts->builds, 1);
  }
};

/// How a wave's rays ask for builds.
enum class wanted_builds : std::uint32_t {
  none,    ///< this wave builds nothing
  marked,  ///< rays mark slots, and list_builds() chooses among them
  listed,  ///< rays list slots, and all of them are built
};

/// Notes that a ray uses a slot, and asks for its build where that is due.
struct use_slot {
  field_slots_view slots;
  std::uint32_t sample;
  std::uint32_t light_age;  // build_schedule::light_age()
  std::uint64_t seed;
  wanted_builds wanted;
  build_list builds;

  // `number`: () -> wave_rays::number() of the ray, which is asked for where a build is due.
  template <class Number>
  WFPG_HD void operator()(std::uint32_t slot, const Number& number) const {
    if (atomic_load_cached(slots.noted + slot) != 0) return;
    field_slot& s = slots.slots[slot];
    const bool is_due = s.is_due(sample, light_age);
    if (atomic_load(&s.last_used) != sample) {
      atomic_store(&s.last_used, sample);
      if (!is_due) atomic_store(slots.noted + slot, std::uint8_t(1));
    }
    if (is_due && wanted != wanted_builds::none) want_build(s, slot, number());
  }

 private:
  // The least random number picks the origin, so the choice does not depend on which ray comes first.
  WFPG_HD void want_build(field_slot& s, std::uint32_t slot, std::uint32_t ray) const {
    const std::uint64_t candidate = (hash(seed, ray) & ~0xffffffffull) | ray;
    if (candidate >= atomic_load(&s.origin)) return;
    const bool is_first = atomic_min(&s.origin, candidate) == field_slot::unpicked;
    if (is_first && wanted == wanted_builds::listed) builds.add(slot, s.builds == 0, slots.slots.size());
  }
};

/// Encoding of a ray whose key has no slot: the key with its top bit set, where other rays have their slot.
struct missing_key {
  static constexpr std::uint32_t mark = 0x80000000u;
  static constexpr std::uint32_t most_nodes = mark / orientations;

  WFPG_HD static std::uint32_t marked(std::uint32_t key) { return key | mark; }
  WFPG_HD static bool is_marked(std::uint32_t field) { return field >= mark && field != no_slot; }
  WFPG_HD static std::uint32_t key(std::uint32_t field) { return field & ~mark; }
};

/// Hash buckets of keys that want a slot, one key a bucket. The least key wins a bucket; the others ask again
/// in the next wave.
struct wanted_keys {
  std::uint32_t* buckets = nullptr;
  std::uint32_t mask = 0;

  WFPG_HD void ask(std::uint32_t key) const {
    std::uint32_t* const bucket = buckets + (field_slots_view::hash_key(key) >> 7 & mask);
    if (atomic_load(bucket) > key) atomic_min(bucket, key);
  }
};

/// Counts what became of a wave's rays. A ray adds `with_field`, `without_field` or 0 to a sum, of up to
/// 65,535 rays at once.
struct ray_counts {
  static constexpr std::uint32_t with_field = 1;
  static constexpr std::uint32_t without_field = 1u << 16;

  field_wave_counts* counts;
  // Null: no statistics are wanted.
  depth_statistics* statistics;

  WFPG_HD void add(std::uint32_t sum) const {
    const std::uint32_t with = sum & 0xffffu, without = sum >> 16;
    if (with > 0) atomic_add(&counts->with_field, with);
    if (without > 0) atomic_add(&counts->without_field, without);
    if (!statistics) return;
    if (with > 0) atomic_add(&statistics->rays, std::uint64_t(with));
    if (without > 0) atomic_add(&statistics->unbinned, std::uint64_t(without));
  }
  WFPG_HD void unbinned() const {
    atomic_add(&counts->unbinned, 1);
    if (statistics) atomic_add(&statistics->unbinned, std::uint64_t(1));
  }
};

/// Finds the slot of a ray whose own key has none: its nearest ancestor's with one, or no slot. Returns what
/// ray_counts adds for the ray.
struct use_ancestor {
  sparse_voxel_octree_view tree;
  use_slot use;

  template <class Number>
  WFPG_HD std::uint32_t operator()(std::uint32_t key, const Number& number, std::uint32_t& field) const {
    std::uint32_t slot = no_slot;
    for (node_id node = key / orientations; slot == no_slot && node != invalid_node; node = tree.parent(node))
      slot = use.slots.find(node * orientations + key % orientations);
    field = slot;
    if (slot == no_slot) return ray_counts::without_field;
    use(slot, number);
    return ray_counts::with_field;
  }
};

/// Finds a ray's slot, and counts the ray where `counted` includes it. `Rays`: wave_rays.
/// Returns what ray_counts adds for the ray.
template <class Rays>
struct find_field {
  Rays rays;
  ray_counts counts;
  bin_marks_view marks;
  use_ancestor ancestor;
  wanted_keys wanted;
  counted_rays counted;

  WFPG_HD WFPG_FLATTEN std::uint32_t operator()(std::size_t i, std::uint32_t& field) const {
    const use_slot& use = ancestor.use;
    const ray_to_bin ray = rays(i);
    const node_id leaf = ray.active ? leaf_of(ancestor.tree, ray) : invalid_node;
    if (leaf == invalid_node) {
      field = no_slot;
      if (ray.active) counts.unbinned();
      return 0;
    }
    const auto number = [&] { return rays.number(i); };
    // Most samples count no rays. Numbers of rays are then not needed.
    if (counted.stride > 0 && counted.includes(number())) marks.count(leaf, counted.stride * ray.paths);
    const std::uint32_t key = marks.bin(leaf) * orientations + ray.orientation;
    const std::uint32_t slot = use.slots.find(key);
    if (slot != no_slot) {
      field = slot;
      use(slot, number);
      return ray_counts::with_field;
    }
    if (use.wanted == wanted_builds::none) return ancestor(key, number, field);
    field = missing_key::marked(key);
    wanted.ask(key);
    atomic_store(&counts.counts->missing, 1u);
    return 0;
  }
};

/// A wave's rays, `length` of them a block.
struct ray_blocks {
  static constexpr std::size_t length = 2048;

  std::size_t rays;
  std::uint32_t* field_of_ray;
  ray_counts counts;

  std::size_t size() const { return max<std::size_t>((rays + length - 1) / length, 1); }

  /// Gives the rays of block i their fields: find(ray, field) writes a field and returns what ray_counts
  /// adds.
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

/// Kernel: writes each ray's slot, for a wave whose fields are built next.
template <class Rays>
struct find_fields {
  static constexpr bool waits_for_memory = true;

  find_field<Rays> find;
  ray_blocks blocks;
  // Counts of the wave after this one, which it clears.
  field_wave_counts* next;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    if (i == 0) block.for_each(1, [&](int) { *next = {}; });
    blocks.find(block, i, find);
  }
};

/// Kernel: finds slots for the rays that find_fields left marked. Their fields have been allocated since, or
/// they use an ancestor's, or none.
template <class Rays>
struct find_missing_fields {
  ray_blocks blocks;
  use_ancestor own_or_ancestor;
  Rays rays;

  template <class Block>
  WFPG_HD void operator()(Block& block, std::size_t i) const {
    if (blocks.counts.counts->missing == 0) return;
    blocks.find(block, i, [&](std::size_t ray, std::uint32_t& field) {
      if (!missing_key::is_marked(field)) return 0u;
      return own_or_ancestor(
          missing_key::key(field), [&] { return rays.number(ray); }, field);
    });
  }
};

/// Kernel: finds each ray's field and samples it at once: sampler(ray, field).
template <class Rays, class Sampler>
struct find_and_sample {
  find_field<Rays> find;
  Sampler sampler;
  // Counts of the next wave, cleared here.
  field_wave_counts* next;

  template <class Run>
  WFPG_HD void operator()(const Run& run) const {
    typename Run::template varying<std::uint32_t> fields;
    const std::uint32_t sum = run.sum([&](std::size_t ray, int i) { return find(ray, fields[i]); });
    run.once([&] {
      find.counts.add(sum);
      if (run.first() == 0) *next = {};
    });
    run.for_each([&](std::size_t ray, int i) { sampler(ray, fields[i]); });
  }
};

/// Kernel: counts rays for bins, in samples that guide nothing yet.
template <class Rays>
struct count_rays {
  Rays rays;
  sparse_voxel_octree_view tree;
  bin_marks_view marks;
  counted_rays counted;
  WFPG_HD void operator()(std::size_t i) const {
    if (!counted.includes(rays.number(i))) return;
    const ray_to_bin ray = rays(i);
    if (!ray.active) return;
    const node_id leaf = leaf_of(tree, ray);
    if (leaf != invalid_node) marks.count(leaf, counted.stride * ray.paths);
  }
};

}  // namespace wfpg::detail
