// What the compiler is, asked once for the whole library: annotations of functions that run on a device.
// Includes nothing of the library.
#pragma once

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
#elif defined(__GNUC__)
#define WFPG_VECTORIZE _Pragma("GCC ivdep")
#else
#define WFPG_VECTORIZE
#endif
