// 3-D Morton codes of up to 63 bits: three interleaved 21-bit coordinates, x in the lowest bit.
#pragma once

#include <wfpg/base/types.hpp>

namespace wfpg {

/// A 63-bit Morton code. Its last 3·k bits name a voxel k levels below its ancestor.
using morton_code = std::uint64_t;

namespace detail {

/// 21 bits spread to every third one.
WFPG_HD constexpr std::uint64_t spread_bits(std::uint64_t x) {
  x &= 0x1fffffull;
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

/// The inverse of spread_bits.
WFPG_HD constexpr std::uint32_t gather_bits(std::uint64_t x) {
  x &= 0x1249249249249249ull;
  x = (x | x >> 2) & 0x10c30c30c30c30c3ull;
  x = (x | x >> 4) & 0x100f00f00f00f00full;
  x = (x | x >> 8) & 0x001f0000ff0000ffull;
  x = (x | x >> 16) & 0x001f00000000ffffull;
  return static_cast<std::uint32_t>((x | x >> 32) & 0x1fffffull);
}

}  // namespace detail

/// The code of integer coordinates, each in [0, 2²¹); higher bits are ignored.
WFPG_HD inline morton_code morton_encode(uvec3 p) {
  return detail::spread_bits(p.x) | detail::spread_bits(p.y) << 1 | detail::spread_bits(p.z) << 2;
}

/// The coordinates of a code.
WFPG_HD inline uvec3 morton_decode(morton_code code) {
  return {detail::gather_bits(code), detail::gather_bits(code >> 1), detail::gather_bits(code >> 2)};
}

}  // namespace wfpg
