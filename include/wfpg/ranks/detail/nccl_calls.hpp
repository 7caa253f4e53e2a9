// Calls of NCCL as exceptions, and a CUDA event with an owner.
// Cost: one comparison a call. Memory: the runtime's, of an event.
#pragma once

#include <wfpg/exec/cuda.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <nccl.h>

#include <string>

static_assert(NCCL_VERSION_CODE >= NCCL_VERSION(2, 18, 0), "wfpg/ranks/nccl.hpp needs NCCL 2.18 or later");

namespace wfpg::detail {

/// Throws rank_error that names the failed function of NCCL.
/// A call that is not done yet is no error.
inline void check_nccl(ncclResult_t code, const char* function) {
  if (code == ncclSuccess || code == ncclInProgress) return;
  throw rank_error(std::string(function) + " failed: " + ncclGetErrorString(code) +
                   "; NCCL_DEBUG=INFO in the environment tells more");
}

/// An event of the current device that ends with its owner.
class cuda_event {
 public:
  /// Throws cuda_error.
  cuda_event() {
    check_cuda(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming), "cudaEventCreateWithFlags");
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

}  // namespace wfpg::detail
