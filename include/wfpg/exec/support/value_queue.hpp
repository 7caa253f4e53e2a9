// Sums of many values by key, exact in any order of arrival.
// Threads queue values as they come.
// The end of a sample adds them up in integers.
// Results have the same bits however threads interleave, which float atomics do not give.
// 512 neighbouring keys form a group, whose sums have one unit.
// A thread that queues a value therefore touches no memory of its key.
// Of 2²⁰ values, those down to 2⁻¹⁹ of their group's largest keep all 24 bits.
// Below 2⁻⁴³ they count as 0.
// Where several ranks share a sample, each queues the values of its paths.
// sum() then adds up the sums of all ranks, too; rank_exchange.hpp sums several queues at once.
// Traffic: 8 bytes, 4 a group, and that of packed_sums.hpp.
// Source: sums of floats in fixed point, as in reproducible summation (Demmel and Nguyen 2013).
// Cost: two atomics a value, one a reservation, and one where a value is its group's largest so far.
// Memory: 8 bytes for each value of the capacity, 16 for each key, 8 for each group, and 4.
// With ranks, that of packed_sums.hpp more.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/packed_sums.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <vector>

namespace wfpg::detail {

/// Largest capacity of a queue: the 32-bit counter cannot wrap around beyond it.
inline constexpr std::size_t most_queued = std::size_t(1) << 31;

/// Adds `n` values with the given sum to a mean of `count` values.
/// The count stays at `most` once it is reached: from then on old values fade, and nothing overflows.
/// Precondition: n > 0.
WFPG_HD inline void add_to_mean(double& mean, std::uint32_t& count, double sum, std::uint32_t n,
                                std::uint32_t most = 0xffffffffu) {
  const std::uint64_t total = std::uint64_t(count) + n;
  mean += (sum - static_cast<double>(n) * mean) / static_cast<double>(total);
  count = static_cast<std::uint32_t>(min<std::uint64_t>(total, most));
}

/// Adds non-negative finite floats as 64-bit integers, with one result in any order.
/// The unit is chosen from the largest value: 39 bits lie below its last one.
/// As many of them as n needs are given to the carry.
/// Bits below the unit are cut off from each value alone, so that they do not depend on the order.
class exact_sum {
 public:
  /// `largest`: bits of the largest value.
  /// `n`: at least the number of values, in [1, 2³¹].
  WFPG_HD exact_sum(std::uint32_t largest, std::uint32_t n)
      : exponent_(exponent(largest)), shift_(39 - bits_of(n - 1)) {}
  /// The units that have a code().
  WFPG_HD explicit exact_sum(std::uint32_t code)
      : exponent_(static_cast<int>(code >> 6)), shift_(static_cast<int>(code & 63u)) {}
  /// Returns a number for the units. Never 0.
  WFPG_HD std::uint32_t code() const {
    return static_cast<std::uint32_t>(exponent_) << 6 | static_cast<std::uint32_t>(shift_);
  }
  /// Returns a value, given by its float bits, in these units.
  /// Subnormal values are allowed.
  WFPG_HD std::uint64_t term(std::uint32_t bits) const {
    const std::uint64_t mantissa = bits >> 23 ? (bits & 0x7fffffu) | 0x800000u : bits;
    const int left = shift_ + exponent(bits) - exponent_;
    return left >= 0 ? mantissa << left : (left > -32 ? mantissa >> -left : 0);
  }
  /// Returns a sum of terms as a number; rounded once, to double.
  WFPG_HD double value(std::uint64_t sum) const {
    const std::uint64_t unit = static_cast<std::uint64_t>(1023 + exponent_ - 150 - shift_)
                               << 52;  // a power of 2
    double scale;
    memcpy(&scale, &unit, sizeof scale);
    return static_cast<double>(sum) * scale;
  }

 private:
  /// Returns the biased exponent; 1 for subnormal numbers, which have its scale.
  WFPG_HD static int exponent(std::uint32_t bits) { return max(static_cast<int>(bits >> 23), 1); }

