// The layout of a tiled_array on a GPU.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace wfpg::detail {

/// Reads and writes elements in tiles. A tile has pieces of 16 bytes: first the elements' first ones.
template <class T>
struct tiled_layout {
  /// Sixteen bytes, which a thread reads or writes at a time.
  struct alignas(16) piece {
    std::uint32_t words[4];
  };
  static constexpr std::size_t pieces = sizeof(T) / sizeof(piece);  ///< of an element
  static constexpr bool is_tiled = sizeof(T) % sizeof(piece) == 0;  ///< whether elements have whole pieces
  static constexpr std::size_t tile = is_tiled ? 32 : 1;            ///< elements of a tile: those of a warp

  WFPG_HD static piece& at(T* data, std::size_t i, std::size_t k) {
    return reinterpret_cast<piece*>(data)[(i / tile * pieces + k) * tile + i % tile];
  }
  WFPG_HD static T read(T* data, std::size_t i) {
    piece copy[pieces];
    for (std::size_t k = 0; k < pieces; ++k) copy[k] = at(data, i, k);
    T element;
    memcpy(static_cast<void*>(&element), copy, sizeof(T));
    return element;
  }
  WFPG_HD static void write(T* data, std::size_t i, const T& element) {
    piece copy[pieces];
    memcpy(copy, &element, sizeof(T));
    for (std::size_t k = 0; k < pieces; ++k) at(data, i, k) = copy[k];
  }
};

}  // namespace wfpg::detail
