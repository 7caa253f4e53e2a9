// Thrust, configured for the library, and an allocator for its temporaries.
// Without nvcc, Thrust's device system is its serial one, so that no CUDA toolkit is needed.
// A host that defines THRUST_DEVICE_SYSTEM itself keeps its choice.
// Include this header before any of Thrust's.
// Cost: one call of the memory resource for each temporary.
// Memory: one pointer an allocator.
#pragma once

#if !defined(__CUDACC__) && !defined(THRUST_DEVICE_SYSTEM)
#define THRUST_DEVICE_SYSTEM THRUST_DEVICE_SYSTEM_CPP
#endif

#include <wfpg/base/error.hpp>
#include <wfpg/exec/policy.hpp>

#include <thrust/version.h>

#include <cstddef>

namespace wfpg {

/// A standard allocator over a memory resource, for Thrust's temporaries.
/// The resource must outlive the allocator and what it allocates.
template <class T>
class resource_allocator {
 public:
  /// Element type, as the standard's allocators name it.
  using value_type = T;

  /// Allocates from `resource`, which must not be null.
  explicit resource_allocator(memory_resource* resource) : resource_(resource) {}
  /// Converts from an allocator of another type with one resource, as the standard asks.
  template <class U>
  resource_allocator(const resource_allocator<U>& other) : resource_(other.resource()) {}

  /// Returns memory for n elements, aligned to std::max_align_t, uninitialised.
  /// Throws out_of_memory where the resource throws std::bad_alloc.
  /// Device memory that runs out is thus one exception for buffers and temporaries.
  T* allocate(std::size_t n) {
    try {
      // Thrust asks for bytes (T is char) and places any type in them.
      return static_cast<T*>(resource_->allocate(n * sizeof(T), alignof(std::max_align_t)));
    } catch (const std::bad_alloc&) {
      throw out_of_memory(n * sizeof(T));
    }
  }
  /// Gives memory for n elements back.
  /// `p` came from an allocator over this resource.
  void deallocate(T* p, std::size_t n) { resource_->deallocate(p, n * sizeof(T), alignof(std::max_align_t)); }
  /// Returns the source of its memory.
  memory_resource* resource() const { return resource_; }

  /// Returns whether either can free what the other allocated: they have one resource.
  template <class U>
  bool operator==(const resource_allocator<U>& other) const {
    return resource_ == other.resource();
  }
  /// Returns whether the resources differ.
  template <class U>
  bool operator!=(const resource_allocator<U>& other) const {
    return !(*this == other);
  }

 private:
  memory_resource* resource_;
};

}  // namespace wfpg
