// Converts kept fields to and from bytes: the bin of each leaf, and the slots in use with the content of
// their cells. The table that finds slots is made anew when the next sample begins.
//
// Memory: a copy of the whole pool, and the bytes of the fields in use. The pool is copied in pieces,
// since each copy costs a device microseconds.
#pragma once

#include <wfpg/guides/octree/field_store.hpp>
#include <wfpg/state/section_file.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace wfpg::detail {

/// Kernel: sets each leaf's ray count, and its bin from the bin's level.
struct place_marks {
  sparse_voxel_octree_view tree;
  const std::uint32_t* rays;
  const std::uint8_t* levels;
  leaf_mark* leaves;
  WFPG_HD void operator()(std::size_t i) const {
    leaves[i] = {rays[i], tree.ancestor(tree.first_leaf() + static_cast<node_id>(i), levels[i])};
  }
};

/// A slot in use, as a file has it. Its cells follow once it has been built.
struct saved_slot {
  std::uint32_t index = 0;
  field_slot slot;
  resident_field field;
};

/// The cells of all slots, on the host.
struct pool_copy {
  std::vector<std::uint32_t> words, hits;
  std::vector<std::uint16_t> learnt;       // empty where fields do not learn
  std::vector<field_fractions> fractions;  // a slot; empty where fields do not learn
};

/// Whether words are the inclusive sums of a distribution with positive weight. Kernels search them without
/// checks.
inline bool is_distribution(const std::vector<std::uint32_t>& words, std::size_t resolution) {
  std::uint32_t above = 0;  // of all rows so far
  for (std::size_t y = 0; y < resolution; ++y) {
    const auto row = words.begin() + static_cast<std::ptrdiff_t>(y * resolution),
               end = row + static_cast<std::ptrdiff_t>(resolution);
    if (!std::is_sorted(row, end)) return false;
    const std::uint32_t prefix = words[resolution * resolution + y];
    if (prefix < above || prefix - above != *(end - 1)) return false;
    above = prefix;
  }
  return words.back() > 0;
}

/// Whether a value is in [0, most]. Compares bits, since compilers may assume that numbers are finite.
inline bool is_up_to(float value, float most) {
  return float_bits(value) <= float_bits(most);
}

/// Reads and writes the members of a field_store that a guide file holds; its friend.
struct kept_state {
  // Section "levels": samples counted, the last busy sample, samples before all
  // paths were guided, the part of the paths that bins are for, then each leaf's rays and its bin's level.
  template <class Exec>
  static section_writer levels_to_bytes(const Exec& exec, const field_store<Exec>& store) {
    section_writer bytes;
    bytes.put(store.schedule_.counted_samples());
    bytes.put(store.schedule_.busy_until());
    bytes.put(store.schedule_.before());
    bytes.put(store.log2_divisor_);
    const std::vector<leaf_mark> leaves = store.marks_.leaves_.to_host(exec);
    for (const leaf_mark& leaf : leaves) bytes.put(leaf.rays);
    for (const leaf_mark& leaf : leaves) bytes.put(static_cast<std::uint8_t>(store.tree_.level_of(leaf.bin)));
    return bytes;
  }

  // Reads section "levels" after `samples` samples. Throws file_error for wrong levels or counters.
  template <class Exec>
  static void restore_levels(const Exec& exec, section_reader bytes, std::uint32_t samples,
                             field_store<Exec>& store) {
    const std::size_t leaf_count = store.tree_.leaf_count();
    const auto counted = bytes.get<std::uint32_t>(), busy_until = bytes.get<std::uint32_t>(),
               before = bytes.get<std::uint32_t>(), log2_divisor = bytes.get<std::uint32_t>();
    bytes.require(store.schedule_.restore(samples, counted, busy_until, before),
                  "has more samples than there were");
    bytes.require(log2_divisor < 32, "has bins for too few paths");
    store.log2_divisor_ = log2_divisor;
    const buffer<std::uint32_t, Exec> rays(exec, bytes.get_all<std::uint32_t>(leaf_count));
    const auto levels = bytes.get_all<std::uint8_t>(leaf_count);
    bytes.end();
    for (const std::uint8_t level : levels)
      bytes.require(level <= store.tree_.depth(), "has a level below the leaves");
    const buffer<std::uint8_t, Exec> levels_there(exec, levels);
    exec.for_each(leaf_count,
                  place_marks{store.tree_, rays.data(), levels_there.data(), store.marks_.leaves_.data()});
    store.marks_.restart_ranks(exec);
  }

