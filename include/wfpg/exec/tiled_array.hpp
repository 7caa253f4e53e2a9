// Arrays of structures for kernels that read or write all of one. On a GPU they are laid out in tiles of a
// warp's elements. A tile has pieces of 16 bytes: first the elements' first pieces, then their second ones. A
// warp's accesses are therefore contiguous. Elsewhere they are ordinary arrays, and so are arrays of types
// whose size is not a multiple of 16 bytes.
//
//   tiled_array<vertex, Exec> vertices(exec, n);
//   exec.for_each(n, write);   // vertices.view().emplace(i, arguments...)
//   exec.for_each(n, read);    // const vertex& v = vertices.view()[i];
//
// Reading gives a copy on a GPU. Bind it to a const reference, which CPUs then need not copy to.
// Cost: an access of 16 bytes a piece. Pieces that a kernel does not use are not read.
// Memory: the elements, rounded up to whole tiles of 32.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/detail/tiled_layout.hpp>

#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

namespace wfpg {

/// The kernels' view of a tiled_array. Trivially copyable. Elements must be written before they are read,
/// both in the same memory.
template <class T>
class tiled_view {
 public:
  static_assert(std::is_trivially_copyable_v<T> && std::is_default_constructible_v<T>);
#if defined(__CUDA_ARCH__)
  using element = T;  ///< what reading gives: on a GPU a copy, else a reference
#else
  using element = const T&;  ///< what reading gives: on a GPU a copy, else a reference
#endif

  /// A view of no elements.
  tiled_view() = default;
  /// A view of `size` elements. `data`: room for whole tiles, aligned to 16 bytes.
  WFPG_HD tiled_view(T* data, std::size_t size) : data_(data), size_(size) {}

  /// Whether there are no elements.
  WFPG_HD bool empty() const {
    return size_ == 0;
  }
  /// Number of elements.
  WFPG_HD std::size_t size() const {
    return size_;
  }

  /// Reads element i, on a GPU all of its pieces that are used later.
  /// Precondition: i < size().
  WFPG_HD element operator[](std::size_t i) const {
#if defined(__CUDA_ARCH__)
    if constexpr (layout::is_tiled) return layout::read(data_, i);
#endif
    return data_[i];
  }
  /// Constructs element i from arguments.
  /// No destructor runs for what was there.
  /// Precondition: i < size().
  template <class... Arguments>
  WFPG_HD void emplace(std::size_t i, const Arguments&... arguments) const {
#if defined(__CUDA_ARCH__)
    if constexpr (layout::is_tiled) return layout::write(data_, i, T(arguments...));
#endif
    new (data_ + i) T(arguments...);
  }
  /// Calls f(T&) with element i, which f may change.
  /// A GPU reads and writes all of it.
  /// Precondition: i < size().
  template <class F>
  WFPG_HD void update(std::size_t i, const F& f) const {
#if defined(__CUDA_ARCH__)
    T changed = (*this)[i];
    f(changed);
    emplace(i, changed);
#else
    f(data_[i]);
#endif
  }

 private:
  using layout = detail::tiled_layout<T>;

  // Not owned.
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Owns `size` uninitialised elements in a policy's memory. Movable, not copyable. The policy's memory must
/// outlive it.
template <class T, class Exec>
class tiled_array {
 public:
  /// Has no elements.
  /// Its view has none, either.
  tiled_array() = default;
  /// Allocates memory for `size` elements.
  /// Throws out_of_memory.
  tiled_array(const Exec& exec, std::size_t size)
      : elements_(exec, (size + tile - 1) / tile * tile), size_(size) {}

  /// Move constructor. The moved-from array has no elements.
  tiled_array(tiled_array&& other) noexcept
      : elements_(std::move(other.elements_)), size_(std::exchange(other.size_, 0)) {}
  /// Move assignment. The moved-from array has no elements.
  tiled_array& operator=(tiled_array&& other) noexcept {
    elements_ = std::move(other.elements_);
    size_ = std::exchange(other.size_, 0);
    return *this;
  }

  /// View for kernels.
  /// Valid until the owner is destroyed or moved into.
  tiled_view<T> view() const { return {elements_.data(), size_}; }
  /// Number of elements.
  /// Those that fill the last tile do not count.
  std::size_t size() const { return size_; }
  /// Bytes allocated, with those that fill the last tile.
  std::size_t bytes() const { return elements_.bytes(); }

 private:
  // Elements of a tile.
  // It is 1 where a GPU has no tiles.
  static constexpr std::size_t tile = detail::tiled_layout<T>::tile;

  buffer<T, Exec> elements_;  // whole tiles
  std::size_t size_ = 0;      // without what fills the last tile
};

}  // namespace wfpg
