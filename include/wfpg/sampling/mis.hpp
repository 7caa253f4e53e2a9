// Multiple importance sampling: the weights of Veach's heuristics for two techniques.
#pragma once

#include <wfpg/base/config.hpp>

namespace wfpg {

/// Weight of a sample of density p against one other technique of density q (Veach 1997, Eq. 9.8).
WFPG_HD inline float balance_heuristic(float p, float q) {
  return p > 0.0f ? p / (p + q) : 0.0f;
}

/// The same with squared densities (Veach 1997, Eq. 9.9, exponent 2); written as a ratio so that squares
/// cannot overflow.
WFPG_HD inline float power_heuristic(float p, float q) {
  if (!(p > 0.0f)) return 0.0f;
  const float ratio = q / p;
  return ratio < 1.0e18f ? 1.0f / (1.0f + ratio * ratio) : 0.0f;
}

}  // namespace wfpg
