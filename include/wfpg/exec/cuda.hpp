// The CUDA policy: every call is ordered on one stream.
// Include it in files that nvcc compiles.
// No call waits for the device, but copies to the host and trim().
// The host therefore runs ahead of the device.
// Errors of kernels come with a later call.
// Sorts are CUB's radix sorts; scans and reductions are Thrust's.
//
// Errors are those of exec/cuda_error.hpp, which this header includes.
// Memory comes from a pool of the policy's own, unless a caller brings a resource.
// Values that ranks exchange through the host pass through page-locked memory.
//
// Cost: one kernel launch a loop, and two or more for a sort.
// Loops over blocks launch at most 16 blocks a multiprocessor, which stride over the indices.
// Memory: a pool of device memory that keeps what is freed, and a sort's temporary storage.
#pragma once

#if !defined(__CUDACC__)
#error "wfpg/exec/cuda.hpp needs a CUDA compiler: include it in .cu files"
#endif

#include <wfpg/base/error.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/cuda_error.hpp>
#include <wfpg/exec/detail/cuda_memory.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/exec/support/cuda_block.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/exec/support/waits_for_memory.hpp>

#include <cub/device/device_radix_sort.cuh>
#include <cuda_runtime_api.h>
#include <thrust/system/cuda/execution_policy.h>

#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>

namespace wfpg {

namespace detail {

/// Returns the number of iterations of a loop whose length the host knows.
inline __device__ std::size_t count_of(std::size_t n) {
  return n;
}
/// Returns the number of iterations that an earlier kernel wrote to device memory.
inline __device__ std::size_t count_of(exec::device_count n) {
  return n.get();
}

/// Threads of a block of loops over indices.
/// Few, so that a block whose last ray takes long holds few others up.
constexpr unsigned index_threads = 128;

/// Calls f(i) for each index below n.
/// Strides by the grid's size, so that any grid does all of the work.
template <class Count, class F>
__device__ void call_for_each(Count n, const F& f) {
  const std::size_t count = count_of(n), stride = std::size_t(gridDim.x) * blockDim.x;
  for (std::size_t i = std::size_t(blockIdx.x) * blockDim.x + threadIdx.x; i < count; i += stride) f(i);
}
/// Kernel of a loop over indices. Its registers are not bounded.
/// Even a bound of one block makes nvcc choose otherwise, and tracing take a tenth longer.
template <class Count, class F>
__global__ void for_each_kernel(Count n, F f) {
  call_for_each(n, f);
}
/// Kernel of a loop that waits for memory.
/// A multiprocessor holds 8 blocks at least, so a thread has 64 registers.
/// Measured by merges of photons and beams: 10 blocks take 1.0 to 1.1 times as long, 5 take 1.0 to 1.4 times.
template <class Count, class F>
__global__ void __launch_bounds__(index_threads, 8) for_each_waiting_kernel(Count n, F f) {
  call_for_each(n, f);
}
/// Returns the kernel of a loop that calls an F.
template <class Count, class F>
auto index_kernel() {
  if constexpr (waits_for_memory<F>::value)
    return for_each_waiting_kernel<Count, F>;
  else
    return for_each_kernel<Count, F>;
}

/// Gives each warp the run of its 32 threads' indices.
/// The grid covers [0, n).
template <class F>
__global__ void for_each_run_kernel(std::size_t n, F f) {
  f(cuda_run(std::size_t(blockIdx.x) * blockDim.x + threadIdx.x, n));
}

/// Blocks of 512 threads that a multiprocessor holds at least: bounds a kernel's registers.
/// Two, which leaves a block up to half of the shared memory.
/// A functor that waits for memory gets as many as the smallest multiprocessor holds: 3 from sm_80 on.
template <class F>
struct resident_blocks {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  static constexpr int value = 2;
#else
  static constexpr int value = waits_for_memory<F>::value ? 3 : 2;
#endif
};

/// Calls f(block, i) for each i below n.
/// The grid's blocks stride, and reuse their scratch memory.
/// `scratch_bytes`: the dynamic shared memory of the launch.
template <class Block, class Count, class F>
__global__ void __launch_bounds__(Block::threads, resident_blocks<F>::value)
    for_each_block_kernel(Count n, std::size_t scratch_bytes, F f) {
  // All kernels share this array; a block's scratch() gives parts of it out.
  extern __shared__ __align__(16) unsigned char block_scratch[];
  const std::size_t count = count_of(n);
  for (std::size_t i = blockIdx.x; i < count; i += gridDim.x) {
    // A new team for each i: its scratch memory is empty again.
    Block team(reinterpret_cast<std::byte*>(block_scratch), scratch_bytes);
    f(team, i);
    __syncthreads();  // before the next block writes to scratch memory
  }
}

}  // namespace detail

namespace exec {

/// The CUDA policy on a stream.
/// Copies share the stream and the memory.
/// The stream's device must be current in all calls.
/// Policies on several streams may work at once.
class cuda {
 public:
  /// Name in reports.
  static constexpr const char* name = "cuda";
  /// Lanes of a warp, on all of CUDA's devices.
  static constexpr int warp_width = 32;
  /// Warps of a block: 512 threads.
  /// A fixed number, so that kernels are compiled for one size of block.
  static constexpr int warps_per_block = 16;
  /// The thread block that for_each_block() passes to f.
  using block = wfpg::detail::cuda_block<warps_per_block>;

