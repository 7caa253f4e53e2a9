// Integer atomics in the memory of a policy. Relaxed: the end of a kernel orders what it wrote.
#pragma once

#include <wfpg/detail/config.hpp>

#include <cstdint>

namespace wfpg::detail {

/// *target += value; returns the value before.
WFPG_HD inline std::uint32_t atomic_add(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(target, value);
#else
  return __atomic_fetch_add(target, value, __ATOMIC_RELAXED);
#endif
}

}  // namespace wfpg::detail
