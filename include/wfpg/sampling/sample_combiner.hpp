// Weights of whole-picture samples while the guide learns (paper, section 3.7, Eq. 7): the picture is the
// mean of the samples S_i with weights h(i). Cost: O(1), no memory. Hosts may include it alone: it includes
// annotations and standard headers only.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstdint>

namespace wfpg {

/// How samples of growing quality are combined: the paper's six heuristics, and two more. The paper uses "PT
/// First" for its results.
enum class sample_combination : std::uint8_t {
  constant,       ///< 1 for all samples
  linear,         ///< i up to 5: 1, 2, 3, 4, 5, 5, ...
  quadratic,      ///< i² up to 25: 1, 4, 9, 16, 25, 25, ...
  one_two,        ///< 1 for the first sample, 2 for all others
  discard_first,  ///< 0 for the first sample, 1 for all others
  pt_first,       ///< 1 for all; the first sample is path traced without a guide
  pt_linear,      ///< weights of linear; the first sample is path traced without a guide
  /// Weights that path_guider::sample_weight() measures, and sample_weight() does not know; the first sample
  /// is path traced without a guide.
  inverse_variance,
};

/// Weight h(i) of sample i, counted from 1: 0 to 25. Only ratios matter, since the picture is divided by the
/// sum of the weights. With discard_first that sum is 0 after one sample. With inverse_variance it is 1, to
/// be multiplied with path_guider::sample_weight().
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
    case sample_combination::inverse_variance:
      break;
  }
  return 1.0f;
}

/// Number of samples at the beginning that the combination wants without a guide, 0 or 1. The host draws
/// their directions from the BSDF alone.
WFPG_HD inline std::uint32_t unguided_samples(sample_combination combination) {
  return combination == sample_combination::pt_first || combination == sample_combination::pt_linear ||
                 combination == sample_combination::inverse_variance
             ? 1
             : 0;
}

}  // namespace wfpg
