// Owning storage in the memory of an execution policy, and a memory resource that keeps freed blocks.
// A renderer's hot loop then allocates only in its first frame.
// Cost: one call of the policy's memory resource a buffer; O(1) a call of the retaining resource.
// Memory: the elements, and 24 bytes on the host for each buffer.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/detail/memory_block.hpp>
#include <wfpg/exec/policy.hpp>

#include <cstddef>
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
  buffer(const Exec& exec, std::size_t size) : memory_(exec.resource(), size * sizeof(T)) {}
  /// Allocates and copies elements from the host.
  /// Throws out_of_memory.
  buffer(const Exec& exec, const std::vector<T>& host) : buffer(exec, host.size()) {
    // The copy is ordered with the policy's later work.
    exec.copy_from_host(data(), host.data(), bytes());
  }

  /// Exchanges the memory of two buffers.
  /// No element is copied.
  /// Both keep the resources their memory came from. O(1).
  void swap(buffer& other) noexcept { memory_.swap(other.memory_); }

  /// Returns a view of the first n elements.
  /// A smaller buffer is freed first, and allocated anew with `spare` more: what it held is lost.
  /// Throws out_of_memory.
  array_view<T> fit(const Exec& exec, std::size_t n, std::size_t spare) {
    if (size() < n) {
      *this = buffer();
      *this = buffer(exec, n + spare);
    }
    return view().subview(0, n);
  }

  /// Returns the address of the first element, in the policy's memory; null where empty.
  T* data() const { return static_cast<T*>(memory_.data()); }
  /// Returns the number of elements.
  /// Only fit() changes it: otherwise a buffer that is too small is replaced.
  std::size_t size() const { return memory_.bytes() / sizeof(T); }
  /// Returns the size of all elements, bytes.
  std::size_t bytes() const { return memory_.bytes(); }
  /// Returns a view of all elements.
  /// Valid until the buffer is destroyed or moved into.
  /// A const buffer gives a view of mutable elements too, as a pointer would.
  array_view<T> view() const { return {data(), size()}; }

  /// Returns a copy of the first `count` elements on the host.
  /// Precondition: count <= size().
  /// Waits for the work before it, so it is for tests and reports, not for frames.
  std::vector<T> to_host(const Exec& exec, std::size_t count) const {
    std::vector<T> host(count);
    exec.copy_to_host(host.data(), data(), count * sizeof(T));
    return host;
  }
  /// Returns a copy of all elements on the host; waits likewise.
  std::vector<T> to_host(const Exec& exec) const { return to_host(exec, size()); }

 private:
  detail::memory_block memory_;
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
/// Cost: O(1) a call.
/// Host memory: 16 bytes a block, from the default resource at construction.
/// Blocks are not split or merged, so that a request of a new size takes new memory.
class retaining_resource : public memory_resource {
 public:
  /// `upstream` must outlive this; null stands for the default resource.
  /// Every block from upstream is aligned to 64 bytes, whatever a caller asks for.
  /// Nothing is allocated upstream before the first request.
  explicit retaining_resource(memory_resource* upstream)
      : upstream_(upstream ? upstream : std::pmr::get_default_resource()),
        entries_(std::pmr::get_default_resource()) {}
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
    for (int k = 0; k < size_count; ++k) {
      while (entry* const freed = take(sizes_[k].kept)) {
        upstream_->deallocate(freed->block, bytes_of(k), alignment);
        bytes_ -= bytes_of(k);
        entries_->deallocate(freed, sizeof(entry), alignof(entry));
      }
    }
  }

 private:
  static constexpr std::size_t alignment = 64;

  /// One for each block.
  /// That of a block in use does not know which block it is.
  struct entry {
    void* block;
    entry* next;
  };
  /// Blocks of one size, in two lists.
  struct blocks {
    /// Freed blocks.
    entry* kept = nullptr;
    /// As many entries as there are blocks in use.
    entry* in_use = nullptr;
  };

  // Sizes are powers of two or three quarters of one: a request that grows a little finds the same block.
  static constexpr int size_count = 2 * (64 - 8);
  /// Returns the k-th size, bytes.
  static std::size_t bytes_of(int k) { return std::size_t(k % 2 == 0 ? 192 : 256) << k / 2; }
  /// Returns which size holds so many bytes.
  static int size_of(std::size_t bytes) {
    int k = 0;
    while (k + 1 < size_count && bytes_of(k) < bytes) ++k;
    return k;
  }

  /// Removes the first entry of a list and returns it; null where it has none.
  static entry* take(entry*& list) {
    entry* const first = list;
    if (first) list = first->next;
    return first;
  }
  /// Makes an entry the first of a list.
  static void put(entry*& list, entry* first) {
    first->next = list;
    list = first;
  }

  void* do_allocate(std::size_t bytes, std::size_t) override {
    const int k = size_of(bytes);
    // Any kept block of this size will do.
    entry* found = take(sizes_[k].kept);
    if (!found) {
      // Its entry is made before it is, and moves: giving a block back asks for no memory.
      found = static_cast<entry*>(entries_->allocate(sizeof(entry), alignof(entry)));
      try {
        found->block = upstream_->allocate(bytes_of(k), alignment);
      } catch (...) {
        entries_->deallocate(found, sizeof(entry), alignof(entry));
        throw;
      }
      bytes_ += bytes_of(k);
    }
    put(sizes_[k].in_use, found);
    used_bytes_ += bytes;
    return found->block;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t) noexcept override {
    const int k = size_of(bytes);
    entry* const any = take(sizes_[k].in_use);
    any->block = block;
    put(sizes_[k].kept, any);
    used_bytes_ -= bytes;
  }
  // Blocks must return to the resource that gave them.
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  memory_resource* upstream_;
  /// Where entries come from.
  memory_resource* entries_;
  blocks sizes_[size_count];
  /// Held from upstream.
  std::size_t bytes_ = 0;
  /// Requested and not yet freed.
  std::size_t used_bytes_ = 0;
};

}  // namespace wfpg