  /// `resource` hands out device memory, ordered on the stream, and outlives what is allocated.
  /// Null: the policy makes a pool on the current device.
  /// Copies of the policy share that pool; it lives as long as they and their buffers do.
  /// The stream must live as long, since the last of them waits for it.
  /// Throws cuda_error, also where there is no device.
  /// A null `stream` is the default stream of the compilation.
  explicit cuda(cudaStream_t stream = nullptr, memory_resource* resource = nullptr)
      : stream_(stream),
        pool_(resource ? nullptr : std::make_shared<wfpg::detail::stream_resource>(stream)),
        resource_(resource ? resource : pool_.get()) {}

  /// Returns the source of device memory, which a buffer keeps.
  /// Never null.
  memory_resource* resource() const { return resource_; }
  /// Returns a policy on this stream that allocates from `resource`.
  /// Null: it makes a new pool.
  /// Buffers made by this policy keep their own resource.
  cuda with_resource(memory_resource* resource) const { return cuda(stream_, resource); }
  /// Returns the source of page-locked host memory, for values that ranks send: copies need no stop there.
  /// Never null; safe for concurrent calls; lives as long as the process.
  /// Each allocation takes a call of the driver.
  static memory_resource* staging_memory() {
    // Never destroyed: communicators of static storage may end later.
    static memory_resource* const resource = new wfpg::detail::page_locked_resource;
    return resource;
  }
  /// Waits for the work before it, and gives the pool's unused memory back to the device.
  /// Does nothing where the memory comes from a caller's resource.
  /// Throws cuda_error.
  void trim() const {
    if (pool_) pool_->trim();
  }
  /// Returns the stream that all calls are ordered on.
  cudaStream_t stream() const { return stream_; }

  /// Returns Thrust's CUDA policy on the stream, whose temporaries come from resource().
  /// Its algorithms do not wait, except those that return a value to the host.
  auto thrust() const {
    return ::thrust::cuda::par_nosync(wfpg::resource_allocator<char>(resource_)).on(stream_);
  }

  /// Copies `bytes` bytes of device memory to the host, and waits for them and all work before.
  /// Nothing is copied where `bytes` is 0, but the call still waits.
  void copy_to_host(void* to, const void* from, std::size_t bytes) const {
    // Copies from device to pageable memory end before they return; others are waited for.
    copy(to, from, bytes, cudaMemcpyDeviceToHost);
    wfpg::check_cuda(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
  }
  /// Copies `bytes` bytes to the device, in the stream's order.
  /// Pinned host memory must stay unchanged until the copy is done.
  /// Pageable memory is staged by the driver.
  void copy_from_host(void* to, const void* from, std::size_t bytes) const {
    copy(to, from, bytes, cudaMemcpyHostToDevice);
  }

  /// Sets each of `bytes` bytes of device memory to `value`, in the stream's order.
  /// It returns at once. Throws cuda_error where the runtime refuses the call.
  void fill_bytes(void* to, unsigned char value, std::size_t bytes) const {
    if (bytes) wfpg::check_cuda(cudaMemsetAsync(to, value, bytes, stream_), "cudaMemsetAsync");
  }

  /// Sorts n pairs stably by the low `bits` bits of their unsigned keys.
  /// Inputs stay as they are.
  /// Temporary storage comes from resource().
  /// Throws cuda_error or out_of_memory.
  template <class Key, class Value>
  void sort_pairs(std::size_t n, int bits, const Key* keys, const Value* values, Key* sorted_keys,
                  Value* sorted_values) const {
    // CUB's protocol: the first call, without storage, only says how much it needs.
    std::size_t bytes = 0;
    const auto sort = [&](void* storage) {
      wfpg::check_cuda(cub::DeviceRadixSort::SortPairs(storage, bytes, keys, sorted_keys, values,
                                                       sorted_values, n, 0, bits, stream_),
                       "cub::DeviceRadixSort::SortPairs");
    };
    // Neither a launch nor a request of memory for an empty sort.
    if (n == 0) return;
    sort(nullptr);
    const buffer<std::byte, cuda> storage(*this, bytes);
    sort(storage.data());
  }

  /// Calls f(i) for each i in [0, n), one thread each, in no order.
  /// Throws cuda_error where the launch fails, as all loops do.
  template <class F>
  void for_each(std::size_t n, const F& f) const {
    if (n == 0) return;
    const std::size_t blocks = (n + threads - 1) / threads;
    launch(wfpg::detail::index_kernel<std::size_t, F>(), blocks, threads, 0, n, f);
  }
  /// Calls f(i) for a number of indices that only the device knows.
  /// The host does not wait for it.
  /// Launches threads for `n.capacity`, but at most 16 blocks a multiprocessor.
  template <class F>
  void for_each(device_count n, const F& f) const {
    if (n.capacity == 0) return;
    const std::size_t blocks = (n.capacity + threads - 1) / threads;
    launch(wfpg::detail::index_kernel<device_count, F>(), at_most_resident(blocks), threads, 0, n, f);
  }

  /// Calls f(run) for runs that make up [0, n), a warp each, in no order; also where n is 0.
  template <class F>
  void for_each_run(std::size_t n, const F& f) const {
    // One block at least, so that once() is called where n is 0.
    const std::size_t blocks = n > 0 ? (n + threads - 1) / threads : 1;
    // Each thread has one index here: a run does not stride.
    launch(wfpg::detail::for_each_run_kernel<F>, blocks, threads, 0, n, f);
  }

  /// Calls f(block, i) for each i in [0, n), by blocks with `scratch_bytes` of shared memory each.
  /// Throws std::invalid_argument where the device has less shared memory.
  template <class F>
  void for_each_block(std::size_t n, std::size_t scratch_bytes, const F& f) const {
    if (n > 0) launch_blocks(n, n, scratch_bytes, f);
  }
  /// Calls f(block, i) for a number of blocks that only the device knows.
  template <class F>
  void for_each_block(device_count n, std::size_t scratch_bytes, const F& f) const {
    if (n.capacity > 0) launch_blocks(n, n.capacity, scratch_bytes, f);
  }

 private:
  static constexpr unsigned threads = wfpg::detail::index_threads;

  /// Enqueues a copy; nothing where `bytes` is 0.
  void copy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind) const {
    if (bytes) wfpg::check_cuda(cudaMemcpyAsync(to, from, bytes, kind, stream_), "cudaMemcpyAsync");
  }

