// Counts and sums by key that ranks add up, in few bytes.
// 64 keys form a block, and all ranks first learn how many values each block has.
// Blocks without values then send nothing.
// A block's number of values bounds the count of each of its keys.
// Counts have as many bits as that number, so that their sums over ranks do not run over.
// All ranks know from the counts what each key needs.
// A key with one value sends a float, and one with more sends a sum of 64 bits.
// All lengths follow from the values of all ranks.
// Traffic is therefore equal for any number of ranks above 1, and however their values are divided.
// Source: wfpg's own.
// Cost: reads 16 bytes a key once, and O(1) a key of blocks with values.
// Traffic: 4 bytes a block, and 4 or 8 bytes for each key with values.
// Counts take 1 to 32 bits a key in blocks with values; 8 values in 64 keys take 4.
// Memory: as much as is sent, and 20 bytes a block.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/sum_prefix.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wfpg::detail {

/// Values that a key has received in the sample. 16 bytes, so that they lie in one line of a cache.
struct pending_values {
  std::uint64_t sum = 0;    ///< in units of its group's exact_sum
  std::uint32_t count = 0;  ///< values in the sum
};

/// Where the words of each block lie in an array that all blocks share.
/// Trivially copyable; not the owner of either array.
struct packed_words {
  std::uint64_t* ends = nullptr;   ///< a block: words of the blocks up to and with it
  std::uint64_t* words = nullptr;  ///< of all blocks, in their order

  /// Returns the first word of a block.
  WFPG_HD std::uint64_t* begin(std::size_t block) const { return words + (block > 0 ? ends[block - 1] : 0); }
  /// Returns the word after a block's last.
  WFPG_HD std::uint64_t* end(std::size_t block) const { return words + ends[block]; }
};

/// Sums by key, their blocks, and what is sent of them.
/// Trivially copyable; not the owner of the arrays.
/// The functions are steps, in their order: a loop over all blocks calls each of them once.
/// One thread takes a block, so that words need no atomics.
struct packed_sums_view {
  /// One bit each fills a word. Smaller blocks have more totals, and larger ones wider counts.
  static constexpr std::size_t keys_a_block = 64;

  pending_values* pending = nullptr;  ///< a key: this rank's sums, then those of all ranks
  std::size_t keys = 0;               ///< number of keys
  std::uint32_t* totals = nullptr;    ///< a block: number of values; at most 2³¹ on all ranks
  packed_words counts;                ///< lanes of equal widths in a block
  packed_words sums;                  ///< sums of several values from the begin, floats from the end

  /// Returns the number of keys in a block.
  /// The last block may have fewer than others.
  WFPG_HD std::uint32_t size(std::size_t block) const {
    return static_cast<std::uint32_t>(min(keys_a_block, keys - block * keys_a_block));
  }
  /// Returns how many counts of a block fit a word.
  /// A count is at most the block's number of values, so that its lane holds it.
  /// Precondition: the block has values.
  WFPG_HD std::uint32_t lanes(std::size_t block) const {
    return 64u / static_cast<std::uint32_t>(bits_of(totals[block]));
  }

