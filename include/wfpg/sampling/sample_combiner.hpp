// Weights of whole-picture samples while the guide learns (paper, section 3.7, Eq. 7): the picture is
// sum(S_i h(i)) / sum(h(i)). Includes only annotations.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstdint>

namespace wfpg {

/// The paper's six ways to combine samples of growing quality, and one of wfpg's own.
enum class sample_combination : std::uint8_t {
  constant,       ///< all alike
  linear,         ///< 1, 2, 3, 4, 5, 5, ...
  quadratic,      ///< 1, 4, 9, 16, 25, 25, ...
  one_two,        ///< 1, 2, 2, ...
  discard_first,  ///< 0, 1, 1, ...
  pt_first,       ///< all alike, and the first sample is not guided
  pt_linear,      ///< linear, and the first sample is not guided: the best of both
};

/// h(i) of sample i, counted from 1.
WFPG_HD inline float sample_weight(sample_combination combination, std::uint32_t i) {
  const float rank = i < 5 ? static_cast<float>(i) : 5.0f;
  switch (combination) {
    case sample_combination::linear:
    case sample_combination::pt_linear:
      return rank;
    case sample_combination::quadratic:
      return rank * rank;
    case sample_combination::one_two:
      return i == 1 ? 1.0f : 2.0f;
    case sample_combination::discard_first:
      return i == 1 ? 0.0f : 1.0f;
    case sample_combination::constant:
    case sample_combination::pt_first:
      break;
  }
  return 1.0f;
}

/// Samples at the beginning that a combination wants unguided.
WFPG_HD inline std::uint32_t unguided_samples(sample_combination combination) {
  return combination == sample_combination::pt_first || combination == sample_combination::pt_linear ? 1 : 0;
}

}  // namespace wfpg
