// Base of the CPU policies: memory, transfers, and loops built from one primitive of each backend.
// A backend supplies concurrency() and parallel(); all else is here.
// Source: curiously recurring base class (Coplien 1995); no virtual call in a loop.
// Cost: tasks have 256 indices each, or one block.
// Memory: the scratch of one block a thread, during a loop.
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

/// Up to 32 consecutive indices that a functor takes through several steps together.
/// A CPU finishes a step for all indices before the next one: memory loads overlap.
/// A device gives each index a thread of a warp, and keeps what steps leave in registers.
/// All threads make every call, and a run may be empty.
/// An index sees only what it wrote itself, in memory and in varying values; not what others wrote.
/// It is passed by value or reference, and holds no data of the steps.
class cpu_run {
 public:
  /// Indices of a run, at most.
  static constexpr int most = 32;
  /// What steps leave to each other: one value for each index of the run.
  template <class T>
  using varying = lanes<T, most>;

  /// A run of [first, last), cut off after `most` indices.
  WFPG_HD cpu_run(std::size_t first, std::size_t last)
      : first_(first), size_(static_cast<int>(min<std::size_t>(last - first, most))) {}

  /// Returns the first index.
  /// One run of a loop begins at 0, which lets f do something once.
  WFPG_HD std::size_t first() const { return first_; }
  /// Calls f(index, i) for each index.
  /// `i` is its place among varying values, in [0, most).
  template <class F>
  WFPG_HD void for_each(const F& f) const {
    for (int i = 0; i < size_; ++i) f(first_ + static_cast<std::size_t>(i), i);
  }
  /// Calls f(index, i) for each index, and returns the sum of the results to all threads.
  /// An empty run has sum 0.
  template <class F>
  WFPG_HD auto sum(const F& f) const {
    std::decay_t<decltype(f(first_, 0))> total(0);
    for_each([&](std::size_t index, int i) { total += f(index, i); });
    return total;
  }
  /// Calls f() in one of the run's threads, also where the run is empty.
  template <class F>
  WFPG_HD void once(const F& f) const {
    f();
  }

 private:
  std::size_t first_;
  int size_;
};

/// A loop body without its type: calls the functor that `body` points to for a range of indices. Backends
/// instantiate their parallel loop for this once, not for each kernel, which takes most of their compile
/// time.
struct range_body {
  const void* body;                                                                 ///< the functor
  void (*call)(const void* body, std::size_t first, std::size_t last, int worker);  ///< calls it

  /// The body of a functor f(first, last, worker) that outlives this.
  template <class F>
  explicit range_body(const F& f)
      : body(&f), call([](const void* g, std::size_t first, std::size_t last, int worker) {
          (*static_cast<const F*>(g))(first, last, worker);
        }) {}
  /// Calls the functor for [first, last) as worker number `worker`.
  void operator()(std::size_t first, std::size_t last, int worker) const { call(body, first, last, worker); }
};

/// Base of a CPU policy `Derived<W>` with warps of W lanes. Derived offers:
///   int concurrency() const;                          threads that may work at once
///   void parallel(n, grain, f(first, last, worker)) const;  ranges of [0, n), 0 <= worker < concurrency()
///
/// Every call returns when its work is done, so that calls are ordered by themselves.
/// Concurrent calls from several threads are safe where the memory resource is.
template <class Derived, int W>
class cpu_policy {
 public:
  /// Lanes of a warp: 8, 16 or 32.
  static constexpr int warp_width = W;
  /// A block is a single warp, played by one thread.
  static constexpr int warps_per_block = 1;
  /// The team of threads that for_each_block() passes to f.
  using block = cpu_block<W>;

  /// Allocates from `resource`, which must outlive what is allocated.
  /// Null stands for the default resource.
  explicit cpu_policy(memory_resource* resource)
      : resource_(resource ? resource : std::pmr::get_default_resource()) {}

  /// Returns the source of all memory, temporaries included. Never null.
  /// Buffers keep this pointer, to free their memory.
  memory_resource* resource() const { return resource_; }