  /// Counts the values of a block's keys on this rank.
  /// Ranks then add the totals up.
  WFPG_HD void count(std::size_t block) const {
    std::uint32_t total = 0;
    for (std::uint32_t k = 0; k < size(block); ++k) total += pending[block * keys_a_block + k].count;
    totals[block] = total;
  }
  /// Writes how many words the counts of a block take: 0 where no rank has values.
  /// Sums of these numbers over blocks then become the ends.
  WFPG_HD void measure_counts(std::size_t block) const {
    counts.ends[block] = totals[block] > 0 ? (size(block) - 1) / lanes(block) + 1 : 0;
  }
  /// Writes the counts of a block's keys on this rank, which ranks then add up word by word.
  WFPG_HD void put_counts(std::size_t block) const {
    if (totals[block] == 0) return;
    const std::uint32_t in_word = lanes(block), bits = 64 / in_word;
    const pending_values* const of_block = pending + block * keys_a_block;
    std::uint64_t* to = counts.begin(block);
    for (std::uint32_t first = 0; first < size(block); first += in_word) {
      const std::uint32_t end = min(first + in_word, size(block));
      std::uint64_t word = 0;
      // The first key has the lowest lane, so that it comes last.
      // A lane has at most 32 bits: blocks have at most 2³¹ values.
      for (std::uint32_t k = end; k-- > first;) word = word << bits | of_block[k].count;
      *to++ = word;
    }
  }
  /// Writes how many words the sums of a block take, from the counts of all ranks.
  /// Two floats share a word.
  WFPG_HD void measure_sums(std::size_t block) const {
    std::uint32_t floats = 0, others = 0;
    for_each_key(block, [&](std::size_t, std::uint32_t count) { ++(count == 1 ? floats : others); });
    sums.ends[block] = others + (floats + 1) / 2;
  }
  /// Writes the sums of a block's keys on this rank: 64-bit ones from the begin on, floats from the end back.
  /// A key's only value is one rank's; the others write 0, which a sum of words leaves as it is.
  WFPG_HD void put_sums(std::size_t block) const {
    std::uint64_t *next = sums.begin(block), *last = sums.end(block);
    bool is_upper = false;  // whether the next float shares the word at `last`
    for_each_key(block, [&](std::size_t key, std::uint32_t count) {
      if (count > 1) {
        *next++ = pending[key].sum;
        return;
      }
      // One value has at most 24 significant bits in any unit, so that a float holds it.
      const std::uint64_t bits = float_bits(static_cast<float>(pending[key].sum));
      if (is_upper)
        *last |= bits << 32;
      else
        *--last = bits;
      is_upper = !is_upper;
    });
  }
  /// Replaces the sums and counts of a block's keys by those of all ranks.
  /// Reads words as put_sums() wrote them. Keys without values keep sum 0.
  WFPG_HD void take_sums(std::size_t block) const {
    const std::uint64_t *next = sums.begin(block), *last = sums.end(block);
    bool is_upper = false;
    for_each_key(block, [&](std::size_t key, std::uint32_t count) {
      pending[key].count = count;
      if (count > 1) {
        pending[key].sum = *next++;
        return;
      }
      if (!is_upper) --last;
      const auto bits = static_cast<std::uint32_t>(is_upper ? *last >> 32 : *last);
      pending[key].sum = static_cast<std::uint64_t>(bits_float(bits));
      is_upper = !is_upper;
    });
  }

 private:
  // Calls f(key, count on all ranks) for the keys of a block that have values, in their order.
  // All ranks see equal keys and counts, so that their words have equal places.
  // Precondition: counts were added up.
  template <class F>
  WFPG_HD void for_each_key(std::size_t block, const F& f) const {
    if (totals[block] == 0) return;
    const std::uint32_t in_word = lanes(block), bits = 64 / in_word;
    const std::uint64_t* from = counts.begin(block);
    for (std::uint32_t first = 0; first < size(block); first += in_word) {
      std::size_t key = block * keys_a_block + first;
      // Ends where no further lane of the word has a count.
      for (std::uint64_t word = *from++; word != 0; word >>= bits, ++key) {
        const auto count = static_cast<std::uint32_t>(word & (~0ull >> (64 - bits)));
        if (count > 0) f(key, count);
      }
    }
  }
};

/// The steps of packed_sums_view, in their order.
/// Each names the function that it calls.
/// Between them, ranks add up totals, counts and sums.
enum class packed_step { count, measure_counts, put_counts, measure_sums, put_sums, take_sums };

/// Kernel: one step of packed_sums_view, for block i.
/// Each step is a kernel of its own, so that none carries the registers of the others.
/// The step is an enumerator: nvcc takes no pointers to member functions here.
template <packed_step step>
struct call_packed_step {
  packed_sums_view view;  ///< what the step is called of
  /// Calls the step for a block.
  WFPG_HD void operator()(std::size_t block) const {
    if constexpr (step == packed_step::count)
      view.count(block);
    else if constexpr (step == packed_step::measure_counts)
      view.measure_counts(block);
    else if constexpr (step == packed_step::put_counts)
      view.put_counts(block);
    else if constexpr (step == packed_step::measure_sums)
      view.measure_sums(block);
    else if constexpr (step == packed_step::put_sums)
      view.put_sums(block);
    else
      view.take_sums(block);
  }
};

template <class Exec>
class packed_sums;

/// Sums of one queue, for packed_sums::reduce().
template <class Exec>
struct sums_to_pack {
  // The caller sets the first two.
  packed_sums<Exec>* memory;           ///< for as many keys; no other sums of the call have it
  array_view<pending_values> pending;  ///< by key; a sum without values must be 0
  packed_sums_view view;               ///< set by the call
};

/// Adds up the sums of all ranks.
/// Takes three reductions, since what is sent next follows from what came before.
/// Owns the memory for it, in that of `Exec`; words grow with what samples have.
/// Movable, not copyable.
template <class Exec>
class packed_sums {
 public:
  /// For no keys.
  packed_sums() = default;
  /// For sums of `keys` keys.
  /// Allocates 20 bytes a block; room for words comes with the first values.
  /// Throws out_of_memory.
  packed_sums(const Exec& exec, std::size_t keys)
      : totals_(exec, (keys + packed_sums_view::keys_a_block - 1) / packed_sums_view::keys_a_block),
        count_ends_(exec, totals_.size()),
        sum_ends_(exec, totals_.size()) {}

