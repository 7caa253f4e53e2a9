// Owning storage of an execution policy, and a memory resource that keeps what is given back to it.
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
struct state_access;  // to what guide_file.hpp saves and restores
struct store_state;
}  // namespace detail

/// `size` uninitialised elements in the memory of `Exec`. Movable, not copyable. The policy's memory resource
/// must outlive it.
template <class T, class Exec>
class buffer {
 public:
  static_assert(std::is_trivially_copyable_v<T>, "a buffer holds what a device can copy bytewise");

  buffer() = default;
  /// Throws out_of_memory.
  buffer(const Exec& exec, std::size_t size) : resource_(exec.resource()), size_(size) {
    if (size_ == 0) return;
    try {
      data_ = static_cast<T*>(resource_->allocate(bytes(), alignment));
    } catch (const std::bad_alloc&) {
      throw out_of_memory(bytes());
    }
  }
  /// A copy of elements on the host.
  buffer(const Exec& exec, const std::vector<T>& host) : buffer(exec, host.size()) {
    exec.copy_from_host(data_, host.data(), bytes());
  }
  /// Takes the memory of another, which is empty then.
  buffer(buffer&& other) noexcept { swap(other); }
  /// The same; gives its own memory back.
  buffer& operator=(buffer&& other) noexcept {
    buffer(std::move(other)).swap(*this);
    return *this;
  }
  ~buffer() {
    // Not by data_: Thrust hands null to memmove for empty ranges, by which compilers take it for not null.
    if (size_ > 0) resource_->deallocate(data_, bytes(), alignment);
  }

  /// Exchanges memory with another.
  void swap(buffer& other) noexcept {
    std::swap(resource_, other.resource_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  /// The first element, in the policy's memory; null where empty.
  T* data() const { return data_; }
  /// Number of elements.
  std::size_t size() const { return size_; }
  /// Of all elements.
  std::size_t bytes() const { return size_ * sizeof(T); }
  /// All elements. Valid while the buffer has them.
  array_view<T> view() const { return {data_, size_}; }

  /// The first `count` elements, copied to the host; waits for the work before it. For tests and reports.
  std::vector<T> to_host(const Exec& exec, std::size_t count) const {
    std::vector<T> host(count);
    exec.copy_to_host(host.data(), data_, count * sizeof(T));
    return host;
  }
  /// All elements, in the same way.
  std::vector<T> to_host(const Exec& exec) const { return to_host(exec, size_); }

 private:
  static constexpr std::size_t alignment = 64;

  memory_resource* resource_ = nullptr;
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// One element copied to the host; waits for the work before it.
template <class Exec, class T>
T read_element(const Exec& exec, const T* device) {
  T value;
  exec.copy_to_host(&value, device, sizeof(T));
  return value;
}

/// A memory resource that keeps blocks given back to it and hands them out again, so that work which repeats
/// allocates only the first time, and giving back never does. Not for concurrent calls. Cost: O(log of the
/// blocks held), and of host memory 64 bytes a block, of the default resource at construction.
class retaining_resource : public memory_resource {
 public:
  /// `upstream` must outlive this; null stands for the default resource.
  explicit retaining_resource(memory_resource* upstream)
      : upstream_(upstream ? upstream : std::pmr::get_default_resource()) {}
  retaining_resource(const retaining_resource&) = delete;
  retaining_resource& operator=(const retaining_resource&) = delete;
  ~retaining_resource() override { release(); }

  /// Bytes held from upstream, in use and kept.
  std::size_t bytes() const { return bytes_; }
  /// Bytes of them that are in use, as they were asked for.
  std::size_t used_bytes() const { return used_bytes_; }

  /// Gives kept blocks back upstream.
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
    const auto found = kept_.find(size);
    if (found != kept_.end()) {
      void* const block = found->second;
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
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  using blocks = std::pmr::multimap<std::size_t, void*>;  // by size

  memory_resource* upstream_;
  blocks kept_;
  blocks in_use_;  // as many of each size as there are; which is which is not known
  std::size_t bytes_ = 0;
  std::size_t used_bytes_ = 0;
};

}  // namespace wfpg
