// Memory of a policy without its type, which buffers of all types own.
#pragma once

#include <wfpg/base/config.hpp>
#include <wfpg/base/error.hpp>
#include <wfpg/exec/policy.hpp>

#include <cstddef>
#include <new>
#include <utility>

namespace wfpg::detail {

/// Owns bytes of a memory resource: what a buffer of any type has.
/// Its functions are not inlined: hosts have many buffers, and each would repeat them.
class memory_block {
 public:
  memory_block() = default;
  /// Allocates from a resource; nothing where `bytes` is 0.
  /// Throws out_of_memory.
  WFPG_NOINLINE memory_block(memory_resource* resource, std::size_t bytes)
      : resource_(resource), bytes_(bytes) {
    // No block for no element, as resources may return null or a unique address for 0 bytes.
    if (bytes_ == 0) return;
    try {
      data_ = resource_->allocate(bytes_, alignment);
    } catch (const std::bad_alloc&) {
      throw out_of_memory(bytes_);
    }
  }
  /// Takes the memory of another block, which is then empty.
  memory_block(memory_block&& other) noexcept { swap(other); }
  /// Frees its own memory and takes that of another, which becomes empty.
  /// Safe for self-assignment.
  WFPG_NOINLINE memory_block& operator=(memory_block&& other) noexcept {
    memory_block(std::move(other)).swap(*this);
    return *this;
  }
  /// Gives the memory back to the resource.
  WFPG_NOINLINE ~memory_block() {
    // Not by data_: Thrust hands null to memmove for empty ranges, by which compilers take it for not null.
    if (bytes_ > 0) resource_->deallocate(data_, bytes_, alignment);
  }

  /// Exchanges the memory of two blocks.
  void swap(memory_block& other) noexcept {
    std::swap(resource_, other.resource_);
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
  }
  void* data() const { return data_; }
  std::size_t bytes() const { return bytes_; }

 private:
  // Bytes: a cache line of CPUs, and more than any vector load of GPUs needs.
  static constexpr std::size_t alignment = 64;

  /// Where data_ came from; null where there is none.
  memory_resource* resource_ = nullptr;
  void* data_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace wfpg::detail