  // Section "fields": counters, then the slots in use in ascending order, each with its cells.
  template <class Exec>
  static section_writer fields_to_bytes(const Exec& exec, const field_store<Exec>& store) {
    const auto state = read_element(exec, store.state());
    section_writer bytes;
    bytes.put(state.pressure);
    bytes.put(state.refused);
    bytes.put(state.delayed);
    bytes.put(state.allocated);
    bytes.put(state.refreshed);
    bytes.put(std::uint32_t(store.pool_.learns()));
    const std::vector<field_slot> slots = store.table_.to_host(exec);
    const std::vector<resident_field> fields = store.pool_.fields_.to_host(exec);
    pool_copy pool = empty_pool(store);
    copy_pool(store, pool,
              [&](auto* host, const auto& cells) { exec.copy_to_host(host, cells.data(), cells.bytes()); });
    for (std::size_t i = 0; i < slots.size(); ++i)
      if (slots[i].key != no_key)
        put({static_cast<std::uint32_t>(i), slots[i], fields[i]}, store, pool, bytes);
    return bytes;
  }

  // Reads section "fields". Throws file_error for what kernels could not rely on, before it changes the
  // store.
  template <class Exec>
  static void restore_fields(const Exec& exec, section_reader bytes, float first_fraction,
                             bool learns_fractions, field_store<Exec>& store) {
    field_store_state state;
    state.pressure = bytes.get<std::uint32_t>();
    state.refused = bytes.get<std::uint32_t>();
    state.delayed = bytes.get<std::uint32_t>();
    bytes.require(state.pressure >= build_schedule_constants::least_pressure &&
                      state.pressure <= build_schedule_constants::largest_pressure,
                  "has a pressure out of range");
    state.allocated = bytes.get<std::uint64_t>();
    state.refreshed = bytes.get<std::uint64_t>();
    const bool learnt = bytes.get<std::uint32_t>() != 0;
    std::vector<field_slot> slots(store.table_.size());
    std::vector<resident_field> fields(store.table_.size());
    std::vector<std::uint32_t> keys;
    pool_copy pool = empty_pool(store);
    for (std::size_t first = 0; bytes.left() > 0;) {
      const saved_slot saved = take(bytes, store, first);
      first = std::size_t(saved.index) + 1;
      slots[saved.index] = saved.slot;
      fields[saved.index] = saved.field;
      keys.push_back(saved.slot.key);
      if (!saved.field.is_built()) continue;
      take_cells(bytes, store, saved.index, learnt, pool);
      set_fractions(first_fraction, learns_fractions, saved.index, fields[saved.index], pool);
    }
    std::sort(keys.begin(), keys.end());
    bytes.require(std::adjacent_find(keys.begin(), keys.end()) == keys.end(), "has a field twice");
    state.free = static_cast<std::uint32_t>(store.table_.size() - keys.size());
    copy_pool(store, pool, [&](const auto* host, const auto& cells) {
      exec.copy_from_host(cells.data(), host, cells.bytes());
    });
    exec.copy_from_host(store.pool_.fields(), fields.data(), fields.size() * sizeof(resident_field));
    store.table_.restore(exec, slots, state);
  }

 private:
  static_assert(sizeof(cone_hit) == 4 && sizeof(stochastic_mean16) == 2, "files hold them as words");

  template <class Exec>
  static pool_copy empty_pool(const field_store<Exec>& store) {
    return {std::vector<std::uint32_t>(store.pool_.words_.size()),
            std::vector<std::uint32_t>(store.pool_.hits_.size()),
            std::vector<std::uint16_t>(store.pool_.learns() ? store.pool_.learnt_.size() : 0),
            std::vector<field_fractions>(store.pool_.fractions_.size())};
  }

  /// Calls copy(host, buffer) for each part of the pool.
  template <class Exec, class Copy>
  static void copy_pool(const field_store<Exec>& store, pool_copy& pool, const Copy& copy) {
    copy(pool.words.data(), store.pool_.words_);
    copy(pool.hits.data(), store.pool_.hits_);
    if (!store.pool_.learns()) return;
    copy(pool.learnt.data(), store.pool_.learnt_);
    copy(pool.fractions.data(), store.pool_.fractions_);
  }

  /// Appends one slot's part of an array with `n` entries a slot.
  template <class Word>
  static void put_part(const std::vector<Word>& of_all, std::size_t n, std::size_t slot,
                       section_writer& bytes) {
    bytes.put_all(of_all.data() + slot * n, n);
  }

  /// Appends one slot. The origin of a build that was asked for is left out: its wave has ended.
  template <class Exec>
  static void put(const saved_slot& s, const field_store<Exec>& store, const pool_copy& pool,
                  section_writer& bytes) {
    bytes.put(s.index);
    bytes.put(s.slot.key);
    bytes.put(s.slot.last_used);
    bytes.put(s.slot.last_built);
    bytes.put(s.slot.builds);
    bytes.put(s.field.normal);
    bytes.put(std::uint32_t(s.field.smooth) | std::uint32_t(s.field.narrow) << 16);
    if (!s.field.is_built()) return;
    put_part(pool.words, store.pool_.words_a_field(), s.index, bytes);
    put_part(pool.hits, store.pool_.cells_a_field(), s.index, bytes);
    if (!store.pool_.learns()) return;
    put_part(pool.learnt, store.pool_.cells_a_field(), s.index, bytes);
    const field_fractions& fractions = pool.fractions[s.index];
    for (const fraction_means& m : fractions.means)
      for (const float value : {m.light, m.guided, m.count, m.reference}) bytes.put(value);
  }

