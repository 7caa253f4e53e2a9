// Means that values keep coming to: in 4 bytes.
#pragma once

#include <wfpg/detail/math.hpp>
#include <wfpg/detail/value_queue.hpp>

namespace wfpg::detail {

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
    add_to_mean(mean_now, count_now, sum, n, most);
    const auto rounded = static_cast<float>(max(mean_now, 0.0));
    word_ = (float_bits(rounded) + (1u << (dropped_bits - 1))) >> dropped_bits << count_bits | count_now;
  }

  /// False also of what is not finite; by bits, since compilers may assume that numbers are.
  WFPG_HD bool is_up_to(float most_mean) const {
    return word_ >> count_bits << dropped_bits <= float_bits(most_mean) + (1u << dropped_bits);
  }

  /// The mean of these values and of `weight` times `other`, which need not be a whole number.
  WFPG_HD float mixed_with(float other, float weight) const {
    const auto n = static_cast<float>(count());
    return n > 0.0f ? (weight * other + n * mean()) / (weight + n) : other;
  }

 private:
  static constexpr int count_bits = 8, dropped_bits = 7;
  static constexpr std::uint32_t most = (1u << count_bits) - 1;

  std::uint32_t word_ = 0;
};

}  // namespace wfpg::detail
