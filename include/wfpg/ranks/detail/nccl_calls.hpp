// Calls of NCCL and of CUDA's runtime as exceptions. Owners of a CUDA event, of memory and of a group
// of NCCL's calls. Threads that join GPUs. A keeper of the current device. Cost: one comparison a call.
// Memory: that which they own.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/ranks/communicator.hpp>
#include <wfpg/ranks/detail/same_call.hpp>

#include <cuda_runtime_api.h>
#include <nccl.h>

#include <cstdint>
#include <exception>
#include <string>
#include <thread>
#include <vector>

static_assert(NCCL_VERSION_CODE >= NCCL_VERSION(2, 18, 0), "wfpg/ranks/nccl.hpp needs NCCL 2.18 or later");

namespace wfpg::detail {

/// Throws rank_error that names the failed function of NCCL.
/// A call that is not done yet is no error.
inline void check_nccl(ncclResult_t code, const char* function) {
  if (code == ncclSuccess || code == ncclInProgress) return;
  throw rank_error(std::string(function) + " failed: " + ncclGetErrorString(code) +
                   "; NCCL_DEBUG=INFO in the environment tells more");
}

/// Throws device_error that names the failed function of CUDA's runtime.
inline void check_runtime(cudaError_t code, const char* function) {
  if (code == cudaSuccess) return;
  cudaGetLastError();  // clears it
  throw device_error(static_cast<int>(code), cudaGetErrorString(code), function);
}

/// A group of NCCL's calls, which begin together at its end.
class nccl_group {
 public:
  /// Throws rank_error.
  nccl_group() { check_nccl(ncclGroupStart(), "ncclGroupStart"); }
  /// Not copyable: a group ends once.
  nccl_group(const nccl_group&) = delete;
  nccl_group& operator=(const nccl_group&) = delete;
  /// Ends the group after an exception, so that the thread's later calls are not part of it.
  ~nccl_group() {
    if (is_open_) ncclGroupEnd();
  }
  /// Begins the calls, and returns NCCL's result.
  ncclResult_t finish() {
    is_open_ = false;
    return ncclGroupEnd();
  }

 private:
  bool is_open_ = true;
};

/// Threads that are waited for at the end of their owner.
class joined_threads {
 public:
  joined_threads() = default;
  /// Not copyable: threads have one owner.
  joined_threads(const joined_threads&) = delete;
  joined_threads& operator=(const joined_threads&) = delete;
  /// Waits for them.
  ~joined_threads() {
    for (std::thread& thread : threads_) thread.join();
  }
  /// Begins a thread that calls f(), which must not throw. Throws std::system_error.
  template <class F>
  void begin(const F& f) {
    threads_.emplace_back(f);
  }

 private:
  std::vector<std::thread> threads_;
};

/// Throws the first error that is no rank_error, or else the first one: other ranks only say that they
/// waited. Null: no error.
inline void rethrow_cause(const std::vector<std::exception_ptr>& errors) {
  std::exception_ptr first;
  for (const std::exception_ptr& error : errors) try {
      if (error) std::rethrow_exception(error);
    } catch (const rank_error&) {
      if (!first) first = error;
    }
  if (first) std::rethrow_exception(first);
}

/// Makes the device current again that was current before.
class device_keeper {
 public:
  /// Throws device_error.
  device_keeper() { check_runtime(cudaGetDevice(&before_), "cudaGetDevice"); }
  /// Not copyable: the device is restored once.
  device_keeper(const device_keeper&) = delete;
  device_keeper& operator=(const device_keeper&) = delete;
  /// Errors are ignored, as destructors must not throw.
  ~device_keeper() { cudaSetDevice(before_); }

 private:
  int before_ = 0;
};

/// An event of the current device that ends with its owner.
class cuda_event {
 public:
  /// Throws device_error.
  cuda_event() {
    check_runtime(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming), "cudaEventCreateWithFlags");
  }
  /// Not copyable: an event has one owner.
  cuda_event(const cuda_event&) = delete;
  cuda_event& operator=(const cuda_event&) = delete;
  /// Errors are ignored, as destructors must not throw.
  ~cuda_event() { cudaEventDestroy(event_); }
  /// Returns the runtime's handle.
  cudaEvent_t get() const { return event_; }

 private:
  cudaEvent_t event_ = nullptr;
};

/// Zeros in memory of the current device, whose sums connect GPUs.
class connecting_words {
 public:
  /// Numbers of words by which NCCL chooses ways of its own: below a packet, up to many chunks.
  static constexpr std::size_t counts[] = {1, 1 << 10, 1 << 14, 1 << 17, 1 << 21};

  /// Throws device_error.
  connecting_words() {
    check_runtime(cudaMalloc(&words_, bytes), "cudaMalloc");
    cudaMemset(words_, 0, bytes);
  }
  /// Not copyable: the memory has one owner.
  connecting_words(const connecting_words&) = delete;
  connecting_words& operator=(const connecting_words&) = delete;
  /// Errors are ignored, as destructors must not throw.
  ~connecting_words() { cudaFree(words_); }
  /// Returns the first `count` words. Precondition: `count` is one of counts.
  array_view<std::uint64_t> first(std::size_t count) const {
    return {static_cast<std::uint64_t*>(words_), count};
  }

 private:
  static constexpr std::size_t bytes = sizeof(std::uint64_t) << 21;
  void* words_ = nullptr;
};

/// The words that ranks compare, in memory of the current device and in the host's.
class rank_words {
 public:
  /// Array of the words.
  using array = std::uint64_t[rank_call::word_count];

  /// Throws device_error.
  rank_words() {
    check_runtime(cudaMallocHost(&host_, sizeof(array)), "cudaMallocHost");
    const cudaError_t code = cudaMalloc(&device_, sizeof(array));
    if (code != cudaSuccess) cudaFreeHost(host_);
    check_runtime(code, "cudaMalloc");
  }
  /// Not copyable: the memory has one owner.
  rank_words(const rank_words&) = delete;
  rank_words& operator=(const rank_words&) = delete;
  /// Errors are ignored, as destructors must not throw.
  ~rank_words() {
    cudaFree(device_);
    cudaFreeHost(host_);
  }
  /// Returns the words in the host's memory.
  /// It is pinned, so that copies do not block.
  array& host() { return *static_cast<array*>(host_); }
  /// Returns the words in the device's memory.
  std::uint64_t* device() const { return static_cast<std::uint64_t*>(device_); }
  /// Puts a copy to the device on the stream. Throws device_error.
  void send(cudaStream_t stream) {
    check_runtime(cudaMemcpyAsync(device_, host_, sizeof(array), cudaMemcpyHostToDevice, stream),
                  "cudaMemcpyAsync");
  }
  /// Puts a copy to the host on the stream. Throws device_error.
  void take(cudaStream_t stream) {
    check_runtime(cudaMemcpyAsync(host_, device_, sizeof(array), cudaMemcpyDeviceToHost, stream),
                  "cudaMemcpyAsync");
  }

 private:
  void* host_ = nullptr;
  void* device_ = nullptr;
};

}  // namespace wfpg::detail
