// A block of the CUDA policy and its warps: a thread block with shared memory, and hardware warps.
// Device code only. The names are those of cpu_block.hpp and lanes.hpp, whose CPU classes act alike.
// Source: CUDA's warp intrinsics; the scan is that of Hillis and Steele 1986.
// Cost: reductions and scans take 5 shuffles for 32 lanes.
// A block's sum synchronises twice.
// Memory: shared memory for scratch, and one value a warp for a block's sum.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace wfpg::detail {

/// One value for each lane of a warp, in a register.
/// A lane sees only its own.
/// It is indexed like an array of lanes, so that one functor serves both kinds of warp.
template <class T>
struct lane_register {
  /// This lane's value.
  T value;

  /// Returns this lane's value; the index is for CPU warps and is not used.
  __device__ T& operator[](int) { return value; }
  /// Returns this lane's value, read-only.
  __device__ const T& operator[](int) const { return value; }
};

/// A hardware warp. Its 32 lanes make every call together, without divergence.
/// It has no state: any lane may make one.
class cuda_warp {
 public:
  /// Lanes.
  /// Fixed: no CUDA device has another width.
  static constexpr int width = 32;
  /// A value that differs between lanes.
  template <class T>
  using varying = lane_register<T>;

  /// Returns f(lane) to each lane.
  template <class F>
  __device__ auto map(F f) const {
    return lane_register<std::decay_t<decltype(f(0))>>{f(lane())};
  }
  /// Calls f(lane) in the lanes below n; the others wait at the next synchronisation.
  template <class F>
  __device__ void for_lanes_below(int n, F f) const {
    if (lane() < n) f(lane());
  }
  /// Calls f(i) for i in [0, n), lane i mod 32 each: neighbouring lanes read neighbouring words.
  template <class F>
  __device__ void for_each(int n, F f) const {
    for (int i = lane(); i < n; i += width) f(i);
  }
  /// Writes sums[i] = f(0) + ... + f(i), for i in [0, n). f(i) may read sums[i].
  /// 32 elements at a time, in 5 steps; the running total goes from one group to the next.
  template <class T, class F>
  __device__ void inclusive_scan(int n, T* sums, F f) const {
    T before(0);
    for (int first = 0; first < n; first += width) {
      const int i = first + lane();
      T sum = i < n ? static_cast<T>(f(i)) : T(0);
      // Each step adds the sum of as many lanes before it as it has already added.
      for (int distance = 1; distance < width; distance *= 2) {
        const T other = __shfl_up_sync(all, sum, static_cast<unsigned>(distance));
        if (lane() >= distance) sum += other;
      }
      // Lanes beyond n added 0 and write nothing.
      if (i < n) sums[i] = before + sum;
      // The last lane holds the sum of this group.
      before += __shfl_sync(all, sum, width - 1);
    }
  }

  /// Returns the warp's index in its block.
  /// It lies in [0, warps per block).
  __device__ int index() const { return static_cast<int>(threadIdx.x) / width; }
  /// Waits for all lanes, and makes their writes visible to each other.
  /// Threads of a warp need not run in lockstep since Volta, so that this is required.
  __device__ void sync() const { __syncwarp(); }

  /// Returns a word whose bit l is lane l's value.
  /// Of all lanes, also those that a for_lanes_below() before it left out.
  __device__ std::uint32_t ballot(const lane_register<bool>& value) const {
    return __ballot_sync(all, value.value);
  }
  /// Returns to all lanes the value of lane `source`, 0 <= source < 32.
  template <class T>
  __device__ T shuffle(const lane_register<T>& value, int source) const {
    return __shfl_sync(all, value.value, source);
  }
  /// Returns to each lane the value of the lane that it names.
  template <class T>
  __device__ lane_register<T> shuffle(const lane_register<T>& value, const lane_register<int>& source) const {
    return {__shfl_sync(all, value.value, source.value)};
  }
  /// Returns op over all lanes to each of them. op must be associative and commutative.
  /// Merges by halves, as CPU warps do: floats give equal bits.
  template <class T, class Op>
  __device__ T reduce(const lane_register<T>& value, Op op) const {
    T partial = value.value;
    for (int half = width / 2; half > 0; half /= 2)
      // The upper lanes' results are not used: lane 0 ends up with all.
      partial = op(partial, __shfl_down_sync(all, partial, static_cast<unsigned>(half)));
    return __shfl_sync(all, partial, 0);
  }
  /// Returns the lowest lane whose value is true, or 32 where none is.
  /// All lanes get one answer.
  __device__ int find_first(const lane_register<bool>& value) const {
    // __ffs counts from 1, and gives 0 for none.
    const int first = __ffs(static_cast<int>(ballot(value)));
    return first ? first - 1 : width;
  }

