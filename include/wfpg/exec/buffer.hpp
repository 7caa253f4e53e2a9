// Owning storage in the memory of an execution policy, and a memory resource that keeps freed blocks.
// A renderer's hot loop then allocates only in its first frame.
// Cost: one call of the policy's memory resource a buffer; O(log blocks) a call of the retaining resource.
// Memory: the elements, and 24 bytes on the host for each buffer.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/policy.hpp>

#include <cstddef>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

namespace wfpg {

namespace detail {
// Read and write what guide_file.hpp saves.
struct state_access;
struct guide_sections;
struct kept_state;
}  // namespace detail

/// Owns `size` uninitialised elements in the memory of `Exec`.
/// Movable, not copyable.
/// The policy's memory resource must outlive the buffer.
/// On a device policy, allocation and release are ordered with the policy's kernels.
/// T must be trivially copyable, as kernels and copies move it bytewise.
template <class T, class Exec>
class buffer {
 public:
  static_assert(std::is_trivially_copyable_v<T>, "a buffer holds what a device can copy bytewise");

  /// No elements and no memory.
  buffer() = default;
  /// Allocates `size` elements, aligned to 64 bytes.
  /// Asks for nothing where `size` is 0.
  /// Throws out_of_memory.
  buffer(const Exec& exec, std::size_t size) : resource_(exec.resource()), size_(size) {
    // No block for no element, as resources may return null or a unique address for 0 bytes.
    if (size_ == 0) return;
    try {
      data_ = static_cast<T*>(resource_->allocate(bytes(), alignment));
    } catch (const std::bad_alloc&) {
      throw out_of_memory(bytes());
    }
  }
  /// Allocates and copies elements from the host.
  /// Throws out_of_memory.
  buffer(const Exec& exec, const std::vector<T>& host) : buffer(exec, host.size()) {
    // The copy is ordered with the policy's later work.
    exec.copy_from_host(data_, host.data(), bytes());
  }
  /// Takes the memory of another buffer, which is then empty.
  buffer(buffer&& other) noexcept { swap(other); }
  /// Frees its own memory and takes that of another, which becomes empty.
  /// Safe for self-assignment.
  buffer& operator=(buffer&& other) noexcept {
    buffer(std::move(other)).swap(*this);
    return *this;
  }
  /// Gives the memory back to the resource.
  /// Does not wait for kernels that use it.
  ~buffer() {
    // Not by data_: Thrust hands null to memmove for empty ranges, by which compilers take it for not null.
    if (size_ > 0) resource_->deallocate(data_, bytes(), alignment);
  }

