// What the CPU policies share: memory, transfers, and loops made from one primitive of the backend.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/exec/support/cpu_block.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/copy.h>
#include <thrust/sort.h>

#include <cstddef>
#include <cstring>

namespace wfpg::exec {

/// Indices that go through steps: what one step waits for is there for the next on a CPU, and in registers on
/// a device, where an index has a thread. All threads make every call; a run may be empty. From step to step
/// an index sees what itself left, in memory and among varying values, and nobody else's.
class cpu_run {
 public:
  static constexpr int most = 32;  ///< indices
  /// What steps leave to each other: a value of each index.
  template <class T>
  using varying = lanes<T, most>;

  /// Of [first, last) as many as a run has.
  WFPG_HD cpu_run(std::size_t first, std::size_t last)
      : first_(first), size_(static_cast<int>(min<std::size_t>(last - first, most))) {}

  /// Of all runs one begins at 0.
  WFPG_HD std::size_t first() const { return first_; }
  /// f(index, i) for the i-th index of the run; i is its place among varying values.
  template <class F>
  WFPG_HD void for_each(const F& f) const {
    for (int i = 0; i < size_; ++i) f(first_ + static_cast<std::size_t>(i), i);
  }
  /// The same, and the sum of what f returns.
  template <class F>
  WFPG_HD auto sum(const F& f) const {
    std::decay_t<decltype(f(first_, 0))> total(0);
    for_each([&](std::size_t index, int i) { total += f(index, i); });
    return total;
  }
  /// f() by one of the run's threads.
  template <class F>
  WFPG_HD void once(const F& f) const {
    f();
  }

 private:
  std::size_t first_;
  int size_;
};

/// Base of a CPU policy `Derived<W>`. Derived offers
///   int concurrency() const;                          threads that may work at once
///   void parallel(n, grain, f(first, last, worker)) const;  ranges of [0, n), 0 <= worker < concurrency()
template <class Derived, int W>
class cpu_policy {
 public:
  static constexpr int warp_width = W;
  static constexpr int warps_per_block = 1;
  using block = cpu_block<W>;

  explicit cpu_policy(memory_resource* resource)
      : resource_(resource ? resource : std::pmr::get_default_resource()) {}

  memory_resource* resource() const { return resource_; }

  /// The same policy with its memory, and its temporaries, from elsewhere.
  Derived with_resource(memory_resource* resource) const {
    Derived other = self();
    other.resource_ = resource ? resource : std::pmr::get_default_resource();
    return other;
  }

  void copy_to_host(void* to, const void* from, std::size_t bytes) const {
    if (bytes) std::memcpy(to, from, bytes);
  }
  void copy_from_host(void* to, const void* from, std::size_t bytes) const {
    if (bytes) std::memcpy(to, from, bytes);
  }

  void fill_bytes(void* to, unsigned char value, std::size_t bytes) const {
    if (bytes) std::memset(to, value, bytes);
  }

  /// Sorts n pairs stably by their keys, whose number of bits Thrust's sorts here have no use for.
  template <class Key, class Value>
  void sort_pairs(std::size_t n, int, const Key* keys, const Value* values, Key* sorted_keys,
                  Value* sorted_values) const {
    ::thrust::copy_n(self().thrust(), keys, n, sorted_keys);
    ::thrust::copy_n(self().thrust(), values, n, sorted_values);
    ::thrust::stable_sort_by_key(self().thrust(), sorted_keys, sorted_keys + n, sorted_values);
  }

  /// f(i) for each i in [0, n), in no order.
  template <class F>
  void for_each(std::size_t n, const F& f) const {
    self().parallel(n, elements_per_task, [&f](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) f(i);
    });
  }
  template <class F>
  void for_each(device_count n, const F& f) const {
    for_each(n.get(), f);
  }

  /// f(run) for runs of indices that make up [0, n), in no order; also where n is 0.
  template <class F>
  void for_each_run(std::size_t n, const F& f) const {
    if (n == 0) return f(cpu_run(0, 0));
    self().parallel(n, elements_per_task, [&f](std::size_t first, std::size_t last, int) {
      for (; first < last; first += cpu_run::most) f(cpu_run(first, last));
    });
  }

  /// f(block, i) for each i in [0, n), in no order; each block has `scratch_bytes` of scratch memory.
  template <class F>
  void for_each_block(std::size_t n, std::size_t scratch_bytes, const F& f) const {
    const std::size_t stride = (scratch_bytes + cache_line - 1) / cache_line * cache_line;
    const buffer<std::byte, Derived> arena(self(), stride * static_cast<std::size_t>(self().concurrency()));
    std::byte* const memory = arena.data();
    self().parallel(n, 1, [=, &f](std::size_t first, std::size_t last, int worker) {
      for (std::size_t i = first; i < last; ++i) {
        block team(memory + stride * static_cast<std::size_t>(worker), scratch_bytes);
        f(team, i);
      }
    });
  }
  template <class F>
  void for_each_block(device_count n, std::size_t scratch_bytes, const F& f) const {
    for_each_block(n.get(), scratch_bytes, f);
  }

 private:
  static constexpr std::size_t elements_per_task = 256;
  static constexpr std::size_t cache_line = 64;

  const Derived& self() const { return static_cast<const Derived&>(*this); }

  memory_resource* resource_;
};

}  // namespace wfpg::exec
