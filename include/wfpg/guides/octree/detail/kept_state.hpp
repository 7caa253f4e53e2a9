// Kept fields to and from bytes: which node each leaf's rays belong to, and the slots in use with what their
// cells hold. All that finds slots is made anew when the next sample begins.
// Memory: a copy of the whole pool, and the bytes of the fields in use. The pool is copied in three pieces,
// since a device takes microseconds for each copy.
#pragma once

#include <wfpg/guides/octree/field_store.hpp>
#include <wfpg/state/section_file.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace wfpg::detail {

/// Sets each leaf's rays and the level of the node that they belong to.
struct place_marks {
  sparse_voxel_octree_view tree;
  const std::uint32_t* rays;
  const std::uint8_t* levels;
  leaf_mark* leaves;
  WFPG_HD void operator()(std::size_t i) const {
    leaves[i] = {rays[i], tree.ancestor(tree.first_leaf() + static_cast<node_id>(i), levels[i])};
  }
};

/// A slot in use, as a file has it. It has cells once it has been built: its fraction is positive then.
struct saved_slot {
  std::uint32_t index = 0;
  field_slot slot;
  resident_field field;

  bool is_built() const { return field.fraction > 0.0f; }
};

/// The cells of all slots, on the host.
struct pool_copy {
  std::vector<std::uint32_t> words, hits;
  std::vector<std::uint16_t> learnt;  // empty where fields do not learn
};

/// Whether words are the sums of a distribution with weight.
inline bool is_distribution(const std::vector<std::uint32_t>& words, std::size_t resolution) {
  std::uint32_t above = 0;  // of all rows so far
  for (std::size_t y = 0; y < resolution; ++y) {
    const auto row = words.begin() + static_cast<std::ptrdiff_t>(y * resolution),
               end = row + static_cast<std::ptrdiff_t>(resolution);
    if (!std::is_sorted(row, end)) return false;
    const std::uint32_t through = words[resolution * resolution + y];
    if (through < above || through - above != *(end - 1)) return false;
    above = through;
  }
  return words.back() > 0;
}

/// In [0, most]; by bits, since compilers may assume that numbers are finite.
inline bool is_up_to(float value, float most) {
  return float_bits(value) <= float_bits(most);
}

/// To and from the members of a field_store that a guide file holds.
struct store_state {
  template <class Exec>
  static section_writer levels_to_bytes(const Exec& exec, const field_store<Exec>& store) {
    section_writer bytes;
    bytes.put(store.counted_samples_);
    bytes.put(store.busy_until_);
    const std::vector<leaf_mark> leaves = store.marks_.leaves_.to_host(exec);
    for (const leaf_mark& leaf : leaves) bytes.put(leaf.rays);
    for (const leaf_mark& leaf : leaves) bytes.put(static_cast<std::uint8_t>(store.tree_.level_of(leaf.bin)));
    return bytes;
  }

  template <class Exec>
  static void restore_levels(const Exec& exec, section_reader bytes, std::uint32_t samples,
                             field_store<Exec>& store) {
    const std::size_t leaf_count = store.tree_.leaf_count();
    store.sample_ = samples;
    store.counted_samples_ = bytes.get<std::uint32_t>();
    store.busy_until_ = bytes.get<std::uint32_t>();
    bytes.require(store.counted_samples_ <= samples && store.busy_until_ <= samples + 32,
                  "has more samples than there were");
    const buffer<std::uint32_t, Exec> rays(exec, bytes.get_all<std::uint32_t>(leaf_count));
    const auto levels = bytes.get_all<std::uint8_t>(leaf_count);
    bytes.end();
    for (const std::uint8_t level : levels)
      bytes.require(level <= store.tree_.depth(), "has a level below the leaves");
    const buffer<std::uint8_t, Exec> levels_there(exec, levels);
    exec.for_each(leaf_count,
                  place_marks{store.tree_, rays.data(), levels_there.data(), store.marks_.leaves_.data()});
  }

  template <class Exec>
  static section_writer fields_to_bytes(const Exec& exec, const field_store<Exec>& store) {
    const auto state = read_element(exec, store.state_.data());
    section_writer bytes;
    bytes.put(state.pressure);
    bytes.put(state.refused_births);
    bytes.put(state.delayed_births);
    bytes.put(state.born);
    bytes.put(state.refreshed);
    bytes.put(std::uint32_t(store.learns()));
    const std::vector<field_slot> slots = store.slots_.to_host(exec);
    const std::vector<resident_field> fields = store.fields_.to_host(exec);
    pool_copy pool = empty_pool(store);
    copy_pool(store, pool,
              [&](auto* host, const auto& cells) { exec.copy_to_host(host, cells.data(), cells.bytes()); });
    for (std::size_t i = 0; i < slots.size(); ++i)
      if (slots[i].key != no_key)
        put({static_cast<std::uint32_t>(i), slots[i], fields[i]}, store, pool, bytes);
    return bytes;
  }

