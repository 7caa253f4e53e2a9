// Sums of numbers that do not depend on the order: whole numbers of a small unit.
#pragma once

#include <wfpg/base/config.hpp>
#include <wfpg/base/math.hpp>

#include <cmath>
#include <cstdint>

namespace render {

/// A sum of up to 2^32 numbers in units of 2^-56. It is exact for numbers from 0 to 2^40 that have no bits
/// below 2^-56. Bits below are cut off. More than 2^40 counts as 2^40, negative numbers and NaN as 0.
struct exact_sum {
  std::uint64_t low = 0, high = 0;

  WFPG_HD void add(double value) {
    if (!(value > 0.0)) return;
    const double units = (value < 0x1p40 ? value : 0x1p40) * 0x1p56;  // exact, as all that follows
    const double above = std::floor(units * 0x1p-64);
    const auto added = static_cast<std::uint64_t>(units - above * 0x1p64);
    low += added;
    high += static_cast<std::uint64_t>(above) + (low < added ? 1 : 0);
  }

  /// Four parts of 32 bits, whose sums over ranks have room in 64.
  static constexpr std::size_t parts = 4;
  WFPG_HD void split(std::uint64_t* to) const {
    to[0] = low & 0xffffffffu;
    to[1] = low >> 32;
    to[2] = high & 0xffffffffu;
    to[3] = high >> 32;
  }
  /// The number with these parts, one rank's or sums of several ranks'.
  WFPG_HD static double joined(const std::uint64_t* words) {
    const std::uint64_t second = words[1] + (words[0] >> 32), third = words[2] + (second >> 32);
    const std::uint64_t low = second << 32 | (words[0] & 0xffffffffu);
    const std::uint64_t high = (words[3] + (third >> 32)) << 32 | (third & 0xffffffffu);
    return (static_cast<double>(high) * 0x1p64 + static_cast<double>(low)) * 0x1p-56;
  }
};

}  // namespace render