  /// Returns a copy of the policy that allocates from `resource`, also for temporaries.
  /// Null stands for the default resource.
  Derived with_resource(memory_resource* resource) const {
    Derived other = self();
    other.resource_ = resource ? resource : std::pmr::get_default_resource();
    return other;
  }

  /// Copies `bytes` bytes; the policy's memory is the host's.
  /// Ranges must not overlap.
  void copy_to_host(void* to, const void* from, std::size_t bytes) const {
    if (bytes) std::memcpy(to, from, bytes);
  }
  /// Copies `bytes` bytes from the host.
  /// Pointers may be null where `bytes` is 0.
  void copy_from_host(void* to, const void* from, std::size_t bytes) const {
    if (bytes) std::memcpy(to, from, bytes);
  }

  /// Sets each of `bytes` bytes to `value`.
  /// The call does nothing where `bytes` is 0, and `to` may then be null.
  void fill_bytes(void* to, unsigned char value, std::size_t bytes) const {
    if (bytes) std::memset(to, value, bytes);
  }

  /// Sorts n pairs stably by key.
  /// Inputs stay as they are; outputs must not overlap them.
  /// The number of significant bits is not used: Thrust's CPU sorts compare whole keys.
  /// Precondition: keys have no bits set above those, so that all policies give one order.
  template <class Key, class Value>
  void sort_pairs(std::size_t n, int, const Key* keys, const Value* values, Key* sorted_keys,
                  Value* sorted_values) const {
    // Thrust sorts in place, so that the outputs begin as copies of the inputs.
    ::thrust::copy_n(self().thrust(), keys, n, sorted_keys);
    ::thrust::copy_n(self().thrust(), values, n, sorted_values);
    ::thrust::stable_sort_by_key(self().thrust(), sorted_keys, sorted_keys + n, sorted_values);
  }

  /// Calls f(i) for each i in [0, n), in no order, on up to concurrency() threads.
  /// Tasks have 256 indices, so that starting one costs little beside its work.
  template <class F>
  void for_each(std::size_t n, const F& f) const {
    self().parallel(n, elements_per_task, [&f](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) f(i);
    });
  }
  /// Takes the number of indices from the policy's memory, when the loop begins.
  template <class F>
  void for_each(device_count n, const F& f) const {
    for_each(n.get(), f);
  }

  /// Calls f(run) for runs that make up [0, n), in no order; once with an empty run where n is 0.
  template <class F>
  void for_each_run(std::size_t n, const F& f) const {
    // The empty run gives once() its call.
    if (n == 0) return f(cpu_run(0, 0));
    self().parallel(n, elements_per_task, [&f](std::size_t first, std::size_t last, int) {
      for (; first < last; first += cpu_run::most) f(cpu_run(first, last));
    });
  }

  /// Calls f(block, i) for each i in [0, n), in no order, each i by one thread.
  /// Each block has `scratch_bytes` of scratch memory, rounded up to cache lines of 64 bytes.
  /// The arena is allocated from resource(), one block for each thread.
  /// Throws out_of_memory.
  template <class F>
  void for_each_block(std::size_t n, std::size_t scratch_bytes, const F& f) const {
    // One block's scratch for each worker: a worker reuses it from one i to the next.
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
  /// Reads the number of blocks where the device would, and runs no more than `n.capacity`.
  template <class F>
  void for_each_block(device_count n, std::size_t scratch_bytes, const F& f) const {
    for_each_block(n.get(), scratch_bytes, f);
  }

 private:
  /// Indices of one task.
  static constexpr std::size_t elements_per_task = 256;
  /// Threads' scratch memories share no line, bytes.
  static constexpr std::size_t cache_line = 64;

  /// The policy itself, which has the primitive.
  const Derived& self() const { return static_cast<const Derived&>(*this); }

  /// Not owned.
  memory_resource* resource_;
};

}  // namespace wfpg::exec
