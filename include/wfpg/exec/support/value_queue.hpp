// Values that the threads of a sample add to many sums: queued as they come, summed exactly at its end, so
// that any order of arrival gives the same bits.
//
// Memory: 8 bytes a value of its capacity, 16 a key.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/fill.h>

namespace wfpg::detail {

/// Values of a queue, at most.
inline constexpr std::size_t most_queued = std::size_t(1) << 31;

/// What a key has received since the last time.
struct pending_values {
  std::uint64_t sum = 0;  ///< in units of exact_sum, once it is made
  std::uint32_t count = 0;
  std::uint32_t largest = 0;  ///< bits of the largest value
};

/// Adds `n` values that sum to `sum` to a mean of `count` values. The count stays at `most` when it is
/// reached: from then on old values fade, and nothing overflows.
WFPG_HD inline void add_to_mean(double& mean, std::uint32_t& count, double sum, std::uint32_t n,
                                std::uint32_t most = 0xffffffffu) {
  const std::uint64_t total = std::uint64_t(count) + n;
  mean += (sum - static_cast<double>(n) * mean) / static_cast<double>(total);
  count = static_cast<std::uint32_t>(min<std::uint64_t>(total, most));
}

/// The exact sum of non-negative finite floats in any order: integers in units of the largest one's last
/// bits, of which 39 lie below its own and make room for n to carry.
class exact_sum {
 public:
  /// `largest`: the bits of the largest value; n > 0 values follow.
  WFPG_HD exact_sum(std::uint32_t largest, std::uint32_t n)
      : exponent_(exponent(largest)), shift_(39 - bits_of(n - 1)) {}
  /// A value in these units.
  WFPG_HD std::uint64_t term(std::uint32_t bits) const {
    const std::uint64_t mantissa = bits >> 23 ? (bits & 0x7fffffu) | 0x800000u : bits;
    const int left = shift_ + exponent(bits) - exponent_;
    return left >= 0 ? mantissa << left : (left > -32 ? mantissa >> -left : 0);
  }
  WFPG_HD double value(std::uint64_t sum) const {
    const std::uint64_t unit = static_cast<std::uint64_t>(1023 + exponent_ - 150 - shift_)
                               << 52;  // a power of 2
    double scale;
    memcpy(&scale, &unit, sizeof scale);
    return static_cast<double>(sum) * scale;
  }

 private:
  WFPG_HD static int exponent(std::uint32_t bits) { return max(static_cast<int>(bits >> 23), 1); }

  int exponent_;
  int shift_;
};

/// View of a queue, for kernels. A default-constructed one has room for nothing.
class value_queue_view {
 public:
  /// The first of n entries in a row. Each that fits is then written or dropped, and then counted: writing
  /// all of a thread's first lets a processor overlap look-ups, which the atomics of counting would put in
  /// order.
  WFPG_HD std::uint32_t reserve(std::uint32_t n) const {
    // Asked first, so that what comes to a full queue does not count on until the counter begins again. A
    // default view has no counter.
    if (capacity_ == 0 || atomic_load(queued_) >= capacity_) return capacity_;
    return atomic_add(queued_, n);
  }
  WFPG_HD bool fits(std::uint32_t entry) const { return entry < capacity_; }

  /// A non-negative finite value for a key. Precondition: the entry fits.
  WFPG_HD void write(std::uint32_t entry, std::uint32_t key, float value) const {
    queue_[entry] = std::uint64_t(float_bits(value) & 0x7fffffffu) << 32 | key;  // without zero's sign
    prefetch(pending_ + key);                                                    // for count()
  }
  /// Precondition: the entry fits.
  WFPG_HD void drop(std::uint32_t entry) const { queue_[entry] = dropped; }
  WFPG_HD void count(std::uint32_t entry) const {
    if (!fits(entry) || queue_[entry] == dropped) return;
    pending_values& pending = pending_[key_of(queue_[entry])];
    const std::uint32_t bits = bits_of_value(queue_[entry]);
    atomic_add(&pending.count, 1);
    if (atomic_load(&pending.largest) < bits) atomic_max(&pending.largest, bits);
  }

  /// Adds an entry to its key's sum, once all are counted.
  WFPG_HD void add(std::uint32_t entry) const {
    constexpr std::uint32_t ahead = 16;  // as many lines as a processor may wait for
    if (entry + ahead < min(*queued_, capacity_) && queue_[entry + ahead] != dropped)
      prefetch(pending_ + key_of(queue_[entry + ahead]));
    if (queue_[entry] == dropped) return;
    pending_values& to = pending_[key_of(queue_[entry])];
    atomic_add(&to.sum, exact_sum(to.largest, to.count).term(bits_of_value(queue_[entry])));
  }
  /// How many values a key has received; `sum` is their sum. Forgets them.
  WFPG_HD std::uint32_t take(std::size_t key, double& sum) const {
    const pending_values from = pending_[key];
    if (from.count == 0) return 0;
    sum = exact_sum(from.largest, from.count).value(from.sum);
    pending_[key] = {};
    return from.count;
  }

 private:
  template <class Exec>
  friend class value_queue;
  static constexpr std::uint64_t dropped = 0xffffffffull;  // an entry that is no key's

  WFPG_HD static std::uint32_t key_of(std::uint64_t entry) { return static_cast<std::uint32_t>(entry); }
  WFPG_HD static std::uint32_t bits_of_value(std::uint64_t entry) {
    return static_cast<std::uint32_t>(entry >> 32);
  }

  std::uint64_t* queue_ = nullptr;  // bits of the value above, the key below
  pending_values* pending_ = nullptr;
  std::uint32_t* queued_ = nullptr;
  std::uint32_t capacity_ = 0;
};

struct add_queued_values {
  value_queue_view queue;
  WFPG_HD void operator()(std::size_t i) const { queue.add(static_cast<std::uint32_t>(i)); }
};

/// Owns a queue.
template <class Exec>
class value_queue {
 public:
  value_queue() = default;
  /// Of up to `capacity` values between two sums, at most 2³¹, for keys below `keys`, less than 2³² - 1.
  /// Throws out_of_memory. Without capacity it takes 4 bytes.
  value_queue(const Exec& exec, std::size_t capacity, std::size_t keys)
      : queue_(exec, capacity), pending_(exec, capacity > 0 ? keys : 0), queued_(exec, 1) {
    view_.queue_ = queue_.data();
    view_.pending_ = pending_.data();
    view_.queued_ = queued_.data();
    view_.capacity_ = static_cast<std::uint32_t>(capacity);
    clear(exec);
  }

  value_queue_view view() const { return view_; }
  std::size_t capacity() const { return queue_.size(); }
  std::size_t bytes() const { return queue_.bytes() + pending_.bytes() + queued_.bytes(); }

  /// Forgets what is queued.
  void clear(const Exec& exec) {
    exec.fill_bytes(pending_.data(), 0, pending_.bytes());
    empty(exec);
  }
  /// Sums what is queued by key, for take(), and empties the queue. O(values).
  void sum(const Exec& exec) {
    exec.for_each(exec::device_count{queued_.data(), queue_.size()}, add_queued_values{view_});
    empty(exec);
  }

 private:
  void empty(const Exec& exec) { ::thrust::fill_n(exec.thrust(), queued_.data(), queued_.size(), 0u); }

  buffer<std::uint64_t, Exec> queue_;
  buffer<pending_values, Exec> pending_;  // a key
  buffer<std::uint32_t, Exec> queued_;
  value_queue_view view_;
};

}  // namespace wfpg::detail