  template <class Exec>
  static void restore_fields(const Exec& exec, section_reader bytes, field_store<Exec>& store) {
    field_store_state state;
    state.pressure = bytes.get<std::uint32_t>();
    state.refused_births = bytes.get<std::uint32_t>();
    state.delayed_births = bytes.get<std::uint32_t>();
    bytes.require(state.pressure >= adapt_pressure::least && state.pressure <= adapt_pressure::most,
                  "has a pressure out of range");
    state.born = bytes.get<std::uint64_t>();
    state.refreshed = bytes.get<std::uint64_t>();
    const bool learnt = bytes.get<std::uint32_t>() != 0;
    std::vector<field_slot> slots(store.capacity_);
    std::vector<resident_field> fields(store.capacity_);
    std::vector<std::uint32_t> keys;
    pool_copy pool = empty_pool(store);
    for (std::size_t first = 0; bytes.left() > 0;) {
      const saved_slot saved = take(bytes, store, first);
      first = std::size_t(saved.index) + 1;
      slots[saved.index] = saved.slot;
      fields[saved.index] = saved.field;
      keys.push_back(saved.slot.key);
      if (saved.is_built()) take_cells(bytes, store, saved.index, learnt, pool);
    }
    std::sort(keys.begin(), keys.end());
    bytes.require(std::adjacent_find(keys.begin(), keys.end()) == keys.end(), "has a field twice");
    state.free = static_cast<std::uint32_t>(store.capacity_ - keys.size());
    copy_pool(store, pool, [&](const auto* host, const auto& cells) {
      exec.copy_from_host(cells.data(), host, cells.bytes());
    });
    exec.copy_from_host(store.slots_.data(), slots.data(), store.slots_.bytes());
    exec.copy_from_host(store.fields_.data(), fields.data(), store.fields_.bytes());
    exec.copy_from_host(store.state_.data(), &state, sizeof state);
  }

 private:
  static_assert(sizeof(cone_hit) == 4 && sizeof(rough_mean) == 2, "files hold them as words");

  template <class Exec>
  static pool_copy empty_pool(const field_store<Exec>& store) {
    return {std::vector<std::uint32_t>(store.words_.size()), std::vector<std::uint32_t>(store.hits_.size()),
            std::vector<std::uint16_t>(store.learns() ? store.learnt_.size() : 0)};
  }

  /// copy(host, buffer) for each part of the pool.
  template <class Exec, class Copy>
  static void copy_pool(const field_store<Exec>& store, pool_copy& pool, const Copy& copy) {
    copy(pool.words.data(), store.words_);
    copy(pool.hits.data(), store.hits_);
    if (store.learns()) copy(pool.learnt.data(), store.learnt_);
  }

  /// Appends a slot's part of what a pool has, `n` a slot.
  template <class Word>
  static void put_part(const std::vector<Word>& of_all, std::size_t n, std::size_t slot,
                       section_writer& bytes) {
    bytes.put_all(of_all.data() + slot * n, n);
  }

  /// The ray that a build was to start from is not there: the wave that it was of has ended.
  template <class Exec>
  static void put(const saved_slot& s, const field_store<Exec>& store, const pool_copy& pool,
                  section_writer& bytes) {
    bytes.put(s.index);
    bytes.put(s.slot.key);
    bytes.put(s.slot.last_used);
    bytes.put(s.slot.last_built);
    bytes.put(s.slot.builds);
    bytes.put(s.field.normal);
    bytes.put(s.field.fraction);
    if (!s.is_built()) return;
    put_part(pool.words, store.words_a_field(), s.index, bytes);
    put_part(pool.hits, store.cells_a_field(), s.index, bytes);
    if (store.learns()) put_part(pool.learnt, store.cells_a_field(), s.index, bytes);
  }

  /// The next slot in use, `first` or one after it, up to its cells.
  template <class Exec>
  static saved_slot take(section_reader& bytes, const field_store<Exec>& store, std::size_t first) {
    saved_slot s;
    s.index = bytes.get<std::uint32_t>();
    bytes.require(s.index >= first, "has slots out of order");
    bytes.require(s.index < store.capacity_, "has more fields than option kept.budget_bytes has room for");
    s.slot.key = bytes.get<std::uint32_t>();
    s.slot.last_used = bytes.get<std::uint32_t>();
    s.slot.last_built = bytes.get<std::uint32_t>();
    s.slot.builds = bytes.get<std::uint32_t>();
    s.field.normal = bytes.get_vec3();
    s.field.fraction = bytes.get<float>();
    check(bytes, s, store.tree_.node_count(), store.sample_);
    return s;
  }

  /// The cells of a slot, into its part of the pool.
  template <class Exec>
  static void take_cells(section_reader& bytes, const field_store<Exec>& store, std::size_t slot, bool learnt,
                         pool_copy& pool) {
    const std::size_t cells = store.cells_a_field();
    const auto words = bytes.get_all<std::uint32_t>(store.words_a_field());
    const auto hits = bytes.get_all<std::uint32_t>(cells);
    check_cells(bytes, words, hits, store.options_.resolution, store.tree_.node_count());
    place(words, slot, pool.words);
    place(hits, slot, pool.hits);
    if (!learnt) return;
    const auto values = bytes.get_all<std::uint16_t>(cells);
    if (store.learns()) place(values, slot, pool.learnt);
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
    bytes.require(is_up_to(s.field.fraction, 1.0f), "has a fraction out of range");
    bytes.require(s.field.fraction > 0.0f || s.slot.builds == 0, "has a field without cells");
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
