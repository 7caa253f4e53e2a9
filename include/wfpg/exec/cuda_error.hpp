// Errors of the CUDA runtime as exceptions.
//
// Cost: one comparison a call. Memory: none.
#pragma once

#include <wfpg/base/error.hpp>

#include <cuda_runtime_api.h>

namespace wfpg {

/// Thrown where a call of the CUDA runtime failed.
/// An error that an earlier kernel left behind is reported by the next call, which need not be its cause.
/// Where Thrust makes that call, a thrust::system_error comes instead.
/// Both are std::runtime_error.
/// The message holds the call's name, the error's text and its code.
class cuda_error : public device_error {
 public:
  /// `call`: the name of the failed function.
  /// `code`: what it returned.
  cuda_error(const char* call, cudaError_t code)
      : device_error(static_cast<int>(code), cudaGetErrorString(code), call) {}
  /// Returns the runtime's error code.
  cudaError_t code() const noexcept { return static_cast<cudaError_t>(device_error::code()); }
};

/// Throws cuda_error unless `code` is cudaSuccess.
/// Clears the runtime's last error first, so that the next call does not report it again.
/// Sticky errors, such as an illegal address, stay with the device all the same.
/// `call` becomes part of the message; it is kept nowhere.
inline void check_cuda(cudaError_t code, const char* call) {
  if (code == cudaSuccess) return;
  // Reading the last error clears it.
  cudaGetLastError();
  throw cuda_error(call, code);
}

}  // namespace wfpg
