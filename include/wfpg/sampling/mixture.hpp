// The one-sample mixture of a BSDF and a guide, which is a field or a product. Its density is always that of
// the whole mixture (paper, sections 3.5, 3.6 and 4, "Multiple Importance Sampling"). The paper does not
// guide glossy parts less; wfpg does.
//
// With the three fractions g, n and w of guide, narrow and wide part, the density of a direction is
//   g p_guide + n p_narrow + w p_wide.
//
// Cost: a direction takes O(log F) and the BSDF, a density the field's and the BSDF's. No memory of its own.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/sampling/field_sampler.hpp>
#include <wfpg/sampling/product_sampler.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

namespace wfpg {

/// Probabilities of what a mixture draws from; their sum is 1. A BSDF whose parts cannot be drawn alone is
/// all `smooth`.
struct mixture_fractions {
  float guide = 0.0f;   ///< of the field or product
  float glossy = 0.0f;  ///< of the BSDF's narrow part
  float smooth = 1.0f;  ///< of the rest of the BSDF
};

/// How much of its fraction the guide keeps on a glossy part of GGX roughness `alpha`, in [1/4, 1]. With w =
/// min(alpha / resolved_alpha, 1), it is 1/4 + 3/4 w². A guide cannot resolve lobes narrower than
/// `resolved_alpha`, so most of their directions come from the BSDF. A mirror's lobe leaves 1/4. `alpha` is
/// at least 0, `resolved_alpha` positive: that of directional_field or product_field.
WFPG_HD inline float guided_part(float alpha, float resolved_alpha) {
  const float width = min(alpha / resolved_alpha, 1.0f);
  return 0.25f + 0.75f * width * width;
}

/// Mixture of a surface's BSDF and a field or product. It draws from the field with probability `fraction`,
/// and less often on glossy parts. It draws from the BSDF alone where the field is empty, `fraction` is 0, or
/// the BSDF is delta. `Field` is a directional_field or product_field.
template <class Field>
struct basic_guide_mixture {
  Field field;  ///< the guide's density over directions; may be empty
  /// Probability of the field, in [0, 1], before glossy parts reduce it. With 1 the result is unbiased only
  /// where the field is positive wherever the BSDF is.
  float fraction = 0.0f;
  /// Number of the field, which sampled directions carry in sampled_direction::field.
  std::uint32_t number = no_field;

  /// Draws a direction at a surface, with the mixture's density. `u_technique` in [0, 1) chooses the
  /// technique, u in [0, 1)² the direction. Technique `none` is returned where the BSDF's sampling fails. It
  /// fails where the direction or density is not finite, or the density is not positive. O(log F) and the
  /// BSDF.
  template <class Bsdf>
  WFPG_HD sampled_direction sample(const surface<Bsdf>& s, float u_technique, vec2 u) const {
    // A delta lobe has no density per steradian, so no mixture can contain it.
    if (s.bsdf.is_delta()) return from_bsdf(s.bsdf.sample(s.outgoing, u), sampling_technique::delta);
    if (!guides()) return from_bsdf(s.bsdf.sample(s.outgoing, u), sampling_technique::bsdf);
    const mixture_fractions shares = fractions_of(s);
    sampled_direction result;
    result.field = number;
    float of_field;
    if (u_technique < shares.guide) {
      result.direction = field.sample(u, of_field);
      result.technique = sampling_technique::guide;
    } else {
      // The technique's number chooses among three intervals: the guide's, the glossy part's, the smooth
      // part's.
      const bsdf_sample drawn = draw(s, u_technique < shares.guide + shares.glossy, u);
      // The whole sample fails: drawing again from the guide would change the density.
      if (!is_drawn(drawn)) return {};
      result.direction = drawn.direction;
      result.technique = sampling_technique::bsdf;
      of_field = field.pdf(drawn.direction);
    }
    // All techniques' densities count, whichever drew the direction. This is one-sample MIS with the balance
    // heuristic, so the estimate's weight is simply value / pdf.
    result.pdf = shares.guide * of_field + bsdf_pdf(s, shares, result.direction);
    return result;
  }

  /// Density with which sample() draws a unit direction, per steradian. It is 0 on delta BSDFs, and for a
  /// direction that is not finite. It is never NaN, infinite or negative: a BSDF's density that is counts as
  /// 0.
  template <class Bsdf>
  WFPG_HD float pdf(const surface<Bsdf>& s, vec3 direction) const {
    if (s.bsdf.is_delta() || !is_finite(direction)) return 0.0f;
    if (!guides()) return sound(s.bsdf.pdf(s.outgoing, direction));
    const mixture_fractions shares = fractions_of(s);
    return shares.guide * field.pdf(direction) + bsdf_pdf(s, shares, direction);
  }

