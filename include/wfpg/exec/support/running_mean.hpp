// Means that values keep coming to: in 4 bytes, and in 2.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/value_queue.hpp>

namespace wfpg {

/// The mean of what a cell has received and of how many, in 4 bytes: the upper 24 of a float's bits below its
/// sign, and a count that stays at 255. From then on old values fade, so that fields follow light that
/// changes.
class learnt_mean {
 public:
  WFPG_HD float mean() const { return bits_float(word_ >> count_bits << dropped_bits); }
  WFPG_HD std::uint32_t count() const { return word_ & most; }

  /// Adds n > 0 values.
  WFPG_HD void add(double sum, std::uint32_t n) {
    double mean_now = static_cast<double>(mean());
    std::uint32_t count_now = count();
    detail::add_to_mean(mean_now, count_now, sum, n, most);
    const auto rounded = static_cast<float>(max(mean_now, 0.0));
    word_ = (float_bits(rounded) + (1u << (dropped_bits - 1))) >> dropped_bits << count_bits | count_now;
  }

  /// False also of what is not finite; by bits, since compilers may assume that numbers are.
  WFPG_HD bool is_up_to(float most_mean) const {
    return word_ >> count_bits << dropped_bits <= float_bits(most_mean) + (1u << dropped_bits);
  }

 private:
  static constexpr int count_bits = 8, dropped_bits = 7;
  static constexpr std::uint32_t most = (1u << count_bits) - 1;

  std::uint32_t word_ = 0;
};

/// The same in 2 bytes: of the mean 5 bits below the leading one, from about 2⁻⁶⁴ up to 2⁶⁴, and one of 16
/// counts. What lies between two that there are becomes either at random, so that in that range rounding does
/// not shift means, however often it happens.
class rough_mean {
 public:
  static constexpr std::uint32_t most = 192;  ///< values; from then on old ones fade

  WFPG_HD float mean() const {
    const std::uint32_t code = word_ >> count_bits;
    return code > 0 ? bits_float((code + least) << dropped_bits) : 0.0f;
  }
  /// 0, 1, 2, 3, 4, 6, 8, 12, ... 128 or 192.
  WFPG_HD std::uint32_t count() const { return count_of(word_ & most_code); }

  /// Adds n > 0 values, from 32 random bits.
  WFPG_HD void add(double sum, std::uint32_t n, std::uint32_t random) {
    double mean_now = static_cast<double>(mean());
    std::uint32_t count_now = count();
    detail::add_to_mean(mean_now, count_now, sum, n, most);
    word_ = static_cast<std::uint16_t>(rounded_mean(static_cast<float>(max(mean_now, 0.0)), random)
                                           << count_bits |
                                       rounded_count(count_now, random >> dropped_bits));
  }

 private:
  static constexpr int count_bits = 4, dropped_bits = 18;
  static constexpr std::uint32_t most_code = (1u << count_bits) - 1;
  static constexpr std::uint32_t least = (127u - 64u) << (23 - dropped_bits), codes = 1u << 12;

  WFPG_HD static std::uint32_t count_of(std::uint32_t code) {
    return code < 2 ? code : (2 + code % 2) << (code / 2 - 1);
  }
  WFPG_HD static std::uint32_t rounded_count(std::uint32_t n, std::uint32_t random) {
    if (n < 4) return n;
    const auto log = static_cast<std::uint32_t>(bits_of(n)) - 1, step = 1u << (log - 1);
    const std::uint32_t code = 2 * log + (n / step) % 2;
    return code + ((random & (step - 1)) < n % step ? 1 : 0);
  }
  WFPG_HD static std::uint32_t rounded_mean(float value, std::uint32_t random) {
    const std::uint32_t bits = (float_bits(value) + (random & ((1u << dropped_bits) - 1))) >> dropped_bits;
    return bits > least ? min(bits - least, codes - 1) : 0;
  }

  std::uint16_t word_ = 0;
};

/// The mean of the values that a mean is of and of `weight` times `other`, which need not be a whole number.
template <class Mean>
WFPG_HD float mixed_with(const Mean& known, float other, float weight) {
  const auto n = static_cast<float>(known.count());
  return n > 0.0f ? (weight * other + n * known.mean()) / (weight + n) : other;
}

}  // namespace wfpg
