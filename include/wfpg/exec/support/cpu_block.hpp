// A block of a CPU policy: one thread that plays a team, with scratch memory that stays in its core's cache.
// A device policy offers these names over a thread block and shared memory (cuda_block.hpp).
// Source: the thread blocks and shared memory of CUDA's programming model.
// Cost: plain loops; synchronisation is free.
// Memory: two words, and the scratch that it is given.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/lanes.hpp>

#include <cassert>
#include <cstddef>

namespace wfpg {

/// A team of threads that share scratch memory.
/// The whole team makes every call together, with equal arguments.
template <int W>
class cpu_block {
 public:
  /// The warp that for_each_warp() passes to f, with W lanes.
  using warp = emulated_warp<W>;
  /// Warps of a block: a single one.
  static constexpr int warps = 1;

  /// A block over `bytes` bytes of scratch memory, which must be aligned to 16 bytes and outlive it.
  WFPG_HD cpu_block(std::byte* scratch, std::size_t bytes) : scratch_(scratch), bytes_(bytes) {}

  /// Calls f(i) for i in [0, n), in no order.
  /// The team sees what f wrote after sync().
  template <class F>
  WFPG_HD void for_each(int n, F f) const {
    for (int i = 0; i < n; ++i) f(i);
  }

  /// Calls f(warp, i) for i in [0, n), each by one warp. warp.index() is below `warps`.
  /// Warps work at once on a device, so that each i must write to places of its own.
  template <class F>
  WFPG_HD void for_each_warp(int n, F f) const {
    // A single warp takes every i.
    const warp all;
    for (int i = 0; i < n; ++i) f(all, i);
  }

  /// Waits until the whole team has arrived.
  /// Orders writes to scratch memory.
  /// Does nothing here.
  WFPG_HD void sync() const {}

  /// Returns n uninitialised elements of scratch memory, valid until the block ends.
  /// Each request is rounded up to 16 bytes.
  /// Their sum must not exceed what for_each_block() was given.
  /// Only debug builds check that, on CPUs.
  template <class T>
  WFPG_HD T* scratch(std::size_t n) {
    std::byte* result = scratch_ + used_;
    used_ += (n * sizeof(T) + 15) / 16 * 16;
    assert(used_ <= bytes_);
    return reinterpret_cast<T*>(result);
  }

  /// Returns the sum of f(i) for i in [0, n) to all threads.
  /// W partial sums are merged by halves, so that floats add up in one order on any number of threads.
  template <class F>
  WFPG_HD auto sum(int n, F f) const {
    const warp all;
    using value = std::decay_t<decltype(f(0))>;
    // Lane l adds up f(l), f(l + W), and so on.
    auto partial = all.map([](int) { return value(0); });
    for (int first = 0; first < n; first += W)
      all.for_lanes_below(min(W, n - first), [&](int lane) { partial[lane] += f(first + lane); });
    return all.reduce(partial, [](value a, value b) { return a + b; });
  }

 private:
  std::byte* scratch_;
  std::size_t bytes_;
  std::size_t used_ = 0;
};

}  // namespace wfpg
