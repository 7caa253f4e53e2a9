// What the compiler is, asked once for the whole library: annotations of functions that run on a device, and
// instructions that only some processors have. Includes nothing of the library.
#pragma once

#if !defined(__GNUC__)
#error "wfpg: compile with GCC, Clang, or nvcc beside one of them; other compilers are not supported"
#elif !defined(__cpp_exceptions)
#error "wfpg: compile without -fno-exceptions; host calls report errors by exceptions"
#endif

#include <cstdint>

#if defined(__CUDACC__)
/// Marks a function that runs on the host and, where the compiler has one, on the device.
#define WFPG_HD __host__ __device__
#else
#define WFPG_HD
#endif

/// A loop over the lanes of an emulated warp: its iterations are independent.
#if defined(__CUDA_ARCH__)
#define WFPG_VECTORIZE
#elif defined(__clang__)
#define WFPG_VECTORIZE _Pragma("clang loop vectorize(enable)")
#else
#define WFPG_VECTORIZE _Pragma("GCC ivdep")
#endif

namespace wfpg::detail {

/// Bits that are set. On a CPU without the processor's own instruction, for which portable builds call a
/// function.
WFPG_HD inline std::uint32_t popcount(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__popcll(bits));
#else
  bits = bits - (bits >> 1 & 0x5555555555555555u);
  bits = (bits & 0x3333333333333333u) + (bits >> 2 & 0x3333333333333333u);
  bits = (bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0fu;
  return static_cast<std::uint32_t>(bits * 0x0101010101010101u >> 56);
#endif
}

/// Asks for a line of memory that the thread will write soon. A device has other threads to go on with: there
/// it does nothing.
WFPG_HD inline void prefetch([[maybe_unused]] const void* address) {
#if !defined(__CUDA_ARCH__)
  __builtin_prefetch(address, 1);
#endif
}

}  // namespace wfpg::detail
