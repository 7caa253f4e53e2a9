// 3-D Morton codes of 63 bits: three interleaved 21-bit coordinates, x in the lowest bit.
// Sorting voxels by their codes puts the voxels of each octree node in one run, at any level.
// Source: Morton 1966, "A Computer Oriented Geodetic Data Base".
// Cost: 5 shifts and masks a coordinate, O(1). Memory: 8 bytes a code.
#pragma once

#include <wfpg/base/types.hpp>

namespace wfpg {

/// A 63-bit Morton code; bit 63 is 0.
/// Its low 3·k bits name a voxel among the descendants k levels below a node. The bits above name the node.
/// The parent's code is code >> 3, and the octant in the parent is code & 7.
using morton_code = std::uint64_t;

namespace detail {

/// Spreads the low 21 bits of `x` to every third bit: bit i goes to bit 3·i.
/// The two bits between them are 0, so that three spread coordinates are combined by or.
WFPG_HD constexpr std::uint64_t spread_bits(std::uint64_t x) {
  // Each step halves the runs of bits that stay together: 16, 8, 4, 2, 1.
  x &= 0x1fffffull;
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

/// Collects every third bit of `x`, from bit 0 on. Inverse of spread_bits().
/// Other bits are ignored, so that a code need only be shifted for its coordinates.
WFPG_HD constexpr std::uint32_t gather_bits(std::uint64_t x) {
  // The steps of spread_bits() in reverse order.
  x &= 0x1249249249249249ull;
  x = (x | x >> 2) & 0x10c30c30c30c30c3ull;
  x = (x | x >> 4) & 0x100f00f00f00f00full;
  x = (x | x >> 8) & 0x001f0000ff0000ffull;
  x = (x | x >> 16) & 0x001f00000000ffffull;
  return static_cast<std::uint32_t>((x | x >> 32) & 0x1fffffull);
}

}  // namespace detail

/// Returns the code of a voxel. Coordinates lie in [0, 2²¹); higher bits are ignored.
/// Neighbours along x differ in bits 0, 3, 6 and so on; y and z follow one and two bits above.
WFPG_HD inline morton_code morton_encode(uvec3 p) {
  return detail::spread_bits(p.x) | detail::spread_bits(p.y) << 1 | detail::spread_bits(p.z) << 2;
}

/// Returns the coordinates of a code, each in [0, 2²¹). Inverse of morton_encode().
/// Shifted by 3·k, a code gives the coordinates of the ancestor k levels up.
WFPG_HD inline uvec3 morton_decode(morton_code code) {
  return {detail::gather_bits(code), detail::gather_bits(code >> 1), detail::gather_bits(code >> 2)};
}

}  // namespace wfpg
