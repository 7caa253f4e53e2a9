// A block of a CPU policy: one thread that plays a team, with an arena that stays in its core's cache.
// A device policy offers the same names over a thread block and its shared memory.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/lanes.hpp>

#include <cassert>
#include <cstddef>

namespace wfpg {

/// A team of threads that share scratch memory. Every call is made by the whole team together.
template <int W>
class cpu_block {
 public:
  using warp = emulated_warp<W>;
  static constexpr int warps = 1;

  WFPG_HD cpu_block(std::byte* scratch, std::size_t bytes) : scratch_(scratch), bytes_(bytes) {}

  /// f(i) for i in [0, n), in no order. What it wrote is seen by the team after sync().
  template <class F>
  WFPG_HD void for_each(int n, F f) const {
    for (int i = 0; i < n; ++i) f(i);
  }

  /// f(warp, i) for i in [0, n): each i is one warp's. warp.index() is below `warps`.
  template <class F>
  WFPG_HD void for_each_warp(int n, F f) const {
    const warp all;
    for (int i = 0; i < n; ++i) f(all, i);
  }

  /// Waits until the whole team is here.
  WFPG_HD void sync() const {}

  /// n uninitialised elements of the scratch memory, until the block ends. The sum of all requests, each
  /// rounded up to 16 bytes, stays within what for_each_block was given.
  template <class T>
  WFPG_HD T* scratch(std::size_t n) {
    std::byte* result = scratch_ + used_;
    used_ += (n * sizeof(T) + 15) / 16 * 16;
    assert(used_ <= bytes_);
    return reinterpret_cast<T*>(result);
  }

  /// Sum of f(i) for i in [0, n), given to all; W partial sums, so that floats add up alike on any team.
  template <class F>
  WFPG_HD auto sum(int n, F f) const {
    const warp all;
    using value = std::decay_t<decltype(f(0))>;
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
