// The CUDA policy: every call is ordered on one stream, none waits but copies to the host. Needs nvcc.
#pragma once

#if !defined(__CUDACC__)
#error "wfpg/exec/cuda.hpp needs a CUDA compiler: include it in .cu files"
#endif

#include <wfpg/base/error.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/exec/support/cuda_block.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <cub/device/device_radix_sort.cuh>
#include <cuda_runtime_api.h>
#include <thrust/system/cuda/execution_policy.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <new>
#include <type_traits>
#include <utility>

namespace wfpg {

/// A call of the CUDA runtime failed; an error that an earlier kernel of the host left behind is reported by
/// the first call after it. Where that is one of Thrust's, it comes as a thrust::system_error: both are
/// std::runtime_error.
class cuda_error : public device_error {
 public:
  /// The name of the call, and what it returned.
  cuda_error(const char* call, cudaError_t code)
      : device_error(static_cast<int>(code), cudaGetErrorString(code), call) {}
  /// What the call returned.
  cudaError_t code() const noexcept { return static_cast<cudaError_t>(device_error::code()); }
};

/// Throws cuda_error where `code` is one, which the next call is then not to find.
inline void check_cuda(cudaError_t code, const char* call) {
  if (code == cudaSuccess) return;
  cudaGetLastError();
  throw cuda_error(call, code);
}

namespace detail {

/// Device memory from a pool of its own on the current device, ordered on a stream. The pool keeps what is
/// given back, since the driver takes milliseconds for new memory. Blocks that are in use keep the resource
/// alive. Safe for concurrent calls.
class stream_resource : public memory_resource, public std::enable_shared_from_this<stream_resource> {
 public:
  /// Shared from the start: see std::make_shared.
  explicit stream_resource(cudaStream_t stream) : stream_(stream) {
    cudaMemPoolProps properties{};
    properties.allocType = cudaMemAllocationTypePinned;
    properties.location.type = cudaMemLocationTypeDevice;
    check_cuda(cudaGetDevice(&properties.location.id), "cudaGetDevice");
    check_cuda(cudaMemPoolCreate(&pool_, &properties), "cudaMemPoolCreate");
    std::uint64_t kept = ~std::uint64_t(0);
    const cudaError_t code = cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &kept);
    if (code != cudaSuccess) cudaMemPoolDestroy(pool_);
    check_cuda(code, "cudaMemPoolSetAttribute");
  }
  stream_resource(const stream_resource&) = delete;
  stream_resource& operator=(const stream_resource&) = delete;
  /// Waits for the stream: drivers have crashed where a pool ended before the memory that the stream was
  /// still to give back to it.
  ~stream_resource() override {
    cudaStreamSynchronize(stream_);
    cudaMemPoolDestroy(pool_);
  }

  /// Waits for the stream, and gives what is not in use back to the device.
  void trim() {
    check_cuda(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    check_cuda(cudaMemPoolTrimTo(pool_, 0), "cudaMemPoolTrimTo");
  }

 private:
  void* do_allocate(std::size_t bytes, std::size_t) override {
    void* block = nullptr;
    const cudaError_t code = cudaMallocFromPoolAsync(&block, bytes, pool_, stream_);
    if (code == cudaErrorMemoryAllocation) {
      cudaGetLastError();
      throw std::bad_alloc();
    }
    check_cuda(code, "cudaMallocFromPoolAsync");
    const std::lock_guard<std::mutex> lock(guard_);
    if (blocks_++ == 0) self_ = shared_from_this();
    return block;
  }
  void do_deallocate(void* block, std::size_t, std::size_t) override {
    cudaFreeAsync(block, stream_);
    std::shared_ptr<stream_resource> last;  // which ends after the lock
    const std::lock_guard<std::mutex> lock(guard_);
    if (--blocks_ == 0) last.swap(self_);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  cudaStream_t stream_;
  cudaMemPool_t pool_ = nullptr;
  std::mutex guard_;
  std::size_t blocks_ = 0;                 // in use
  std::shared_ptr<stream_resource> self_;  // while there are any
};

inline __device__ std::size_t count_of(std::size_t n) {
  return n;
}
inline __device__ std::size_t count_of(exec::device_count n) {
  return n.get();
}

template <class Count, class F>
__global__ void for_each_kernel(Count n, F f) {
  const std::size_t count = count_of(n), stride = std::size_t(gridDim.x) * blockDim.x;
  for (std::size_t i = std::size_t(blockIdx.x) * blockDim.x + threadIdx.x; i < count; i += stride) f(i);
}

template <class F>
__global__ void for_each_run_kernel(std::size_t n, F f) {
  f(cuda_run(std::size_t(blockIdx.x) * blockDim.x + threadIdx.x, n));
}

/// Of 512 threads, the least that registers are to allow a multiprocessor, of the smallest there are. Two, so
/// that shared memory may be large; all where F says that it `waits_for_memory`.
template <class F, class = void>
struct resident_blocks {
  static constexpr int value = 2;
};
template <class F>
struct resident_blocks<F, std::enable_if_t<F::waits_for_memory>> {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  static constexpr int value = 2;
#else
  static constexpr int value = 3;
#endif
};

template <class Block, class Count, class F>
__global__ void __launch_bounds__(Block::threads, resident_blocks<F>::value)
    for_each_block_kernel(Count n, std::size_t scratch_bytes, F f) {
  extern __shared__ __align__(16) unsigned char block_scratch[];
  const std::size_t count = count_of(n);
  for (std::size_t i = blockIdx.x; i < count; i += gridDim.x) {
    Block team(reinterpret_cast<std::byte*>(block_scratch), scratch_bytes);
    f(team, i);
    __syncthreads();  // before the next block writes to scratch memory
  }
}

}  // namespace detail

namespace exec {

/// The CUDA policy on a stream. Copies of one share the stream and the memory.
class cuda {
 public:
  /// What reports call it.
  static constexpr const char* name = "cuda";
  /// Lanes of a warp.
  static constexpr int warp_width = 32;
  /// Warps of a block.
  static constexpr int warps_per_block = 16;
  /// What for_each_block() calls with.
  using block = wfpg::detail::cuda_block<warps_per_block>;

