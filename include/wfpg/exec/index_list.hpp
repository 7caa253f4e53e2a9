// Stream compaction: the indices of those elements that a kernel marked, in ascending order. A later loop
// then runs over them alone, so that the threads of a warp all have work.
//
//   exec.for_each(n, mark);            // list.marks()[i] = 1 or 0
//   list.collect(exec, n);
//   list.for_each(exec, f);            // f(i) for each marked i
//
// The host never reads the number of indices, so it never waits for it.
// Source: Blelloch 1990, "Prefix Sums and Their Applications".
// Cost: one scan. Memory: 8 bytes an element.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/scan_places.hpp>
#include <wfpg/exec/support/waits_for_memory.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

namespace detail {

/// Writes each marked index to its place. With the last element it writes the number of indices.
struct collect_indices {
  array_view<const std::uint32_t> marks;  ///< by element
  array_view<std::uint32_t> indices;      ///< receives the list
  std::uint32_t* count;                   ///< receives the number of indices
  WFPG_HD void operator()(std::size_t i, std::uint32_t place) const {
    if (i + 1 == marks.size()) *count = place + marks[i];
    if (marks[i] != 0) indices[place] = static_cast<std::uint32_t>(i);
  }
};

/// Calls a kernel with the index that a list has at a place.
template <class F>
struct call_at_index {
  static constexpr bool waits_for_memory = detail::waits_for_memory<F>::value;

  array_view<const std::uint32_t> indices;  ///< the list
  F f;                                      ///< the kernel
  WFPG_HD void operator()(std::size_t place) const { f(std::size_t(indices[place])); }
};

}  // namespace detail

/// Owns marks of up to `capacity` elements, and the list of those marked. Movable, not copyable; the policy's
/// memory must outlive it.
template <class Exec>
class index_list {
 public:
  /// Has no elements.
  index_list() = default;
  /// Allocates. The list is empty, and marks are not initialised. Throws out_of_memory, and
  /// std::invalid_argument where `capacity` is 2³² or more.
  index_list(const Exec& exec, std::size_t capacity)
      : marks_(exec, checked(capacity)), indices_(exec, capacity), count_(exec, 1) {
    exec.fill_bytes(count_.data(), 0, count_.bytes());
  }

  /// For kernels, which write each of them before collect(): 1 where the element is to be listed, else 0.
  array_view<std::uint32_t> marks() { return marks_.view(); }
  /// Lists those of the first n elements that are marked. The marks stay. O(n). Throws out_of_memory, and
  /// std::invalid_argument where n is above the capacity.
  void collect(const Exec& exec, std::size_t n) {
    require(n <= capacity(), "n", n, "at most the index_list's capacity");
    if (n == 0) return exec.fill_bytes(count_.data(), 0, count_.bytes());
    const array_view<const std::uint32_t> marks(marks_.data(), n);
    scan_places(exec, n, marks.data(), detail::collect_indices{marks, indices_.view(), count_.data()});
  }
  /// Calls f(i) for each listed index, in no order.
  template <class F>
  void for_each(const Exec& exec, const F& f) const {
    if (capacity() > 0) exec.for_each(count(), detail::call_at_index<F>{indices_.view(), f});
  }

  /// The number of indices. Precondition: the list was made with an execution policy.
  exec::device_count count() const { return {count_.data(), indices_.size()}; }
  /// The indices, ascending. As many as count() says are valid.
  array_view<const std::uint32_t> indices() const { return indices_.view(); }
  /// Most elements.
  std::size_t capacity() const { return indices_.size(); }
  /// Bytes allocated, without the scan's temporaries.
  std::size_t bytes() const { return marks_.bytes() + indices_.bytes() + count_.bytes(); }

 private:
  // Checks the number before memory is asked for.
  static std::size_t checked(std::size_t capacity) {
    require(capacity <= 0xffffffffull, "index_list's capacity", capacity, "less than 2^32");
    return capacity;
  }

  // An element each. Then one number.
  buffer<std::uint32_t, Exec> marks_, indices_, count_;
};

}  // namespace wfpg
