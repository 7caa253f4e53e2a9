// A block of the CUDA policy and its warps: a thread block with shared memory, and hardware warps, under the
// names of detail/cpu_block.hpp and detail/lanes.hpp. Device code only.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace wfpg::detail {

/// A value of each lane: a register, of which a lane sees its own.
template <class T>
struct lane_register {
  T value;

  __device__ T& operator[](int) { return value; }
  __device__ const T& operator[](int) const { return value; }
};

/// 32 lanes, all of which call together.
class cuda_warp {
 public:
  static constexpr int width = 32;
  template <class T>
  using varying = lane_register<T>;

  template <class F>
  __device__ auto map(F f) const {
    return lane_register<std::decay_t<decltype(f(0))>>{f(lane())};
  }
  template <class F>
  __device__ void for_lanes_below(int n, F f) const {
    if (lane() < n) f(lane());
  }
  template <class F>
  __device__ void for_each(int n, F f) const {
    for (int i = lane(); i < n; i += width) f(i);
  }
  template <class T, class F>
  __device__ void inclusive_scan(int n, T* sums, F f) const {
    T before(0);
    for (int first = 0; first < n; first += width) {
      const int i = first + lane();
      T sum = i < n ? static_cast<T>(f(i)) : T(0);
      for (int distance = 1; distance < width; distance *= 2) {
        const T other = __shfl_up_sync(all, sum, static_cast<unsigned>(distance));
        if (lane() >= distance) sum += other;
      }
      if (i < n) sums[i] = before + sum;
      before += __shfl_sync(all, sum, width - 1);
    }
  }

  __device__ int index() const { return static_cast<int>(threadIdx.x) / width; }
  __device__ void sync() const { __syncwarp(); }

  __device__ std::uint32_t ballot(const lane_register<bool>& value) const {
    return __ballot_sync(all, value.value);
  }
  template <class T>
  __device__ T shuffle(const lane_register<T>& value, int source) const {
    return __shfl_sync(all, value.value, source);
  }
  template <class T>
  __device__ lane_register<T> shuffle(const lane_register<T>& value, const lane_register<int>& source) const {
    return {__shfl_sync(all, value.value, source.value)};
  }
  template <class T, class Op>
  __device__ T reduce(const lane_register<T>& value, Op op) const {
    T partial = value.value;
    for (int half = width / 2; half > 0; half /= 2)
      partial = op(partial, __shfl_down_sync(all, partial, static_cast<unsigned>(half)));
    return __shfl_sync(all, partial, 0);
  }
  __device__ int find_first(const lane_register<bool>& value) const {
    const int first = __ffs(static_cast<int>(ballot(value)));
    return first ? first - 1 : width;
  }

 private:
  static constexpr unsigned all = 0xffffffffu;

  __device__ static int lane() { return static_cast<int>(threadIdx.x) % width; }
};

/// A warp's indices, one for each lane, those below `end`.
class cuda_run {
 public:
  template <class T>
  using varying = lane_register<T>;

  __device__ cuda_run(std::size_t index, std::size_t end) : index_(index), is_within_(index < end) {}

  __device__ std::size_t first() const { return index_ - index_ % cuda_warp::width; }
  template <class F>
  __device__ void for_each(const F& f) const {
    if (is_within_) f(index_, 0);
  }
  template <class F>
  __device__ auto sum(const F& f) const {
    using value = std::decay_t<decltype(f(index_, 0))>;
    const lane_register<value> own{is_within_ ? f(index_, 0) : value(0)};
    return cuda_warp().reduce(own, [](value a, value b) { return a + b; });
  }
  template <class F>
  __device__ void once(const F& f) const {
    cuda_warp().for_lanes_below(1, [&](int) { f(); });
  }

 private:
  std::size_t index_;
  bool is_within_;
};

/// A thread block of `warps` warps.
template <int Warps>
class cuda_block {
 public:
  using warp = cuda_warp;
  static constexpr int warps = Warps;
  static constexpr int threads = Warps * warp::width;

  __device__ cuda_block(std::byte* scratch, std::size_t) : scratch_(scratch) {}

  template <class F>
  __device__ void for_each(int n, F f) const {
    for (int i = static_cast<int>(threadIdx.x); i < n; i += threads) f(i);
  }
  template <class F>
  __device__ void for_each_warp(int n, F f) const {
    const warp own;
    for (int i = own.index(); i < n; i += Warps) f(own, i);
  }
  __device__ void sync() const { __syncthreads(); }

  template <class T>
  __device__ T* scratch(std::size_t n) {
    std::byte* result = scratch_ + used_;
    used_ += (n * sizeof(T) + 15) / 16 * 16;
    return reinterpret_cast<T*>(result);
  }

  /// By threads, warps and the warps' sums in order: the same on every run.
  template <class F>
  __device__ auto sum(int n, F f) const {
    using value = std::decay_t<decltype(f(0))>;
    __shared__ value of_warps[Warps];
    lane_register<value> partial{value(0)};
    for_each(n, [&](int i) { partial.value += f(i); });
    const warp own;
    const value sum_of_warp = own.reduce(partial, [](value a, value b) { return a + b; });
    __syncthreads();  // an earlier sum may still be read
    of_warps[own.index()] = sum_of_warp;
    __syncthreads();
    value total(0);
    for (int w = 0; w < Warps; ++w) total += of_warps[w];
    return total;
  }

 private:
  std::byte* scratch_;
  std::size_t used_ = 0;
};

}  // namespace wfpg::detail