  int exponent_;
  int shift_;
};

/// View of a queue, for kernels.
/// A default-constructed one has room for nothing.
/// A thread reserves entries, and writes or drops each that fits.
/// Then sum() of the queue adds them, one thread a key takes what came of them, and end_takes() ends it.
class value_queue_view {
 public:
  /// Reserves n entries in a row, and returns the first.
  /// They may lie beyond the capacity: ask fits().
  WFPG_HD std::uint32_t reserve(std::uint32_t n) const {
    // Asked first, so that what comes to a full queue does not count on until the counter begins again. A
    // default view has no counter.
    if (capacity_ == 0 || atomic_load(queued_) >= capacity_) return capacity_;
    return atomic_add(queued_, n);
  }
  /// Returns whether an entry lies inside the queue.
  /// Values that do not fit are lost.
  WFPG_HD bool fits(std::uint32_t entry) const { return entry < capacity_; }

  /// Writes a value for a key, and raises the largest value of the key's group.
  /// Preconditions: the entry fits, and the value is finite and not negative.
  WFPG_HD void write(std::uint32_t entry, std::uint32_t key, float value) const {
    const std::uint32_t bits = float_bits(value) & 0x7fffffffu;  // without zero's sign
    queue_[entry] = std::uint64_t(bits) << 32 | key;
    std::uint32_t& largest = largest_[group_of(key)];
    if (atomic_load(&largest) <= bits) atomic_max(&largest, bits + 1);
  }
  /// Leaves a reserved entry without a value.
  /// Entries that are reserved and neither written nor dropped hold what earlier samples left.
  /// Precondition: the entry fits.
  WFPG_HD void drop(std::uint32_t entry) const { queue_[entry] = dropped; }

  /// Adds an entry to its key's sum.
  /// Entries ahead are fetched, as they are scattered over the keys.
  /// Precondition: set_unit() was called for all groups.
  WFPG_HD void add(std::uint32_t entry) const {
    constexpr std::uint32_t ahead = 16;  // as many lines as a processor may wait for
    if (entry + ahead < min(*queued_, capacity_) && queue_[entry + ahead] != dropped)
      prefetch(pending_ + key_of(queue_[entry + ahead]));
    if (queue_[entry] == dropped) return;
    const std::uint32_t key = key_of(queue_[entry]);
    pending_values& to = pending_[key];
    atomic_add(&to.sum, unit_of(group_of(key)).term(bits_of_value(queue_[entry])));
    atomic_add(&to.count, 1);
  }
  /// Chooses the unit of a group's sums, from the values in the queue.
  /// Sums that it has already are of a sum() that failed, or were never taken: they are forgotten.
  /// Before its first values its sums may be anything.
  /// A group without values keeps its unit and its sums.
  /// One thread a group.
  WFPG_HD void set_unit(std::size_t group) const { set_unit(group, min(*queued_, capacity_)); }
  /// Chooses a group's unit for n values, which may be those of all ranks.
  WFPG_HD void set_unit(std::size_t group, std::uint32_t n) const {
    if (largest_[group] == 0) return;
    if (units_[group] != cleared) forget(group);
    units_[group] = exact_sum(largest_[group] - 1, n).code();
  }
  /// Whether one of n > 0 keys may have a sum that is not taken. O(n / 512).
  /// Groups are asked: values of neighbouring keys count, too.
  WFPG_HD bool has_values(std::size_t first, std::size_t n) const {
    for (std::size_t g = group_of(first); g <= group_of(first + n - 1); ++g)
      if (has_unit(g)) return true;
    return false;
  }
  /// Returns how many values a key has received, and forgets them.
  /// Asks its group first, so that keys of groups without any are not read.
  /// `sum` becomes their sum.
  /// `sum` is left as it is where there are none.
  /// One thread takes a key.
  WFPG_HD std::uint32_t take(std::size_t key, double& sum) const {
    const std::size_t group = group_of(key);
    if (!has_unit(group)) return 0;
    const pending_values from = pending_[key];
    if (from.count == 0) return 0;
    sum = unit_of(group).value(from.sum);
    pending_[key] = {};
    return from.count;
  }
  /// Says that a group's sums were taken.
  /// Those of a group that never had values stay unknown.
  WFPG_HD void end_takes(std::size_t group) const {
    if (has_unit(group)) units_[group] = cleared;
  }

