// Multiple importance sampling: Veach's heuristics, and the one-sample mixture of a BSDF and a guide whose
// density is always the whole mixture's (paper, sections 3.5 and 4, "Multiple Importance Sampling").
#pragma once

#include <wfpg/bsdf.hpp>
#include <wfpg/field_sampler.hpp>
#include <wfpg/types.hpp>

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

/// What drew a direction.
enum class sampling_technique : std::uint32_t {
  none,   ///< nothing: the ray is inactive, or sampling failed; the path ends
  bsdf,   ///< the BSDF, of a mixture or alone
  guide,  ///< the guide's field
  delta,  ///< a delta BSDF: pdf is its lobe's probability
};

/// The next direction of a path.
struct sampled_direction {
  vec3 direction{0.0f};  ///< unit length, away from the surface
  float pdf = 0.0f;  ///< of the whole mixture, per steradian; of a delta lobe its probability; 0 with none
  sampling_technique technique = sampling_technique::none;
};

/// The mixture of a field and a surface's BSDF: the field with probability `fraction`, in [0, 1]. With an
/// empty field, and on delta BSDFs, the BSDF alone.
struct guide_mixture {
  directional_field field;
  float fraction = 0.0f;

  /// A direction from a number in [0,1) that chooses the technique and u in [0,1)². O(log F) and the BSDF.
  template <class Bsdf>
  WFPG_HD sampled_direction sample(const surface<Bsdf>& s, float u_technique, vec2 u) const {
    if (s.bsdf.is_delta()) return from_bsdf(s, u, sampling_technique::delta);
    if (!guides() || u_technique >= fraction) {
      sampled_direction result = from_bsdf(s, u, sampling_technique::bsdf);
      if (guides() && result.pdf > 0.0f) result.pdf = pdf(s, result.direction);
      return result;
    }
    float from_field;
    const vec3 direction = field.sample(u, from_field);
    return {direction, mixed(from_field, s.bsdf.pdf(s.outgoing, direction)), sampling_technique::guide};
  }

  /// The density with which sample() draws a unit direction, per steradian; 0 on delta BSDFs.
  template <class Bsdf>
  WFPG_HD float pdf(const surface<Bsdf>& s, vec3 direction) const {
    if (s.bsdf.is_delta()) return 0.0f;
    const float from_bsdf = s.bsdf.pdf(s.outgoing, direction);
    return guides() ? mixed(field.pdf(direction), from_bsdf) : from_bsdf;
  }

 private:
  WFPG_HD float mixed(float from_field, float from_bsdf) const {
    return fraction * from_field + (1.0f - fraction) * from_bsdf;
  }
  WFPG_HD bool guides() const { return fraction > 0.0f && !field.empty(); }

  template <class Bsdf>
  WFPG_HD static sampled_direction from_bsdf(const surface<Bsdf>& s, vec2 u, sampling_technique technique) {
    const bsdf_sample drawn = s.bsdf.sample(s.outgoing, u);
    if (!(drawn.pdf > 0.0f)) return {};
    return {drawn.direction, drawn.pdf, technique};
  }
};

}  // namespace wfpg