  /// `resource` hands out device memory, ordered on the stream, and outlives what is allocated. Null: the
  /// policy makes a pool on the current device, which its copies share and which lives as long as they and
  /// their buffers do, as the stream must; the last of them waits for it. Throws cuda_error, where there is
  /// no device to begin with.
  explicit cuda(cudaStream_t stream = nullptr, memory_resource* resource = nullptr)
      : stream_(stream),
        pool_(resource ? nullptr : std::make_shared<wfpg::detail::stream_resource>(stream)),
        resource_(resource ? resource : pool_.get()) {}

  /// Where device memory comes from.
  memory_resource* resource() const { return resource_; }
  /// A policy on this stream with memory from elsewhere. Null: a new pool.
  cuda with_resource(memory_resource* resource) const { return cuda(stream_, resource); }
  /// Waits for the work before it, and gives memory that the policy's pool keeps for later back to the
  /// device. Does nothing where the memory is a caller's. Throws cuda_error.
  void trim() const {
    if (pool_) pool_->trim();
  }
  /// What all calls are ordered on.
  cudaStream_t stream() const { return stream_; }

  /// Thrust's CUDA policy on the stream, which does not wait, with temporaries from resource().
  auto thrust() const {
    return ::thrust::cuda::par_nosync(wfpg::resource_allocator<char>(resource_)).on(stream_);
  }

