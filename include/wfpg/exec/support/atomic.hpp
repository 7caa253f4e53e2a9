// Integer atomics in the memory of a policy, on host and device.
// All are relaxed: they order no other access.
// The end of a kernel or loop orders what it wrote.
// On a device their scope is the device.
// Targets must be aligned to their size.
// Cost: one atomic instruction each; minimum and maximum retry on a CPU while others write.
// Memory: none.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstdint>
#include <type_traits>

namespace wfpg {

/// Adds to *target, modulo 2^32, and returns the value before.
/// Wraps around without an error, so that counters check their capacity first.
WFPG_HD inline std::uint32_t atomic_add(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(target, value);
#else
  // GCC's and Clang's builtins work on plain words: C++17 has no std::atomic_ref.
  return __atomic_fetch_add(target, value, __ATOMIC_RELAXED);
#endif
}

/// Adds to *target, modulo 2^64, and returns the previous value.
/// Sums of integers do not depend on the order of the threads, unlike those of floats.
WFPG_HD inline std::uint64_t atomic_add(std::uint64_t* target, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  // CUDA's overload is of unsigned long long, which is another type than std::uint64_t on Linux.
  return atomicAdd(reinterpret_cast<unsigned long long*>(target), static_cast<unsigned long long>(value));
#else
  return __atomic_fetch_add(target, value, __ATOMIC_RELAXED);
#endif
}

/// Returns *target as it is at some moment of the call.
/// On a device it reads past the multiprocessor's first-level cache, so others' writes become visible.
template <class T>
WFPG_HD T atomic_load(const T* target) {
#if defined(__CUDA_ARCH__)
  // volatile keeps the compiler from reusing a value that it read earlier.
  return *static_cast<const volatile T*>(target);
#else
  return __atomic_load_n(target, __ATOMIC_RELAXED);
#endif
}

/// Returns *target, on a device possibly an old value from the multiprocessor's cache.
/// It may never see what others write in this kernel.
/// For hints that may be stale: it is cheaper than atomic_load() where many threads read one word.
template <class T>
WFPG_HD T atomic_load_cached(const T* target) {
#if defined(__CUDA_ARCH__)
  // A plain load may be served by the first-level cache.
  // Other multiprocessors' writes do not reach that cache.
  return *target;
#else
  // CPUs have coherent caches: nothing is saved by an older value.
  return atomic_load(target);
#endif
}

/// Writes *target = value in one piece: no reader sees half of it.
template <class T>
WFPG_HD void atomic_store(T* target, T value) {
#if defined(__CUDA_ARCH__)
  // A store of an aligned word is never torn.
  *static_cast<volatile T*>(target) = value;
#else
  __atomic_store_n(target, value, __ATOMIC_RELAXED);
#endif
}

/// Writes *target = value where it is `expected`, and returns the value before.
/// The write took place if and only if the result equals `expected`.
/// No spurious failures.
/// A larger update reads, computes, exchanges, and repeats where another thread came between.
WFPG_HD inline std::uint64_t atomic_compare_exchange(std::uint64_t* target, std::uint64_t expected,
                                                     std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  // Strong on every device.
  return atomicCAS(reinterpret_cast<unsigned long long*>(target), static_cast<unsigned long long>(expected),
                   static_cast<unsigned long long>(value));
#else
  // Strong as well (weak = false). On failure it writes the value that it found to `expected`.
  __atomic_compare_exchange_n(target, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
  return expected;
#endif
}

/// Writes *target = min(*target, value), and returns the previous value.
/// T is an unsigned integer of 32 or 64 bits.
/// Writes nothing on a CPU where the target is already as small.
template <class T>
WFPG_HD T atomic_min(T* target, T value) {
#if defined(__CUDA_ARCH__)
  // CUDA overloads by these two types.
  using word = std::conditional_t<sizeof(T) == 8, unsigned long long, unsigned int>;
  return static_cast<T>(atomicMin(reinterpret_cast<word*>(target), static_cast<word>(value)));
#else
  // Look first: most calls find a value that is as small, and then leave the cache line shared.
  // The weak exchange may fail for no reason; it writes the current value to `before`.
  T before = atomic_load(target);
  while (value < before &&
         !__atomic_compare_exchange_n(target, &before, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
  return before;
#endif
}

/// Writes *target = max(*target, value).
/// Bits of non-negative floats may be compared in this way, since their order is that of the floats.
/// Returns nothing, so that a device sends the request and goes on.
/// For 32 bits only, which is what the library needs.
WFPG_HD inline void atomic_max(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  // The result is not used, so that the device need not wait for it.
  atomicMax(target, value);
#else
  std::uint32_t before = atomic_load(target);
  // It ends as soon as another thread has written a greater value.
  while (value > before &&
         !__atomic_compare_exchange_n(target, &before, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}

}  // namespace wfpg
