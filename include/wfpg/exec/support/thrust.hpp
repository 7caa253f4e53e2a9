// Thrust as the library uses it: without a CUDA compiler its device system is the serial one, so that no
// toolkit is needed; temporaries come from a memory resource.
#pragma once

#if !defined(__CUDACC__) && !defined(THRUST_DEVICE_SYSTEM)
#define THRUST_DEVICE_SYSTEM THRUST_DEVICE_SYSTEM_CPP
#endif

#include <wfpg/base/error.hpp>
#include <wfpg/exec/policy.hpp>

#include <thrust/version.h>

#include <cstddef>

namespace wfpg {

/// A standard allocator over a memory resource, for Thrust's temporaries. Throws out_of_memory.
template <class T>
class resource_allocator {
 public:
  using value_type = T;

  explicit resource_allocator(memory_resource* resource) : resource_(resource) {}
  template <class U>
  resource_allocator(const resource_allocator<U>& other) : resource_(other.resource()) {}

  T* allocate(std::size_t n) {
    try {
      return static_cast<T*>(resource_->allocate(n * sizeof(T), alignof(std::max_align_t)));
    } catch (const std::bad_alloc&) {
      throw out_of_memory(n * sizeof(T));
    }
  }
  void deallocate(T* p, std::size_t n) { resource_->deallocate(p, n * sizeof(T), alignof(std::max_align_t)); }
  memory_resource* resource() const { return resource_; }

  template <class U>
  bool operator==(const resource_allocator<U>& other) const {
    return resource_ == other.resource();
  }
  template <class U>
  bool operator!=(const resource_allocator<U>& other) const {
    return !(*this == other);
  }

 private:
  memory_resource* resource_;
};

}  // namespace wfpg