  /// Returns the memory in use, bytes.
  std::size_t bytes() const {
    return totals_.bytes() + count_ends_.bytes() + sum_ends_.bytes() + counts_.bytes() + sums_.bytes();
  }

  /// Gives all ranks the sums and counts of all of them, for several queues at once.
  /// All ranks call it with as many queues and keys, and with sums in equal units.
  /// Preconditions: all ranks have at most 2³¹ values; a single value's sum has at most 24 significant bits.
  /// Waits for the host twice a queue. Throws rank_error and out_of_memory.
  static void reduce(const Exec& exec, communicator& ranks, std::vector<sums_to_pack<Exec>>& all) {
    if (all.empty()) return;
    // Totals decide how wide counts are.
    // Of each queue, so that queues with few values a key send narrow ones.
    std::vector<reduction> arrays;
    for (sums_to_pack<Exec>& one : all) arrays.push_back(one.memory->begin(exec, one));
    ranks.all_reduce({arrays.data(), arrays.size()});

    // Counts decide what is sent of each key.
    arrays.clear();
    for (sums_to_pack<Exec>& one : all) arrays.push_back(one.memory->pack_counts(exec, one.view));
    ranks.all_reduce({arrays.data(), arrays.size()});

    // Where both are known, sums and floats are sent, and then unpacked.
    arrays.clear();
    for (sums_to_pack<Exec>& one : all) arrays.push_back(one.memory->pack_sums(exec, one.view));
    ranks.all_reduce({arrays.data(), arrays.size()});
    for (sums_to_pack<Exec>& one : all) one.memory->template run<packed_step::take_sums>(exec, one.view);
  }

 private:
  // The first step: totals of blocks.
  // Sets where the other steps find their arrays.
  reduction begin(const Exec& exec, sums_to_pack<Exec>& one) {
    one.view.pending = one.pending.data();
    one.view.keys = one.pending.size();
    one.view.totals = totals_.data();
    one.view.counts.ends = count_ends_.data();
    one.view.sums.ends = sum_ends_.data();
    run<packed_step::count>(exec, one.view);
    return reduction::sum(totals_.view());
  }
  // The second step and the third. Those before are done on all ranks.
  // Waits for the host, which allocates `words`; `to` then has them.
  template <packed_step measure, packed_step put>
  reduction pack(const Exec& exec, const packed_sums_view& view, buffer<std::uint64_t, Exec>& words,
                 buffer<std::uint64_t, Exec>& ends, packed_words& to) {
    run<measure>(exec, view);
    const array_view<std::uint64_t> made = fit(exec, words, ends);
    to.words = made.data();
    run<put>(exec, view);
    return reduction::sum(made);
  }
  // Counts of keys, as wide as totals say.
  // What is sent of a key follows from them.
  reduction pack_counts(const Exec& exec, packed_sums_view& view) {
    return pack<packed_step::measure_counts, packed_step::put_counts>(exec, view, counts_, count_ends_,
                                                                      view.counts);
  }
  // Sums and floats of keys, which counts tell apart.
  reduction pack_sums(const Exec& exec, packed_sums_view& view) {
    return pack<packed_step::measure_sums, packed_step::put_sums>(exec, view, sums_, sum_ends_, view.sums);
  }
  // Runs a step for all blocks.
  // Steps before it are done, and those of other ranks as far as reductions say.
  template <packed_step step>
  void run(const Exec& exec, const packed_sums_view& view) {
    exec.for_each(totals_.size(), call_packed_step<step>{view});
  }
  // Makes room for the words of all blocks.
  // Their numbers become ends. Returns the words.
  array_view<std::uint64_t> fit(const Exec& exec, buffer<std::uint64_t, Exec>& words,
                                buffer<std::uint64_t, Exec>& ends) {
    // The host reads the last end, since it allocates and tells the communicator how much is sent.
    const auto n = static_cast<std::size_t>(sum_prefix(exec, ends));
    return words.fit(exec, n, n / 4);
  }

  buffer<std::uint32_t, Exec> totals_;                 // a block
  buffer<std::uint64_t, Exec> count_ends_, sum_ends_;  // likewise
  buffer<std::uint64_t, Exec> counts_, sums_;          // words of all blocks
};

}  // namespace wfpg::detail
