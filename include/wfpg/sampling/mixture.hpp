// The one-sample mixture of a BSDF and a guide, a field or a product, whose density is always the whole
// mixture's (paper, sections 3.5, 3.6 and 4, "Multiple Importance Sampling"). That glossy parts are guided
// less is wfpg's own.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/sampling/field_sampler.hpp>
#include <wfpg/sampling/product_sampler.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

namespace wfpg {

/// The shares of what a mixture draws from; their sum is 1. A BSDF whose parts cannot be drawn alone is all
/// `smooth`.
struct mixture_shares {
  float guide = 0.0f;   ///< of the field or product
  float glossy = 0.0f;  ///< of the BSDF's narrow part
  float smooth = 1.0f;  ///< of the rest of the BSDF
};

/// How much of its share a glossy part of GGX roughness `alpha` leaves to a guide: all where the lobe is as
/// wide as what the guide resolves, directional_field::resolved_alpha() or product_field::resolved_alpha(); a
/// quarter where it is a mirror's, of which the guide knows nothing.
WFPG_HD inline float guided_part(float alpha, float resolved_alpha) {
  const float width = min(alpha / resolved_alpha, 1.0f);
  return 0.25f + 0.75f * width * width;
}

/// The mixture of a field, or of its product with the BSDF, and a surface's BSDF: the field with probability
/// `fraction`, in [0, 1], and less on glossy parts. With an empty field, and on delta BSDFs, the BSDF alone.
template <class Field>
struct basic_guide_mixture {
  Field field;                      ///< a directional_field or product_field
  float fraction = 0.0f;            ///< of guided samples, before glossy parts take theirs
  std::uint32_t number = no_field;  ///< of the field, which directions carry with them

  /// A direction from a number in [0,1) that chooses the technique and u in [0,1)². O(log F) and the BSDF.
  /// What a BSDF draws with a direction or density that is not finite is a sample that failed.
  template <class Bsdf>
  WFPG_HD sampled_direction sample(const surface<Bsdf>& s, float u_technique, vec2 u) const {
    if (s.bsdf.is_delta()) return from_bsdf(s.bsdf.sample(s.outgoing, u), sampling_technique::delta);
    if (!guides()) return from_bsdf(s.bsdf.sample(s.outgoing, u), sampling_technique::bsdf);
    const mixture_shares shares = shares_of(s);
    sampled_direction result;
    result.field = number;
    float of_field;
    if (u_technique < shares.guide) {
      result.direction = field.sample(u, of_field);
      result.technique = sampling_technique::guide;
    } else {
      const bsdf_sample drawn = draw(s, u_technique < shares.guide + shares.glossy, u);
      if (!is_drawn(drawn)) return {};
      result.direction = drawn.direction;
      result.technique = sampling_technique::bsdf;
      of_field = field.pdf(drawn.direction);
    }
    result.pdf = shares.guide * of_field + bsdf_pdf(s, shares, result.direction);
    return result;
  }

  /// The density with which sample() draws a unit direction, per steradian; 0 on delta BSDFs, and of a
  /// direction that is not finite. Never NaN, infinite or negative: where the BSDF's is, it counts as 0.
  template <class Bsdf>
  WFPG_HD float pdf(const surface<Bsdf>& s, vec3 direction) const {
    if (s.bsdf.is_delta() || !is_finite(direction)) return 0.0f;
    if (!guides()) return sound(s.bsdf.pdf(s.outgoing, direction));
    const mixture_shares shares = shares_of(s);
    return shares.guide * field.pdf(direction) + bsdf_pdf(s, shares, direction);
  }

  /// What the mixture draws from at a surface. Precondition: the field is not empty.
  template <class Bsdf>
  WFPG_HD mixture_shares shares_of(const surface<Bsdf>& s) const {
    if constexpr (!has_glossy_part_v<Bsdf>)
      return {fraction, 0.0f, 1.0f - fraction};
    else {
      const glossy_part part = s.bsdf.glossy(s.outgoing);
      const float less = fraction * guided_part(part.alpha, field.resolved_alpha());
      const float guide = fraction + part.share * (less - fraction);
      if constexpr (!has_separate_parts_v<Bsdf>)
        return {guide, 0.0f, 1.0f - guide};
      else
        return {guide, part.share * (1.0f - less), (1.0f - part.share) * (1.0f - fraction)};
    }
  }

 private:
  WFPG_HD bool guides() const { return fraction > 0.0f && !field.empty(); }

  WFPG_HD static float sound(float density) { return is_finite(density) && density > 0.0f ? density : 0.0f; }
  WFPG_HD static bool is_drawn(const bsdf_sample& drawn) {
    return sound(drawn.pdf) > 0.0f && is_finite(drawn.direction);
  }

  WFPG_HD static sampled_direction from_bsdf(const bsdf_sample& drawn, sampling_technique technique) {
    if (!is_drawn(drawn)) return {};
    return {drawn.direction, drawn.pdf, technique, no_field};
  }

  template <class Bsdf>
  WFPG_HD static bsdf_sample draw(const surface<Bsdf>& s, bool glossy, vec2 u) {
    if constexpr (has_separate_parts_v<Bsdf>)
      return s.bsdf.sample_part(glossy, s.outgoing, u);
    else
      return s.bsdf.sample(s.outgoing, u);
  }

  /// The BSDF's share of the density. A part that is never drawn is not asked.
  template <class Bsdf>
  WFPG_HD static float bsdf_pdf(const surface<Bsdf>& s, const mixture_shares& shares, vec3 direction) {
    if constexpr (has_separate_parts_v<Bsdf>)
      return part_pdf(s, true, shares.glossy, direction) + part_pdf(s, false, shares.smooth, direction);
    else
      return shares.smooth * sound(s.bsdf.pdf(s.outgoing, direction));
  }
  template <class Bsdf>
  WFPG_HD static float part_pdf(const surface<Bsdf>& s, bool glossy, float share, vec3 direction) {
    return share > 0.0f ? share * sound(s.bsdf.pdf_part(glossy, s.outgoing, direction)) : 0.0f;
  }
};

/// A field and a BSDF.
using guide_mixture = basic_guide_mixture<directional_field>;
/// A product and a BSDF. `fraction` below 1: where a product is 0 and the BSDF is not, the BSDF has to draw.
using product_mixture = basic_guide_mixture<product_field>;

/// What a guide's view (guide.hpp) derives from that says what each ray draws from at a surface:
///   auto mixture(std::uint32_t ray, const surface<Bsdf>& s) const;
/// with `sample` and `pdf` as basic_guide_mixture has them. It is made once for a ray of which both a
/// direction and a density are wanted.
template <class View>
class mixture_view {
 public:
  /// A direction of the mixture with the surface's BSDF, and the mixture's density.
  template <class Bsdf>
  WFPG_HD sampled_direction sample(std::uint32_t ray, const surface<Bsdf>& s, float u_technique,
                                   vec2 u) const {
    return view().mixture(ray, s).sample(s, u_technique, u);
  }
  /// The mixture's density of a unit direction, per steradian.
  template <class Bsdf>
  WFPG_HD float pdf(std::uint32_t ray, const surface<Bsdf>& s, vec3 direction) const {
    return view().mixture(ray, s).pdf(s, direction);
  }

 private:
  WFPG_HD const View& view() const { return static_cast<const View&>(*this); }
};

}  // namespace wfpg