 private:
  template <class Exec>
  friend class value_queue;
  static constexpr std::uint64_t dropped = 0xffffffffull;  // an entry that is no key's
  // In place of a unit: all sums are 0. Less than this: they may be anything. An exact_sum::code() is more.
  static constexpr std::uint32_t cleared = 1;

  /// The groups of a million keys then lie in a processor's first cache.
  static constexpr std::uint32_t keys_a_group = 512;
  /// Returns the number of groups of `keys` keys.
  static constexpr std::size_t groups(std::size_t keys) { return (keys + keys_a_group - 1) / keys_a_group; }

  /// Returns the group that a key belongs to.
  WFPG_HD static std::size_t group_of(std::size_t key) { return key / keys_a_group; }
  /// Whether a group has sums, or had them before they were taken.
  WFPG_HD bool has_unit(std::size_t group) const { return units_[group] > cleared; }
  /// Returns the unit of a group that has sums.
  WFPG_HD exact_sum unit_of(std::size_t group) const { return exact_sum(units_[group]); }
  /// Forgets a group's sums.
  WFPG_HD void forget(std::size_t group) const {
    const std::size_t first = group * keys_a_group, end = min(first + keys_a_group, keys_);
    for (std::size_t key = first; key < end; ++key) pending_[key] = {};
  }
  /// Returns the key of an entry, its lower half.
  WFPG_HD static std::uint32_t key_of(std::uint64_t entry) { return static_cast<std::uint32_t>(entry); }
  /// Returns the float bits of an entry's value, its upper half.
  WFPG_HD static std::uint32_t bits_of_value(std::uint64_t entry) {
    return static_cast<std::uint32_t>(entry >> 32);
  }

  std::uint64_t* queue_ = nullptr;  // bits of the value above, the key below
  pending_values* pending_ = nullptr;
  std::uint32_t* largest_ = nullptr;  // a group: bits of the largest value in the queue, plus 1; or 0
  std::uint32_t* units_ = nullptr;  // a group: exact_sum::code() of its sums; `cleared` or less: it has none
  std::size_t keys_ = 0;
  std::uint32_t* queued_ = nullptr;
  std::uint32_t capacity_ = 0;
};

/// Functor that chooses the unit of group i.
/// It runs between the kernels that queue values and add_queued_values.
struct set_group_unit {
  value_queue_view queue;
  WFPG_HD void operator()(std::size_t i) const { queue.set_unit(i); }
};

/// Functor that says that the sums of group i were taken.
struct end_takes_of_group {
  value_queue_view queue;
  WFPG_HD void operator()(std::size_t i) const { queue.end_takes(i); }
};

/// Functor that adds entry i to its key's sum.
/// Entries without a value are passed over.
struct add_queued_values {
  value_queue_view queue;
  WFPG_HD void operator()(std::size_t i) const { queue.add(static_cast<std::uint32_t>(i)); }
};

/// Owns the memory of a queue and its keys, in the memory of `Exec`.
/// Movable, not copyable.
template <class Exec>
class value_queue {
 public:
  /// Without memory; its view has room for nothing.
  value_queue() = default;
  /// Room for `capacity` values between two sums, at most 2³¹, and for keys below `keys`.
  /// Precondition: keys < 2³² - 1.
  /// Without capacity it takes 4 bytes.
  /// `ranks`: sums are of the values of all ranks, which have as many keys; null: of this queue's.
  /// Throws out_of_memory.
  value_queue(const Exec& exec, std::size_t capacity, std::size_t keys, communicator* ranks = nullptr)
      : ranks_(ranks),
        queue_(exec, capacity),
        pending_(exec, capacity > 0 ? keys : 0),
        largest_(exec, value_queue_view::groups(pending_.size())),
        units_(exec, largest_.size()),
        queued_(exec, 1),
        all_queued_(exec, ranks ? 1 : 0),
        packed_(exec, ranks && ranks->size() > 1 ? pending_.size() : 0) {
    view_.queue_ = queue_.data();
    view_.pending_ = pending_.data();
    view_.largest_ = largest_.data();
    view_.units_ = units_.data();
    view_.keys_ = pending_.size();
    view_.queued_ = queued_.data();
    view_.capacity_ = static_cast<std::uint32_t>(capacity);
    clear(exec);
  }

