// The emulated warp of CPU policies: W lanes in lockstep as an array over which plain loops vectorise.
// A device policy offers the same names over registers and warp intrinsics.
#pragma once

#include <wfpg/detail/config.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace wfpg::detail {

/// One value for each of the W lanes of a warp.
template <class T, int W>
struct lanes {
  T values[W];

  T& operator[](int lane) { return values[lane]; }
  const T& operator[](int lane) const { return values[lane]; }
};

/// W cooperating lanes, W = 8, 16 or 32. Every call is made by all lanes together.
template <int W>
class emulated_warp {
 public:
  static_assert(W == 8 || W == 16 || W == 32, "a warp has 8, 16 or 32 lanes");
  static constexpr int width = W;
  template <class T>
  using varying = lanes<T, W>;

  /// f(lane) for each lane, gathered.
  template <class F>
  auto map(F f) const {
    using value = std::decay_t<decltype(f(0))>;
    lanes<value, W> result;
    WFPG_VECTORIZE
    for (int lane = 0; lane < W; ++lane) result[lane] = f(lane);
    return result;
  }

  /// f(lane) for each lane, for what it does.
  template <class F>
  void for_each_lane(F f) const {
    WFPG_VECTORIZE
    for (int lane = 0; lane < W; ++lane) f(lane);
  }

  /// Bit l is set where lane l's value is true.
  std::uint32_t ballot(const lanes<bool, W>& value) const {
    std::uint32_t bits = 0;
    for (int lane = 0; lane < W; ++lane) bits |= static_cast<std::uint32_t>(value[lane]) << lane;
    return bits;
  }

  /// The value of lane `source`, 0 <= source < W, given to all.
  template <class T>
  T shuffle(const lanes<T, W>& value, int source) const {
    return value[source];
  }

  /// To each lane the value of the lane it names.
  template <class T>
  lanes<T, W> shuffle(const lanes<T, W>& value, const lanes<int, W>& source) const {
    lanes<T, W> result;
    for (int lane = 0; lane < W; ++lane) result[lane] = value[source[lane]];
    return result;
  }

  /// Lane l receives the sum of lanes 0 to l.
  template <class T>
  lanes<T, W> inclusive_sum(const lanes<T, W>& value) const {
    lanes<T, W> result = value;
    for (int distance = 1; distance < W; distance *= 2) {
      const lanes<T, W> before = result;
      WFPG_VECTORIZE
      for (int lane = distance; lane < W; ++lane) result[lane] = before[lane] + before[lane - distance];
    }
    return result;
  }

  /// op over all lanes (associative and commutative), by halves; the same value to all.
  template <class T, class Op>
  T reduce(const lanes<T, W>& value, Op op) const {
    lanes<T, W> partial = value;
    for (int half = W / 2; half > 0; half /= 2) {
      WFPG_VECTORIZE
      for (int lane = 0; lane < half; ++lane) partial[lane] = op(partial[lane], partial[lane + half]);
    }
    return partial[0];
  }

  /// The lowest lane whose value is true, or W where none is.
  int find_first(const lanes<bool, W>& value) const {
    for (int lane = 0; lane < W; ++lane)
      if (value[lane]) return lane;
    return W;
  }
};

}  // namespace wfpg::detail