  /// Returns an attribute of the current device.
  /// Not cached: a launch asks for it at most twice.
  static std::size_t device_attribute(cudaDeviceAttr attribute) {
    int device = 0, value = 0;
    wfpg::check_cuda(cudaGetDevice(&device), "cudaGetDevice");
    wfpg::check_cuda(cudaDeviceGetAttribute(&value, attribute, device), "cudaDeviceGetAttribute");
    return static_cast<std::size_t>(value);
  }

  /// Returns `blocks`, or 16 blocks a multiprocessor where that is less: more than run at once.
  static std::size_t at_most_resident(std::size_t blocks) {
    // A multiprocessor holds at most 16 blocks of 128 threads, or 4 of 512.
    const std::size_t most = 16 * device_attribute(cudaDevAttrMultiProcessorCount);
    return blocks < most ? blocks : most;
  }

  /// Launches a loop over blocks, after asking for shared memory where it needs more than 32 KiB.
  template <class Count, class F>
  void launch_blocks(Count n, std::size_t most, std::size_t scratch_bytes, const F& f) const {
    void (*const kernel)(Count, std::size_t, F) = wfpg::detail::for_each_block_kernel<block, Count, F>;
    constexpr std::size_t without_asking = 32 * 1024;  // of 48 KiB, in which static arrays lie too
    // Asking costs two calls of the runtime a launch, which small blocks need not pay.
    if (scratch_bytes > without_asking)
      allow_shared_memory(reinterpret_cast<const void*>(kernel), scratch_bytes);
    launch(kernel, at_most_resident(most), block::threads, scratch_bytes, n, scratch_bytes, f);
  }

  /// Raises the limit of a kernel's dynamic shared memory to `bytes`.
  /// Throws std::invalid_argument where the device has less, static arrays subtracted.
  static void allow_shared_memory(const void* kernel, std::size_t bytes) {
    using wfpg::check_cuda;
    // The device's limit counts static arrays too, such as those of a block's sum.
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

  /// Launches a kernel on the stream.
  /// Throws cuda_error.
  template <class... Parameters, class... Arguments>
  void launch(void (*kernel)(Parameters...), std::size_t blocks, unsigned threads_of_block,
              std::size_t shared_bytes, const Arguments&... arguments) const {
    // Arguments are converted to the kernel's parameter types before the launch copies them.
    kernel<<<static_cast<unsigned>(blocks), threads_of_block, shared_bytes, stream_>>>(
        Parameters(arguments)...);
    // Finds faults of the launch. Faults inside the kernel come with a later call.
    wfpg::check_cuda(cudaGetLastError(), "kernel launch");
  }

  /// Not owned.
  cudaStream_t stream_;
  // Null where the memory is a caller's.
  std::shared_ptr<wfpg::detail::stream_resource> pool_;
  /// The pool, or the caller's resource.
  memory_resource* resource_;
};

}  // namespace exec
}  // namespace wfpg
