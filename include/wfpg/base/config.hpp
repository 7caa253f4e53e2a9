// Macros for the compiler: host and device annotations, vectorisation hints, and two processor instructions.
// Includes no other header of the library.
// Supported are GCC, Clang and nvcc with one of them as its host compiler, with exceptions enabled.
// Other compilers stop here with an #error that says so.
// Cost and memory: none of its own. All functions are inline.
#pragma once

#if !defined(__GNUC__)
#error "wfpg: compile with GCC, Clang, or nvcc beside one of them; other compilers are not supported"
#elif !defined(__cpp_exceptions)
#error "wfpg: compile without -fno-exceptions; host calls report errors by exceptions"
#endif

#include <cstdint>

#if defined(__CUDACC__)
/// Marks a function that runs on the host and, under nvcc, on the device.
/// Expands to nothing without nvcc.
/// Functors that go to kernels carry it on operator(): the host runs the same code with a CPU policy.
#define WFPG_HD __host__ __device__
#else
#define WFPG_HD
#endif

/// Stands before a function that many places call and that takes long beside a call.
/// The compiler then makes it once, not once in each of its callers. So its floats are rounded alike in all
/// of them, too.
#define WFPG_NOINLINE __attribute__((noinline))

/// Stands before a kernel's function that takes much of a sample's time.
/// g++ inlines all calls into this function, and does not inline the function itself.
/// In large sources, such as a renderer's with several guides, it otherwise leaves small calls.
/// Products then take 1.5 times as long.
/// Expands to nothing under Clang and nvcc, and where a host defines it.
#if !defined(WFPG_FLATTEN)
#if defined(__CUDACC__) || defined(__clang__)
#define WFPG_FLATTEN
#else
#define WFPG_FLATTEN __attribute__((flatten, noinline))
#endif
#endif

/// Stands before a host's function that seldom runs, such as one that makes an exception.
/// It is not inlined, and is compiled for size, which takes less time.
#define WFPG_COLD __attribute__((cold, noinline))

/// Stands before a loop over the lanes of an emulated warp.
/// Promises the compiler that iterations are independent, so that it vectorises them.
/// Expands to nothing in device code.
/// An iteration must not read what another one writes, since nothing else checks it.
#if defined(__CUDA_ARCH__)
#define WFPG_VECTORIZE
#elif defined(__clang__)
#define WFPG_VECTORIZE _Pragma("clang loop vectorize(enable)")
#else
#define WFPG_VECTORIZE _Pragma("GCC ivdep")
#endif

/// Parts of the implementation. They change without notice.
namespace wfpg::detail {

/// Returns the number of bits that are set, in [0, 64].
/// One instruction on a device.
/// On a CPU it adds bits in parallel: portable builds call a function for the builtin, which takes longer.
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

/// Returns the number of bits above the highest one that is set, in [0, 64]. 64 where none is.
WFPG_HD inline int leading_zeros(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return __clzll(static_cast<long long>(bits));
#else
  return bits == 0 ? 64 : __builtin_clzll(bits);
#endif
}

/// Asks the CPU for the cache line of `address`, which the thread writes soon.
/// Any address is allowed, since a prefetch never faults.
/// Does nothing on a device, where other threads hide the latency.
/// Asks for it exclusively, as a later atomic needs it.
WFPG_HD inline void prefetch([[maybe_unused]] const void* address) {
#if !defined(__CUDA_ARCH__)
  __builtin_prefetch(address, 1);
#endif
}

}  // namespace wfpg::detail
