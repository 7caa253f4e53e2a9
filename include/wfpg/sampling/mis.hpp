// Multiple importance sampling: weights of a direction that two techniques can draw, such as a guide and a
// light's sampler. Source: Veach 1997, "Robust Monte Carlo Methods for Light Transport Simulation", section
// 9.2; the paper uses MIS in sections 3.5 and 4. Cost: O(1), no memory.
#pragma once

#include <wfpg/base/config.hpp>

namespace wfpg {

/// Weight of a sample of density p against one other technique of density q: p / (p + q), in [0, 1]. Source:
/// Veach 1997, Eq. 9.8. Both densities are non-negative, finite and of one measure, such as per steradian.
/// Returns 0 where p is not positive. The two techniques' weights of a direction sum to 1.
WFPG_HD inline float balance_heuristic(float p, float q) {
  return p > 0.0f ? p / (p + q) : 0.0f;
}

/// Weight with squared densities: p² / (p² + q²), in [0, 1]. Source: Veach 1997, Eq. 9.9, exponent 2. It
/// favours the technique that draws the direction more often, which suits two narrow densities. Preconditions
/// are those of balance_heuristic(). The ratio q / p is squared, so that large densities do not overflow.
/// From a ratio of 1e18 on, and where p is not positive, the weight is 0.
WFPG_HD inline float power_heuristic(float p, float q) {
  if (!(p > 0.0f)) return 0.0f;
  const float ratio = q / p;
  return ratio < 1.0e18f ? 1.0f / (1.0f + ratio * ratio) : 0.0f;
}

}  // namespace wfpg