  /// Returns the view that kernels write through.
  /// Valid until the queue is destroyed or moved into.
  value_queue_view view() const { return view_; }
  /// Returns the number of values that fit between two sums.
  std::size_t capacity() const { return queue_.size(); }
  /// Returns the memory in use, bytes.
  std::size_t bytes() const {
    return queue_.bytes() + pending_.bytes() + largest_.bytes() + units_.bytes() + queued_.bytes() +
           all_queued_.bytes() + packed_.bytes();
  }

  /// Forgets all values, those that are summed and not yet taken included. O(keys / 512), with ranks O(keys).
  /// The memory stays.
  void clear(const Exec& exec) {
    // A group's sums are cleared before its first values: most memory is then never touched. Those that ranks
    // send are read without asking.
    if (ranks_) exec.fill_bytes(pending_.data(), 0, pending_.bytes());
    exec.fill_bytes(units_.data(), 0, units_.bytes());
    empty(exec);
    is_summed_ = false;
  }
  /// Adds the queued values to their keys' sums, for take(), and empties the queue.
  /// O(values + keys / 512), and with several ranks O(values + keys).
  /// May be called again where it failed.
  /// With ranks, all of them call it. It waits for the work before, and throws rank_error, and
  /// std::invalid_argument above 2³¹ values.
  /// Call end_takes() before the next one: sums that are left are forgotten with their group.
  void sum(const Exec& exec) {
    if (ranks_) {
      if (!is_summed_) sum_of_ranks(exec, *ranks_, {this}, {});
      is_summed_ = false;
      return;
    }
    exec.for_each(units_.size(), set_group_unit{view_});
    exec.for_each(exec::device_count{queued_.data(), queue_.size()}, add_queued_values{view_});
    empty(exec);
  }
  /// Says that all sums were taken. Groups then have none. O(keys / 512).
  void end_takes(const Exec& exec) { exec.for_each(units_.size(), end_takes_of_group{view_}); }
  /// Does for several queues with ranks what their next sum() would, which then does nothing.
  /// They share their reductions, the first of which has `arrays`, too.
  /// Waits and throws as sum() does.
  static void sum_of_ranks(const Exec& exec, communicator& ranks, const std::vector<value_queue*>& queues,
                           std::vector<reduction> arrays);

 private:
  void empty(const Exec& exec) {
    exec.fill_bytes(largest_.data(), 0, largest_.bytes());
    // Should this fail, a repeated sum adds and counts all values twice, which leaves their means.
    exec.fill_bytes(queued_.data(), 0, queued_.bytes());
  }

  communicator* ranks_ = nullptr;
  bool is_summed_ = false;  // by sum_of_ranks(), for the next sum()
  buffer<std::uint64_t, Exec> queue_;
  buffer<pending_values, Exec> pending_;         // a key
  buffer<std::uint32_t, Exec> largest_, units_;  // a group
  buffer<std::uint32_t, Exec> queued_;
  buffer<std::uint64_t, Exec> all_queued_;  // one number, with ranks
  packed_sums<Exec> packed_;
  value_queue_view view_;
};

}  // namespace wfpg::detail

#include <wfpg/exec/detail/value_queue_impl.hpp>
