// The emulated warp of CPU policies: W lanes in lockstep as an array over which plain loops vectorise.
// A device policy offers the same names over registers and warp intrinsics.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace wfpg {

/// One value for each of the W lanes of a warp.
template <class T, int W>
struct lanes {
  T values[W];

  WFPG_HD T& operator[](int lane) { return values[lane]; }
  WFPG_HD const T& operator[](int lane) const { return values[lane]; }
};

/// W cooperating lanes, W = 8, 16 or 32. Every call is made by all lanes together. One thread plays them all,
/// on a device too where a kernel has no warp to spare for a ray.
template <int W>
class emulated_warp {
 public:
  static_assert(W == 8 || W == 16 || W == 32, "a warp has 8, 16 or 32 lanes");
  static constexpr int width = W;
  template <class T>
  using varying = lanes<T, W>;

  /// f(lane) for each lane, gathered.
  template <class F>
  WFPG_HD auto map(F f) const {
    using value = std::decay_t<decltype(f(0))>;
    lanes<value, W> result;
    WFPG_VECTORIZE
    for (int lane = 0; lane < W; ++lane) result[lane] = f(lane);
    return result;
  }

  /// f(lane) for the lanes below n, n <= W.
  template <class F>
  WFPG_HD void for_lanes_below(int n, F f) const {
    for (int lane = 0; lane < n; ++lane) f(lane);
  }

  /// f(i) for i in [0, n), lane i mod W each. f may call the host's code, which nobody asked to vectorise.
  template <class F>
  WFPG_HD void for_each(int n, F f) const {
    for (int i = 0; i < n; ++i) f(i);
  }

  /// sums[i] becomes the sum of f(0) to f(i), for i in [0, n); f(i) may read sums[i]. One by one: lanes
  /// shifted against each other are read from memory before their stores have got there.
  template <class T, class F>
  WFPG_HD void inclusive_scan(int n, T* sums, F f) const {
    T sum(0);
    for (int i = 0; i < n; ++i) sums[i] = sum += f(i);
  }

  /// Which warp of its block this is.
  WFPG_HD int index() const { return 0; }

  /// Waits until all lanes are here; what they wrote is seen by all.
  WFPG_HD void sync() const {}

  /// Bit l is set where lane l's value is true.
  WFPG_HD std::uint32_t ballot(const lanes<bool, W>& value) const {
    std::uint32_t bits = 0;
    for (int lane = 0; lane < W; ++lane) bits |= static_cast<std::uint32_t>(value[lane]) << lane;
    return bits;
  }

  /// The value of lane `source`, 0 <= source < W, given to all.
  template <class T>
  WFPG_HD T shuffle(const lanes<T, W>& value, int source) const {
    return value[source];
  }

  /// To each lane the value of the lane it names.
  template <class T>
  WFPG_HD lanes<T, W> shuffle(const lanes<T, W>& value, const lanes<int, W>& source) const {
    lanes<T, W> result;
    for (int lane = 0; lane < W; ++lane) result[lane] = value[source[lane]];
    return result;
  }

  /// op over all lanes (associative and commutative), by halves; the same value to all.
  template <class T, class Op>
  WFPG_HD T reduce(const lanes<T, W>& value, Op op) const {
    lanes<T, W> partial = value;
    for (int half = W / 2; half > 0; half /= 2) {
      WFPG_VECTORIZE
      for (int lane = 0; lane < half; ++lane) partial[lane] = op(partial[lane], partial[lane + half]);
    }
    return partial[0];
  }

  /// The lowest lane whose value is true, or W where none is.
  WFPG_HD int find_first(const lanes<bool, W>& value) const {
    for (int lane = 0; lane < W; ++lane)
      if (value[lane]) return lane;
    return W;
  }
};

}  // namespace wfpg
