// The emulated warp of CPU policies: W lanes in lockstep, as arrays over which plain loops vectorise.
// A device policy offers these names over registers and warp intrinsics (cuda_block.hpp).
// Source: ispc's varying values and gangs (Pharr and Mark 2012) have this form.
// Cost: O(W) a call, in vector instructions where the compiler finds them.
// Memory: W values a varying.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace wfpg {

/// One value for each of the W lanes of a warp, which all code can see.
/// Trivially copyable where T is: W · sizeof(T) bytes, aligned as T.
template <class T, int W>
struct lanes {
  /// Values by lane.
  T values[W];

  /// Returns lane `lane`'s value, 0 <= lane < W.
  /// Writes through it reach this lane alone.
  WFPG_HD T& operator[](int lane) { return values[lane]; }
  /// Returns that value, read-only.
  /// On a device each lane sees only its own: code that runs on both asks for no other.
  WFPG_HD const T& operator[](int lane) const { return values[lane]; }
};

/// W cooperating lanes, W = 8, 16 or 32.
/// All lanes make every call together.
/// One thread plays them all.
/// Kernels use it on a device too, where each ray has a thread and no warp to itself.
/// It has no state, and may be copied or made anew at will.
template <int W>
class emulated_warp {
 public:
  static_assert(W == 8 || W == 16 || W == 32, "a warp has 8, 16 or 32 lanes");
  /// Lanes of the warp: W.
  static constexpr int width = W;
  /// A value that differs between lanes.
  template <class T>
  using varying = lanes<T, W>;

  /// Returns f(lane) of each lane.
  /// Iterations must be independent: they are vectorised.
  template <class F>
  WFPG_HD auto map(F f) const {
    using value = std::decay_t<decltype(f(0))>;
    lanes<value, W> result;
    WFPG_VECTORIZE
    for (int lane = 0; lane < W; ++lane) result[lane] = f(lane);
    return result;
  }

  /// Calls f(lane) for the lanes below n.
  /// Precondition: n <= W.
  template <class F>
  WFPG_HD void for_lanes_below(int n, F f) const {
    for (int lane = 0; lane < n; ++lane) f(lane);
  }

  /// Calls f(i) for i in [0, n), by lane i mod W.
  /// Not marked for vectorisation, since f may call a host's code.
  template <class F>
  WFPG_HD void for_each(int n, F f) const {
    for (int i = 0; i < n; ++i) f(i);
  }

  /// Writes sums[i] = f(0) + ... + f(i), for i in [0, n). f(i) may read sums[i].
  /// One by one: a scan by shifted lanes would load what is still on its way to memory, and wait.
  template <class T, class F>
  WFPG_HD void inclusive_scan(int n, T* sums, F f) const {
    T sum(0);
    for (int i = 0; i < n; ++i) sums[i] = sum += f(i);
  }

  /// Returns the warp's index in its block: 0, since a CPU's block has one warp.
  WFPG_HD int index() const { return 0; }

  /// Waits for all lanes, which then see each other's writes.
  /// Does nothing here.
  WFPG_HD void sync() const {}

  /// Returns a word whose bit l is set where lane l's value is true.
  /// Bits from W on are 0.
  WFPG_HD std::uint32_t ballot(const lanes<bool, W>& value) const {
    std::uint32_t bits = 0;
    for (int lane = 0; lane < W; ++lane) bits |= static_cast<std::uint32_t>(value[lane]) << lane;
    return bits;
  }

  /// Returns the value of lane `source` to all lanes.
  /// Precondition: 0 <= source < W.
  template <class T>
  WFPG_HD T shuffle(const lanes<T, W>& value, int source) const {
    return value[source];
  }

  /// Returns to each lane the value of the lane that it names.
  template <class T>
  WFPG_HD lanes<T, W> shuffle(const lanes<T, W>& value, const lanes<int, W>& source) const {
    lanes<T, W> result;
    for (int lane = 0; lane < W; ++lane) result[lane] = value[source[lane]];
    return result;
  }

  /// Returns op over all lanes to each of them. op must be associative and commutative.
  /// Merges by halves, log2(W) steps, so that floats give equal bits at equal W.
  template <class T, class Op>
  WFPG_HD T reduce(const lanes<T, W>& value, Op op) const {
    // Halving keeps each step a loop over neighbours, which vectorises.
    lanes<T, W> partial = value;
    for (int half = W / 2; half > 0; half /= 2) {
      WFPG_VECTORIZE
      for (int lane = 0; lane < half; ++lane) partial[lane] = op(partial[lane], partial[lane + half]);
    }
    return partial[0];
  }

  /// Returns the lowest lane whose value is true, or W where none is.
  /// The search ends there.
  WFPG_HD int find_first(const lanes<bool, W>& value) const {
    for (int lane = 0; lane < W; ++lane)
      if (value[lane]) return lane;
    return W;
  }
};

}  // namespace wfpg
