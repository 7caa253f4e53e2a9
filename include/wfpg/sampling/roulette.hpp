// Russian roulette beside a guide.
//
// Hosts end paths whose throughput is low. Guiding divides the throughput by a density that is large where
// light is: roulette by throughput ends just the paths that the guide chose. A host therefore decides by the
// throughput that the path would have without a guide.
//
// Source: Vorba and Krivanek 2016, "Adjoint-driven Russian Roulette and Splitting", section 2, describe the
// conflict. Cost: a division a vertex, and one number a path. Memory: none.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

namespace wfpg {

/// Returns the factor by which the throughput without a guide exceeds the real one, for one direction.
///
/// `bsdf_pdf`: the BSDF's own density of the direction. `pdf`: that of the mixture, which drew it. Both per
/// steradian; of a delta lobe, both are probabilities. A host multiplies the factors along a path, and
/// decides by throughput times their product:
///
///   scale *= wfpg::roulette_scale(bsdf_pdf, pdf);
///   const float survival = min(1.0f, max_component(throughput) * scale);
///
/// The throughput itself does not get the factor, so any factor keeps the picture unbiased. The result is in
/// [2^-20, 2^20]. It is 1 where a density is not positive or not finite.
WFPG_HD inline float roulette_scale(float bsdf_pdf, float pdf) {
  const bool known = is_finite(bsdf_pdf) && is_finite(pdf) && bsdf_pdf > 0.0f && pdf > 0.0f;
  return known ? clamp(pdf / bsdf_pdf, 0x1p-20f, 0x1p20f) : 1.0f;
}

}  // namespace wfpg
