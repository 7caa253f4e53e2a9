// Where the CUDA policy's memory comes from: a pool on the device, and page-locked memory of the host.
//
// Source: CUDA C++ Programming Guide, "Stream Ordered Memory Allocator" and "Page-Locked Host Memory".
// Cost: new memory of the device, and all memory of the host, takes a call of the driver.
// Memory: a pool keeps what is freed.
#pragma once

#include <wfpg/exec/cuda_error.hpp>
#include <wfpg/exec/policy.hpp>

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <new>

namespace wfpg::detail {

/// Hands out page-locked memory of the host.
/// Safe for concurrent calls.
class page_locked_resource : public memory_resource {
  /// Blocks are aligned to pages.
  void* do_allocate(std::size_t bytes, std::size_t) override {
    void* block = nullptr;
    check_cuda(cudaMallocHost(&block, bytes), "cudaMallocHost");
    return block;
  }
  /// Errors are ignored: the device's end frees its memory first.
  void do_deallocate(void* block, std::size_t, std::size_t) override { cudaFreeHost(block); }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

/// Device memory from a pool of its own on the current device, ordered on a stream.
/// The pool keeps what is freed, since the driver takes milliseconds for new memory.
/// Blocks in use keep the resource alive.
/// Safe for concurrent calls.
/// Allocation and release follow the stream's order, and do not wait for the device.
class stream_resource : public memory_resource, public std::enable_shared_from_this<stream_resource> {
 public:
  /// Creates the pool on the current device.
  /// Throws cuda_error.
  /// Objects must be owned by a std::shared_ptr, as std::make_shared makes one.
  explicit stream_resource(cudaStream_t stream) : stream_(stream) {
    // A pool of its own, so that the settings of the device's default pool stay the host's.
    cudaMemPoolProps properties{};
    properties.allocType = cudaMemAllocationTypePinned;
    properties.location.type = cudaMemLocationTypeDevice;
    check_cuda(cudaGetDevice(&properties.location.id), "cudaGetDevice");
    check_cuda(cudaMemPoolCreate(&pool_, &properties), "cudaMemPoolCreate");
    // The threshold above which the pool would give memory back at each synchronisation: never.
    std::uint64_t kept = ~std::uint64_t(0);
    const cudaError_t code = cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &kept);
    // No destructor runs where a constructor throws.
    if (code != cudaSuccess) cudaMemPoolDestroy(pool_);
    check_cuda(code, "cudaMemPoolSetAttribute");
  }
  /// Not copyable: the pool has one owner.
  stream_resource(const stream_resource&) = delete;
  stream_resource& operator=(const stream_resource&) = delete;
  /// Waits for the stream, and destroys the pool.
  /// Some drivers crash where a pool ends before the stream has given its memory back.
  ~stream_resource() override {
    // Errors are ignored, as destructors must not throw.
    cudaStreamSynchronize(stream_);
    cudaMemPoolDestroy(pool_);
  }

  /// Waits for the stream, and gives unused memory back to the device.
  /// Throws cuda_error.
  /// Blocks in use stay where they are.
  void trim() {
    check_cuda(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    check_cuda(cudaMemPoolTrimTo(pool_, 0), "cudaMemPoolTrimTo");
  }

 private:
  /// CUDA aligns blocks to 256 bytes or more, whatever was asked for.
  void* do_allocate(std::size_t bytes, std::size_t) override {
    void* block = nullptr;
    const cudaError_t code = cudaMallocFromPoolAsync(&block, bytes, pool_, stream_);
    if (code == cudaErrorMemoryAllocation) {
      // Running out of memory is no error of the device: later calls must not see it.
      cudaGetLastError();
      throw std::bad_alloc();
    }
    check_cuda(code, "cudaMallocFromPoolAsync");
    const std::lock_guard<std::mutex> lock(guard_);
    // The first block ties the resource to itself, until the last one is freed.
    if (blocks_++ == 0) self_ = shared_from_this();
    return block;
  }
  /// Enqueues the release. Kernels before it may still use the block.
  /// The pool keeps the block for later requests.
  void do_deallocate(void* block, std::size_t, std::size_t) override {
    cudaFreeAsync(block, stream_);
    // Declared before the lock, so that it ends after the lock: it may destroy this object and its mutex.
    std::shared_ptr<stream_resource> last;
    const std::lock_guard<std::mutex> lock(guard_);
    if (--blocks_ == 0) last.swap(self_);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  cudaStream_t stream_;
  cudaMemPool_t pool_ = nullptr;
  /// Protects the two members below.
  std::mutex guard_;
  std::size_t blocks_ = 0;                 // in use
  std::shared_ptr<stream_resource> self_;  // while there are any
};

}  // namespace wfpg::detail