  /// Probabilities of the guide and of the BSDF's parts at a surface. A BSDF without glossy() gives
  /// `fraction` to the guide and the rest to itself. Precondition: the field is not empty.
  template <class Bsdf>
  WFPG_HD mixture_fractions fractions_of(const surface<Bsdf>& s) const {
    if constexpr (!has_glossy_part_v<Bsdf>)
      return {fraction, 0.0f, 1.0f - fraction};
    else {
      const glossy_part part = s.bsdf.glossy(s.outgoing);
      // The guide's fraction on the glossy part alone, and then averaged over both parts.
      const float less = fraction * guided_part(part.alpha, field.resolved_alpha());
      const float guide = fraction + part.share * (less - fraction);
      if constexpr (!has_separate_parts_v<Bsdf>)
        return {guide, 0.0f, 1.0f - guide};
      else
        // Each part of the BSDF keeps what the guide leaves of it. The three sum to 1.
        return {guide, part.share * (1.0f - less), (1.0f - part.share) * (1.0f - fraction)};
    }
  }

 private:
  /// Whether directions may come from the field. It is false for a product that is black everywhere.
  WFPG_HD bool guides() const { return fraction > 0.0f && !field.empty(); }

  /// The density, or 0 where it is NaN, infinite or negative.
  WFPG_HD static float sound(float density) { return is_finite(density) && density > 0.0f ? density : 0.0f; }
  /// Whether a BSDF drew a direction that a path can take.
  WFPG_HD static bool is_drawn(const bsdf_sample& drawn) {
    return sound(drawn.pdf) > 0.0f && is_finite(drawn.direction);
  }

  /// Result of a BSDF that is sampled alone. It names no field: there was none to choose.
  WFPG_HD static sampled_direction from_bsdf(const bsdf_sample& drawn, sampling_technique technique) {
    if (!is_drawn(drawn)) return {};
    return {drawn.direction, drawn.pdf, technique, no_field};
  }

  /// Draws from the BSDF, from the part that was chosen where its parts can be drawn alone.
  template <class Bsdf>
  WFPG_HD static bsdf_sample draw(const surface<Bsdf>& s, bool glossy, vec2 u) {
    // Only a BSDF with sample_part() can be asked for one lobe; `glossy` means nothing to others.
    if constexpr (has_separate_parts_v<Bsdf>)
      return s.bsdf.sample_part(glossy, s.outgoing, u);
    else
      return s.bsdf.sample(s.outgoing, u);
  }

  /// The BSDF's term of the mixture's density. A part that is never drawn is not evaluated.
  template <class Bsdf>
  WFPG_HD static float bsdf_pdf(const surface<Bsdf>& s, const mixture_fractions& shares, vec3 direction) {
    if constexpr (has_separate_parts_v<Bsdf>)
      return part_pdf(s, true, shares.glossy, direction) + part_pdf(s, false, shares.smooth, direction);
    else
      return shares.smooth * sound(s.bsdf.pdf(s.outgoing, direction));
  }
  /// Density of one part, weighted with its probability `share`.
  template <class Bsdf>
  WFPG_HD static float part_pdf(const surface<Bsdf>& s, bool glossy, float share, vec3 direction) {
    return share > 0.0f ? share * sound(s.bsdf.pdf_part(glossy, s.outgoing, direction)) : 0.0f;
  }
};

/// Mixture of a BSDF and a field, the paper's section 3.5.
using guide_mixture = basic_guide_mixture<directional_field>;
/// Mixture of a BSDF and a product, section 3.6 of the paper. `fraction` must be below 1: a product may be 0
/// where the BSDF is not, and there the BSDF has to draw.
using product_mixture = basic_guide_mixture<product_field>;

/// Base class that gives a guide's view (guide.hpp) sample() and pdf(). `View` derives from it and has
///   auto mixture(std::uint32_t ray, const surface<Bsdf>& s) const;
/// which returns a mixture with `sample` and `pdf` as basic_guide_mixture has them. Where a ray needs both a
/// direction and a density, call mixture() once and use its result twice.
template <class View>
class mixture_view {
 public:
  /// Draws a direction for a ray from the mixture with the surface's BSDF. `ray`: index in the wave.
  /// `u_technique` is in [0, 1), u in [0, 1)².
  template <class Bsdf>
  WFPG_HD sampled_direction sample(std::uint32_t ray, const surface<Bsdf>& s, float u_technique,
                                   vec2 u) const {
    return view().mixture(ray, s).sample(s, u_technique, u);
  }
  /// Density of the mixture at a unit direction, per steradian.
  template <class Bsdf>
  WFPG_HD float pdf(std::uint32_t ray, const surface<Bsdf>& s, vec3 direction) const {
    return view().mixture(ray, s).pdf(s, direction);
  }

 private:
  /// The class that derives from this one.
  WFPG_HD const View& view() const { return static_cast<const View&>(*this); }
};

}  // namespace wfpg
