// Arrays of structures for kernels that read or write all of one. On a GPU they are laid out in tiles of a
// warp's elements. A tile has pieces of 16 bytes: first the elements' first pieces, then their second ones. A
// warp's accesses are therefore contiguous. Elsewhere they are ordinary arrays.
#pragma once

#include <wfpg/exec/buffer.hpp>

#include <cstring>
#include <new>
#include <type_traits>

namespace render {

/// The kernels' view of a tiled_array. Trivially copyable. Elements must be written before they are read,
/// both in the same memory.
template <class T>
class tiled_view {
 public:
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % 16 == 0);

  tiled_view() = default;
  tiled_view(T* data, std::size_t size) : data_(data), size_(size) {}

  WFPG_HD bool empty() const { return size_ == 0; }

#if defined(__CUDA_ARCH__)
  WFPG_HD T operator[](std::size_t i) const {
    piece copy[pieces];
    for (std::size_t k = 0; k < pieces; ++k) copy[k] = at(i, k);
    T element;
    memcpy(static_cast<void*>(&element), copy, sizeof(T));
    return element;
  }
  template <class... Arguments>
  WFPG_HD void emplace(std::size_t i, const Arguments&... arguments) const {
    const T element(arguments...);
    piece copy[pieces];
    memcpy(copy, &element, sizeof(T));
    for (std::size_t k = 0; k < pieces; ++k) at(i, k) = copy[k];
  }
  template <class F>
  WFPG_HD void update(std::size_t i, const F& f) const {
    T element = (*this)[i];
    f(element);
    emplace(i, element);
  }
#else
  const T& operator[](std::size_t i) const {
    return data_[i];
  }
  /// Constructs element i from arguments.
  template <class... Arguments>
  void emplace(std::size_t i, const Arguments&... arguments) const {
    new (data_ + i) T(arguments...);
  }
  /// Calls f(T&) with element i.
  template <class F>
  void update(std::size_t i, const F& f) const {
    f(data_[i]);
  }
#endif

 private:
  struct alignas(16) piece {
    std::uint32_t words[4];
  };
  static constexpr std::size_t pieces = sizeof(T) / sizeof(piece);
  static constexpr std::size_t tile = 32;

  WFPG_HD piece& at(std::size_t i, std::size_t k) const {
    return reinterpret_cast<piece*>(data_)[(i / tile * pieces + k) * tile + i % tile];
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Owns `size` uninitialised elements in a policy's memory.
template <class T, class Exec>
class tiled_array {
 public:
  tiled_array(const Exec& exec, std::size_t size) : elements_(exec, (size + 31) / 32 * 32), size_(size) {}

  tiled_view<T> view() const { return {elements_.data(), size_}; }

 private:
  wfpg::buffer<T, Exec> elements_;
  std::size_t size_ = 0;
};

}  // namespace render