 private:
  /// Mask of the intrinsics: every lane takes part.
  static constexpr unsigned all = 0xffffffffu;

  /// Returns this thread's lane.
  /// Blocks are one-dimensional.
  __device__ static int lane() { return static_cast<int>(threadIdx.x) % width; }
};

/// A warp's 32 indices, one a lane.
/// Lanes at or beyond `end` have none.
/// Its for_each() calls f at most once: the loop over indices is the grid.
class cuda_run {
 public:
  /// A value of each index, kept in a register between steps.
  template <class T>
  using varying = lane_register<T>;

  /// `index`: that of this thread.
  /// `end`: the length of the loop.
  __device__ cuda_run(std::size_t index, std::size_t end) : index_(index), is_within_(index < end) {}

  /// Returns the warp's first index, a multiple of 32.
  /// It is 0 for one warp of the loop.
  __device__ std::size_t first() const { return index_ - index_ % cuda_warp::width; }
  /// Calls f(index, 0) in each lane that has an index.
  template <class F>
  __device__ void for_each(const F& f) const {
    if (is_within_) f(index_, 0);
  }
  /// Returns the sum of f(index, 0) over the run to all lanes.
  template <class F>
  __device__ auto sum(const F& f) const {
    using value = std::decay_t<decltype(f(index_, 0))>;
    // Lanes without an index add 0, since all lanes must take part.
    const lane_register<value> own{is_within_ ? f(index_, 0) : value(0)};
    return cuda_warp().reduce(own, [](value a, value b) { return a + b; });
  }
  /// Calls f() in lane 0, whether it has an index or not.
  template <class F>
  __device__ void once(const F& f) const {
    cuda_warp().for_lanes_below(1, [&](int) { f(); });
  }

 private:
  std::size_t index_;
  bool is_within_;
};

/// A thread block of `Warps` warps.
/// All threads make every call together.
/// For the shared memory's size, see exec::cuda::for_each_block().
/// Kernels run one block many times, with a fresh object each time.
template <int Warps>
class cuda_block {
 public:
  /// The warp that for_each_warp() passes to f.
  using warp = cuda_warp;
  /// Warps of the block.
  static constexpr int warps = Warps;
  /// Threads of the block, which the launch must match.
  static constexpr int threads = Warps * warp::width;

  /// `scratch`: the block's dynamic shared memory, aligned to 16 bytes.
  __device__ cuda_block(std::byte* scratch, std::size_t) : scratch_(scratch) {}

  /// Calls f(i) for i in [0, n), one thread each in turn.
  template <class F>
  __device__ void for_each(int n, F f) const {
    for (int i = static_cast<int>(threadIdx.x); i < n; i += threads) f(i);
  }
  /// Calls f(warp, i) for i in [0, n), one warp each in turn.
  template <class F>
  __device__ void for_each_warp(int n, F f) const {
    const warp own;
    for (int i = own.index(); i < n; i += Warps) f(own, i);
  }
  /// Waits for all threads of the block.
  /// All of them must reach it: no call inside of a branch that some threads skip.
  __device__ void sync() const { __syncthreads(); }

  /// Returns n uninitialised elements of shared memory.
  /// Requests are rounded up to 16 bytes and not checked.
  template <class T>
  __device__ T* scratch(std::size_t n) {
    // Each thread counts alike, so that all get one address.
    std::byte* result = scratch_ + used_;
    used_ += (n * sizeof(T) + 15) / 16 * 16;
    return reinterpret_cast<T*>(result);
  }

  /// Returns the sum of f(i) for i in [0, n) to all threads.
  /// Adds up by threads, by warps, then over the warps in order: equal bits on every run.
  template <class F>
  __device__ auto sum(int n, F f) const {
    using value = std::decay_t<decltype(f(0))>;
    // Static shared memory beside the dynamic scratch.
    __shared__ value of_warps[Warps];
    // Each thread adds up every 512th value, for 16 warps.
    lane_register<value> partial{value(0)};
    for_each(n, [&](int i) { partial.value += f(i); });
    const warp own;
    // Five shuffles, without shared memory.
    const value sum_of_warp = own.reduce(partial, [](value a, value b) { return a + b; });
    __syncthreads();  // an earlier sum may still be read
    of_warps[own.index()] = sum_of_warp;
    __syncthreads();
    value total(0);
    // Every thread adds up all warps, which is cheaper than another exchange.
    for (int w = 0; w < Warps; ++w) total += of_warps[w];
    return total;
  }

 private:
  std::byte* scratch_;
  std::size_t used_ = 0;
};

}  // namespace wfpg::detail