  /// Waits for the work before it.
  void copy_to_host(void* to, const void* from, std::size_t bytes) const {
    copy(to, from, bytes, cudaMemcpyDeviceToHost);
    wfpg::check_cuda(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
  }
  /// Pinned memory on the host has to outlive the copy.
  void copy_from_host(void* to, const void* from, std::size_t bytes) const {
    copy(to, from, bytes, cudaMemcpyHostToDevice);
  }

  /// Sets each byte of device memory.
  void fill_bytes(void* to, unsigned char value, std::size_t bytes) const {
    if (bytes) wfpg::check_cuda(cudaMemsetAsync(to, value, bytes, stream_), "cudaMemsetAsync");
  }

  /// Sorts n pairs stably by the low bits of their keys.
  template <class Key, class Value>
  void sort_pairs(std::size_t n, int bits, const Key* keys, const Value* values, Key* sorted_keys,
                  Value* sorted_values) const {
    std::size_t bytes = 0;
    const auto sort = [&](void* storage) {
      wfpg::check_cuda(cub::DeviceRadixSort::SortPairs(storage, bytes, keys, sorted_keys, values,
                                                       sorted_values, n, 0, bits, stream_),
                       "cub::DeviceRadixSort::SortPairs");
    };
    if (n == 0) return;
    sort(nullptr);
    const buffer<std::byte, cuda> storage(*this, bytes);
    sort(storage.data());
  }

  /// f(i) for each i in [0, n), in no order. Throws cuda_error where the launch fails, as the others do.
  template <class F>
  void for_each(std::size_t n, const F& f) const {
    if (n == 0) return;
    const std::size_t blocks = (n + threads - 1) / threads;
    launch(wfpg::detail::for_each_kernel<std::size_t, F>, blocks, threads, 0, n, f);
  }
  /// The same of a number that only the device knows.
  template <class F>
  void for_each(device_count n, const F& f) const {
    if (n.capacity == 0) return;
    const std::size_t blocks = (n.capacity + threads - 1) / threads;
    launch(wfpg::detail::for_each_kernel<device_count, F>, at_most_resident(blocks), threads, 0, n, f);
  }

  /// f(run) for runs of indices that make up [0, n), in no order; also where n is 0.
  template <class F>
  void for_each_run(std::size_t n, const F& f) const {
    const std::size_t blocks = n > 0 ? (n + threads - 1) / threads : 1;
    launch(wfpg::detail::for_each_run_kernel<F>, blocks, threads, 0, n, f);
  }

  /// f(block, i) for each i in [0, n), by blocks with `scratch_bytes` of shared memory each. Throws
  /// std::invalid_argument where the device has less.
  template <class F>
  void for_each_block(std::size_t n, std::size_t scratch_bytes, const F& f) const {
    if (n > 0) launch_blocks(n, n, scratch_bytes, f);
  }
  /// The same of a number that only the device knows.
  template <class F>
  void for_each_block(device_count n, std::size_t scratch_bytes, const F& f) const {
    if (n.capacity > 0) launch_blocks(n, n.capacity, scratch_bytes, f);
  }

 private:
  // Of a loop over indices: few, so that a block whose last ray takes long holds few others up.
  static constexpr unsigned threads = 128;

  void copy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind) const {
    if (bytes) wfpg::check_cuda(cudaMemcpyAsync(to, from, bytes, kind, stream_), "cudaMemcpyAsync");
  }

  /// Of the current device.
  static std::size_t device_attribute(cudaDeviceAttr attribute) {
    int device = 0, value = 0;
    wfpg::check_cuda(cudaGetDevice(&device), "cudaGetDevice");
    wfpg::check_cuda(cudaDeviceGetAttribute(&value, attribute, device), "cudaDeviceGetAttribute");
    return static_cast<std::size_t>(value);
  }

  /// So many blocks, or more than the device runs at once.
  static std::size_t at_most_resident(std::size_t blocks) {
    const std::size_t most = 16 * device_attribute(cudaDevAttrMultiProcessorCount);
    return blocks < most ? blocks : most;
  }

  template <class Count, class F>
  void launch_blocks(Count n, std::size_t most, std::size_t scratch_bytes, const F& f) const {
    void (*const kernel)(Count, std::size_t, F) = wfpg::detail::for_each_block_kernel<block, Count, F>;
    constexpr std::size_t without_asking = 32 * 1024;  // of 48 KiB, in which static arrays lie too
    if (scratch_bytes > without_asking)
      allow_shared_memory(reinterpret_cast<const void*>(kernel), scratch_bytes);
    launch(kernel, at_most_resident(most), block::threads, scratch_bytes, n, scratch_bytes, f);
  }

  /// Asks for more shared memory than a kernel has without. Throws std::invalid_argument where the device has
  /// less.
  static void allow_shared_memory(const void* kernel, std::size_t bytes) {
    using wfpg::check_cuda;
    cudaFuncAttributes attributes{};
    check_cuda(cudaFuncGetAttributes(&attributes, kernel), "cudaFuncGetAttributes");
    const std::size_t left =
        device_attribute(cudaDevAttrMaxSharedMemoryPerBlockOptin) - attributes.sharedSizeBytes;
    wfpg::require(
        bytes <= left, "shared memory of a block, bytes,", bytes,
        ("at most " + std::to_string(left) + " on this device: lower the fields' resolution").c_str());
    check_cuda(
        cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(bytes)),
        "cudaFuncSetAttribute for shared memory");
  }

  template <class... Parameters, class... Arguments>
  void launch(void (*kernel)(Parameters...), std::size_t blocks, unsigned threads_of_block,
              std::size_t shared_bytes, const Arguments&... arguments) const {
    kernel<<<static_cast<unsigned>(blocks), threads_of_block, shared_bytes, stream_>>>(
        Parameters(arguments)...);
    wfpg::check_cuda(cudaGetLastError(), "kernel launch");
  }

  cudaStream_t stream_;
  std::shared_ptr<wfpg::detail::stream_resource> pool_;  // null where the memory is a caller's
  memory_resource* resource_;
};

}  // namespace exec
}  // namespace wfpg