  /// Reads the next slot in use up to its cells. Its index is at least `first`.
  template <class Exec>
  static saved_slot take(section_reader& bytes, const field_store<Exec>& store, std::size_t first) {
    saved_slot s;
    s.index = bytes.get<std::uint32_t>();
    bytes.require(s.index >= first, "has slots out of order");
    bytes.require(s.index < store.table_.size(),
                  "has more fields than option kept.budget_bytes has room for");
    s.slot.key = bytes.get<std::uint32_t>();
    s.slot.last_used = bytes.get<std::uint32_t>();
    s.slot.last_built = bytes.get<std::uint32_t>();
    s.slot.builds = bytes.get<std::uint32_t>();
    s.field.normal = bytes.get_vec3();
    const auto fractions = bytes.get<std::uint32_t>();
    s.field.smooth = static_cast<std::uint16_t>(fractions & 0xffffu);
    s.field.narrow = static_cast<std::uint16_t>(fractions >> 16);
    check(bytes, s, store.tree_.node_count(), store.schedule_.sample());
    return s;
  }

  /// Reads the cells of a slot into its part of the pool.
  template <class Exec>
  static void take_cells(section_reader& bytes, const field_store<Exec>& store, std::size_t slot, bool learnt,
                         pool_copy& pool) {
    const std::size_t cells = store.pool_.cells_a_field();
    const auto words = bytes.get_all<std::uint32_t>(store.pool_.words_a_field());
    const auto hits = bytes.get_all<std::uint32_t>(cells);
    check_cells(bytes, words, hits, store.options_.resolution, store.tree_.node_count());
    place(words, slot, pool.words);
    place(hits, slot, pool.hits);
    if (!learnt) return;
    const auto values = bytes.get_all<std::uint16_t>(cells);
    const field_fractions fractions = take_fractions(bytes);
    if (!store.pool_.learns()) return;
    place(values, slot, pool.learnt);
    pool.fractions[slot] = fractions;
  }
  /// Gives a field that was read the fractions that it may have. Those of a guider that does not learn them
  /// are `first`. Others lie within the bounds of learning, whatever the saved guider's options were.
  static void set_fractions(float first, bool learns, std::size_t slot, resident_field& field,
                            pool_copy& pool) {
    const auto bounded = [](float f) {
      return clamp(f, fraction_constants::least, fraction_constants::most);
    };
    if (learns && !pool.fractions.empty())
      field.set_fractions(bounded(field.fraction()), bounded(field.narrow_fraction()));
    else
      field.set_fractions(first, first);
    if (!pool.fractions.empty()) pool.fractions[slot].first = first;
  }
  static field_fractions take_fractions(section_reader& bytes) {
    const auto sound = [&bytes] {
      const auto value = bytes.get<float>();
      bytes.require(is_up_to(value, fraction_constants::most_light),
                    "has a fraction that learnt from what is no number");
      return value;
    };
    field_fractions fractions;
    for (fraction_means& m : fractions.means) {
      m.light = sound();
      m.guided = sound();
      m.count = sound();
      m.reference = sound();
      bytes.require(m.count > 0.0f || !(m.light > 0.0f), "has a fraction that learnt from no direction");
    }
    return fractions;
  }
  template <class Word>
  static void place(const std::vector<Word>& words, std::size_t slot, std::vector<Word>& of_all) {
    std::copy(words.begin(), words.end(), of_all.begin() + static_cast<std::ptrdiff_t>(slot * words.size()));
  }

  static void check(const section_reader& bytes, const saved_slot& s, std::uint32_t nodes,
                    std::uint32_t sample) {
    const float square = glm::dot(s.field.normal, s.field.normal);
    bytes.require(s.slot.key / orientations < nodes, "has a field of no node");
    bytes.require(s.slot.last_used <= sample && s.slot.last_built <= sample,
                  "has a field of a sample to come");
    bytes.require(is_finite(square) && (!s.field.hemisphere() || (square > 0.5f && square < 2.0f)),
                  "has a normal without unit length");
    bytes.require((s.field.smooth > 0) == (s.field.narrow > 0), "has a field of one fraction");
    bytes.require(s.field.is_built() || s.slot.builds == 0, "has a field without cells");
  }

  static void check_cells(const section_reader& bytes, const std::vector<std::uint32_t>& words,
                          const std::vector<std::uint32_t>& hits, std::uint32_t resolution,
                          std::uint32_t nodes) {
    bytes.require(is_distribution(words, resolution), "has a field that is no distribution");
    for (const std::uint32_t word : hits) {
      cone_hit hit;
      std::memcpy(static_cast<void*>(&hit), &word, sizeof word);
      bytes.require(hit.is_sound(nodes), "has a cone that hit no node");
    }
  }
};

}  // namespace wfpg::detail
