// Russian roulette beside a guide.
//
// Hosts end paths whose throughput is low. Guiding divides the throughput by a density that is large where
// light is: roulette by throughput ends just the paths that the guide chose. A host therefore decides by the
// throughput that the path would have without a guide.
//
// Guided roulette goes further: it asks the guide what is still to come, and ends paths that are not expected
// to matter for their pixel.
//
// Source: Vorba and Krivanek 2016, "Adjoint-driven Russian Roulette and Splitting". Splitting is left out.
// Cost: a division a vertex, and one number a path; guided roulette reads one value of the cache. Memory:
// none.
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

/// Window of guided roulette.
struct roulette_window {
  /// Ratio of the window's upper to its lower end, at least 1. A path in the window is left alone.
  float width = 5.0f;
  /// Least probability of survival, in (0, 1]. It bounds the weight of a path that the guide underrates.
  float least = 0.1f;
};

/// Returns the probability with which a path survives guided roulette, in [window.least, 1].
///
/// A path of throughput T that is expected to bring radiance L from here on brings T L to its pixel. It
/// survives surely where T L is at least 2 / (1 + width) of the pixel's own radiance, and in proportion to it
/// below. The host ends the path with the rest of the probability, and divides the throughput by the result.
/// The picture is unbiased, whatever the guide expects.
///
/// `throughput`: luminance of the path's, as it reaches the vertex. `radiance`: luminance that the guide
/// expects to leave the vertex toward the path's origin, W/(m² sr). exitance_cache_view::radiance() has it,
/// negative where it is not known. `pixel`: an estimate of the pixel's luminance, such as its mean so far, or
/// a blurred one. The result is 1 where one of them is NaN, infinite or negative, or `pixel` is 0.
WFPG_HD inline float guided_survival(float throughput, float radiance, float pixel,
                                     const roulette_window& window = {}) {
  const float expected = throughput * radiance;
  const bool known =
      is_finite(expected) && throughput >= 0.0f && radiance >= 0.0f && is_finite(pixel) && pixel > 0.0f;
  if (!known) return 1.0f;
  return clamp(0.5f * (1.0f + window.width) * expected / pixel, window.least, 1.0f);
}

}  // namespace wfpg
