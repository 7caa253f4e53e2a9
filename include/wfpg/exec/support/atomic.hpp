// Integer atomics in the memory of a policy. Relaxed: the end of a kernel orders what it wrote.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstdint>
#include <type_traits>

namespace wfpg {

/// *target += value; returns the value before.
WFPG_HD inline std::uint32_t atomic_add(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(target, value);
#else
  return __atomic_fetch_add(target, value, __ATOMIC_RELAXED);
#endif
}

WFPG_HD inline std::uint64_t atomic_add(std::uint64_t* target, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(reinterpret_cast<unsigned long long*>(target), static_cast<unsigned long long>(value));
#else
  return __atomic_fetch_add(target, value, __ATOMIC_RELAXED);
#endif
}

/// *target as it is at some moment.
template <class T>
WFPG_HD T atomic_load(const T* target) {
#if defined(__CUDA_ARCH__)
  return *static_cast<const volatile T*>(target);
#else
  return __atomic_load_n(target, __ATOMIC_RELAXED);
#endif
}

/// *target as it is, or on a device as a multiprocessor's cache remembers it: it may never see what others
/// write in the same kernel.
template <class T>
WFPG_HD T atomic_load_cached(const T* target) {
#if defined(__CUDA_ARCH__)
  return *target;
#else
  return atomic_load(target);
#endif
}

/// *target = value.
template <class T>
WFPG_HD void atomic_store(T* target, T value) {
#if defined(__CUDA_ARCH__)
  *static_cast<volatile T*>(target) = value;
#else
  __atomic_store_n(target, value, __ATOMIC_RELAXED);
#endif
}

/// *target = value where it was `expected`; returns the value before.
WFPG_HD inline std::uint64_t atomic_compare_exchange(std::uint64_t* target, std::uint64_t expected,
                                                     std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  return atomicCAS(reinterpret_cast<unsigned long long*>(target), static_cast<unsigned long long>(expected),
                   static_cast<unsigned long long>(value));
#else
  __atomic_compare_exchange_n(target, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
  return expected;
#endif
}

/// *target = the lesser of itself and value, 32 or 64 bits; returns the value before.
template <class T>
WFPG_HD T atomic_min(T* target, T value) {
#if defined(__CUDA_ARCH__)
  using word = std::conditional_t<sizeof(T) == 8, unsigned long long, unsigned int>;
  return static_cast<T>(atomicMin(reinterpret_cast<word*>(target), static_cast<word>(value)));
#else
  T before = atomic_load(target);
  while (value < before &&
         !__atomic_compare_exchange_n(target, &before, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
  return before;
#endif
}

/// *target = the greater of itself and value.
WFPG_HD inline void atomic_max(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMax(target, value);
#else
  std::uint32_t before = atomic_load(target);
  while (value > before &&
         !__atomic_compare_exchange_n(target, &before, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}

}  // namespace wfpg
