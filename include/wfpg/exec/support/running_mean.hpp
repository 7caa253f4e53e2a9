// Running means of few bits: 4 bytes with a count up to 255, and 2 bytes with random rounding.
// Fields and light tables keep one for each of many cells, so that every byte counts.
// Source of random rounding: stochastic rounding, surveyed by Croci et al. 2022.
// Cost: O(1), one division an update.
// Memory: 4 or 2 bytes a mean.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/value_queue.hpp>

namespace wfpg {

/// The mean of received values and their number, in 4 bytes.
/// The upper 24 bits hold the mean: a float without its sign and lowest 7 bits, so 2^-17 relative rounding.
/// The lower 8 bits hold the count, which stays at 255.
/// From then on a new value weighs 1/256 and old ones fade, so that fields follow light that changes.
class learnt_mean {
 public:
  /// Returns the mean, at least 0; 0 before the first value.
  WFPG_HD float mean() const { return bits_float(word_ >> count_bits << dropped_bits); }
  /// Returns the number of values, in [0, 255]. 255 stands for any larger number.
  WFPG_HD std::uint32_t count() const { return word_ & most; }

  /// Adds n > 0 values with the given sum.
  /// Negative means become 0.
  /// Rounds to nearest: small changes of a large mean may be lost.
  WFPG_HD void add(double sum, std::uint32_t n) {
    double mean_now = static_cast<double>(mean());
    std::uint32_t count_now = count();
    detail::add_to_mean(mean_now, count_now, sum, n, most);
    // Adding half of the dropped part rounds to nearest; a carry runs on into the exponent, as it should.
    const auto rounded = static_cast<float>(max(mean_now, 0.0));
    word_ = (float_bits(rounded) + (1u << (dropped_bits - 1))) >> dropped_bits << count_bits | count_now;
  }

  /// Returns whether the mean is at most `most_mean`, to the rounding of the stored bits.
  /// False also where it is not finite.
  /// Compares bits, since fast-math compilers assume finite numbers.
  WFPG_HD bool is_up_to(float most_mean) const {
    return word_ >> count_bits << dropped_bits <= float_bits(most_mean) + (1u << dropped_bits);
  }

 private:
  static constexpr int count_bits = 8, dropped_bits = 7;
  static constexpr std::uint32_t most = (1u << count_bits) - 1;

  std::uint32_t word_ = 0;
};

/// A running mean in 2 bytes: 12 bits of a float's code, and one of 16 counts.
/// Means lie from about 2⁻⁶⁴ to 2⁶⁴, with 5 mantissa bits below the leading one: steps of 3%. 0 is exact.
/// Values between two codes become either at random, in proportion to their distance.
/// Rounding is therefore unbiased in that range, however often it happens.
class stochastic_mean16 {
 public:
  /// Largest count. From then on a new value weighs 1/193, and old ones fade.
  static constexpr std::uint32_t most = 192;

  /// Returns the mean, as rounded; 0 before the first value.
  WFPG_HD float mean() const {
    // Code 0 is the mean 0; others continue a float's exponent and mantissa from the least one.
    const std::uint32_t code = word_ >> count_bits;
    return code > 0 ? bits_float((code + least) << dropped_bits) : 0.0f;
  }
  /// Returns the number of values, as rounded: 0, 1, 2, 3, 4, 6, 8, 12, ... 128 or 192.
  WFPG_HD std::uint32_t count() const { return count_of(word_ & most_code); }

  /// Adds n > 0 values with the given sum.
  /// `random`: 32 random bits, fresh for each call.
  /// The low 18 bits round the mean, the others the count.
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

  /// Returns the count of a code: powers of two, and the middles between them.
  WFPG_HD static std::uint32_t count_of(std::uint32_t code) {
    return code < 2 ? code : (2 + code % 2) << (code / 2 - 1);
  }
  /// Returns the code of a count, rounded up or down at random.
  WFPG_HD static std::uint32_t rounded_count(std::uint32_t n, std::uint32_t random) {
    if (n < 4) return n;
    const auto log = static_cast<std::uint32_t>(bits_of(n)) - 1, step = 1u << (log - 1);
    const std::uint32_t code = 2 * log + (n / step) % 2;
    return code + ((random & (step - 1)) < n % step ? 1 : 0);
  }
  /// Returns the code of a mean.
  /// Below the least one it is 0, above the largest one that one.
  WFPG_HD static std::uint32_t rounded_mean(float value, std::uint32_t random) {
    const std::uint32_t bits = (float_bits(value) + (random & ((1u << dropped_bits) - 1))) >> dropped_bits;
    return bits > least ? min(bits - least, codes - 1) : 0;
  }

  std::uint16_t word_ = 0;
};

/// Returns the mean of a running mean's values together with `weight` values equal to `other`.
/// `weight` may be fractional and must be at least 0.
/// A mean of no values gives `other`.
template <class Mean>
WFPG_HD float mixed_with(const Mean& known, float other, float weight) {
  const auto n = static_cast<float>(known.count());
  return n > 0.0f ? (weight * other + n * known.mean()) / (weight + n) : other;
}

}  // namespace wfpg