  /// Exchanges the memory of two buffers.
  /// No element is copied.
  /// Both keep the resources their memory came from. O(1).
  void swap(buffer& other) noexcept {
    std::swap(resource_, other.resource_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  /// Returns the address of the first element, in the policy's memory; null where empty.
  T* data() const { return data_; }
  /// Returns the number of elements.
  /// It never changes: a buffer that is too small is replaced.
  std::size_t size() const { return size_; }
  /// Returns the size of all elements, bytes.
  std::size_t bytes() const { return size_ * sizeof(T); }
  /// Returns a view of all elements.
  /// Valid until the buffer is destroyed or moved into.
  /// A const buffer gives a view of mutable elements too, as a pointer would.
  array_view<T> view() const { return {data_, size_}; }

  /// Returns a copy of the first `count` elements on the host.
  /// Precondition: count <= size().
  /// Waits for the work before it, so it is for tests and reports, not for frames.
  std::vector<T> to_host(const Exec& exec, std::size_t count) const {
    std::vector<T> host(count);
    exec.copy_to_host(host.data(), data_, count * sizeof(T));
    return host;
  }
  /// Returns a copy of all elements on the host; waits likewise.
  std::vector<T> to_host(const Exec& exec) const { return to_host(exec, size_); }

 private:
  // Bytes: a cache line of CPUs, and more than any vector load of GPUs needs.
  static constexpr std::size_t alignment = 64;

  /// Where data_ came from; null where there is none.
  memory_resource* resource_ = nullptr;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Returns one element, copied to the host from the policy's memory.
/// `device` is its address.
/// Waits for the work before it, so frames avoid it.
template <class Exec, class T>
T read_element(const Exec& exec, const T* device) {
  T value;
  exec.copy_to_host(&value, device, sizeof(T));
  return value;
}

/// A memory resource that keeps freed blocks and hands them out again.
/// Repeated work allocates from upstream only the first time.
/// Freeing never does, and never throws.
/// Calls must not be concurrent.
/// Blocks are rounded up to 2^k or 3 · 2^k bytes, at least 192: less than half is added above 128 bytes.
/// Cost: O(log of the blocks held) a call.
/// Host memory: 64 bytes a block, from the default resource at construction.
/// Blocks are not split or merged, so that a request of a new size takes new memory.
class retaining_resource : public memory_resource {
 public:
  /// `upstream` must outlive this; null stands for the default resource.
  /// Every block from upstream is aligned to 64 bytes, whatever a caller asks for.
  /// Nothing is allocated upstream before the first request.
  explicit retaining_resource(memory_resource* upstream)
      : upstream_(upstream ? upstream : std::pmr::get_default_resource()) {}
  /// Not copyable: blocks have one owner.
  retaining_resource(const retaining_resource&) = delete;
  retaining_resource& operator=(const retaining_resource&) = delete;
  /// Gives kept blocks back upstream.
  /// Precondition: no block is in use.
  ~retaining_resource() override { release(); }

  /// Returns the bytes held from upstream, in use and kept, as rounded up.
  std::size_t bytes() const { return bytes_; }
  /// Returns the bytes in use, as they were requested.
  std::size_t used_bytes() const { return used_bytes_; }

  /// Gives kept blocks back upstream.
  /// Blocks in use stay.
  void release() {
    for (const auto& [size, block] : kept_) {
      upstream_->deallocate(block, size, alignment);
      bytes_ -= size;
    }
    kept_.clear();
  }

 private:
  static constexpr std::size_t alignment = 64;

  // Sizes are powers of two or three quarters of one: a request that grows a little finds the same block.
  static std::size_t rounded(std::size_t bytes) {
    std::size_t size = 256;
    while (size < bytes) size *= 2;
    return bytes <= size / 4 * 3 ? size / 4 * 3 : size;
  }

  void* do_allocate(std::size_t bytes, std::size_t) override {
    const std::size_t size = rounded(bytes);
    // Any kept block of this size will do.
    const auto found = kept_.find(size);
    if (found != kept_.end()) {
      void* const block = found->second;
      // Moving the node needs no memory.
      in_use_.insert(kept_.extract(found));
      used_bytes_ += bytes;
      return block;
    }
    // Its entry is made before it is, and moves: giving a block back asks for no memory.
    const auto entry = in_use_.emplace(size, nullptr);
    try {
      entry->second = upstream_->allocate(size, alignment);
    } catch (...) {
      in_use_.erase(entry);
      throw;
    }
    bytes_ += size;
    used_bytes_ += bytes;
    return entry->second;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t) noexcept override {
    auto entry = in_use_.extract(in_use_.find(rounded(bytes)));  // of any block of this size
    entry.mapped() = block;
    kept_.insert(std::move(entry));
    used_bytes_ -= bytes;
  }
  // Blocks must return to the resource that gave them.
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  using blocks = std::pmr::multimap<std::size_t, void*>;  // by size

  memory_resource* upstream_;
  /// Freed blocks, by size.
  blocks kept_;
  blocks in_use_;  // as many of each size as there are; which is which is not known
  /// Held from upstream.
  std::size_t bytes_ = 0;
  /// Requested and not yet freed.
  std::size_t used_bytes_ = 0;
};

}  // namespace wfpg
