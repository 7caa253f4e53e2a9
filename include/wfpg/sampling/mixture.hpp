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

/// Fraction of a narrow part's directions that a guide draws: guided_part() of `fraction`, and nothing of
/// delta lobes.
WFPG_HD inline float narrow_fraction(float fraction, float alpha, float resolved_alpha) {
  return alpha > 0.0f ? fraction * guided_part(alpha, resolved_alpha) : 0.0f;
}
/// Fraction of a surface's directions that a guide draws: the mean of narrow_fraction() and `fraction`, which
/// the rest of the BSDF has.
WFPG_HD inline float guided_fraction(float fraction, const glossy_part& part, float resolved_alpha) {
  return fraction + part.fraction * (narrow_fraction(fraction, part.alpha, resolved_alpha) - fraction);
}

/// Mixture of a field and a BSDF that only the host's kernel knows. The host samples and evaluates its BSDF.
/// The mixture chooses who draws, draws the guide's directions, and has the density of both:
///
///   const auto mixture = view.mixture(ray, wfpg::glossy_part::unknown(bsdf.pdf(wo, mirrored)));
///   if (mixture.choose(u)) {                       // u is a fresh random number afterwards
///     wi = mixture.sample(u2);
///     pdf = mixture.pdf(wi, bsdf.pdf(wo, wi));
///   } else {
///     drawn = bsdf.sample(wo, u, u2);              // where it fails, the path ends
///     wi = drawn.wi;
///     pdf = drawn.is_delta ? mixture.delta_pdf(drawn.pdf) : mixture.pdf(wi, drawn.pdf);
///   }
///
/// The throughput is then multiplied with f |cos| / pdf, as with a BSDF alone.
///
/// **Estimated densities.** Layered BSDFs estimate their density at random. The result is unbiased where
/// `bsdf_pdf` is estimated after the direction is known, alike whoever drew it, and independently of the
/// estimate of f. For a direction of the BSDF's, f is the sample's own f / pdf times that new estimate. The
/// sample's own pdf may not be used: it depends on how the direction came about.
///
/// Trivially copyable. A default mixture leaves all directions to the BSDF.
template <class Field>
struct basic_kernel_mixture {
  Field field;  ///< the guide's density over directions; not read where `fraction` is 0
  /// Probability of the guide on this surface, in [0, 1], with narrow lobes considered.
  float fraction = 0.0f;
  /// Number of the field, for path_recorder_view::scatter(), or no_field.
  std::uint32_t number = no_field;
  /// Part of the field's own fraction that narrow lobes leave it here, in [0, 1].
  float kept = 1.0f;

  /// Returns whether the guide draws the direction; else the BSDF does. `u`: uniform in [0, 1). It becomes
  /// another such number, which does not depend on the choice.
  WFPG_HD bool choose(float& u) const {
    constexpr float below_one = 1.0f - 0x1p-24f;
    const bool guided = u < fraction;
    u = min(guided ? u / fraction : (u - fraction) / (1.0f - fraction), below_one);
    return guided;
  }
  /// Draws a direction of unit length from the guide. `u`: in [0, 1)². O(log F). Precondition: choose()
  /// returned true.
  WFPG_HD vec3 sample(vec2 u) const { return field.sample(u); }

  /// Density of the mixture at a unit direction, per steradian. `bsdf_pdf`: the BSDF's own density there, of
  /// all lobes that are not delta. One that is NaN, infinite or negative counts as 0.
  WFPG_HD float pdf(vec3 direction, float bsdf_pdf) const {
    const float of_bsdf = (1.0f - fraction) * sound_density(bsdf_pdf);
    return fraction > 0.0f ? guided_pdf(direction) + of_bsdf : of_bsdf;
  }
  /// The guide's term of the density, per steradian. Precondition: `fraction` is positive.
  WFPG_HD float guided_pdf(vec3 direction) const { return fraction * field.pdf(direction); }
  /// The guide's share of a density that pdf() returned for a direction, for path_recorder_view::scatter().
  /// The field's fraction learns from it. It evaluates the field once more. Of a delta lobe it means nothing.
  WFPG_HD guide_share share(vec3 direction, float pdf) const {
    return fraction > 0.0f ? guide_share::of(guided_pdf(direction), pdf, kept) : guide_share();
  }
  /// Probability with which the BSDF is chosen and draws a delta lobe. `probability`: the lobe's own, in the
  /// BSDF.
  WFPG_HD float delta_pdf(float probability) const { return (1.0f - fraction) * probability; }

  /// Returns a density, or 0 where it is NaN, infinite or negative.
  WFPG_HD static float sound_density(float density) {
    return is_finite(density) && density > 0.0f ? density : 0.0f;
  }
};

/// Mixture of a field and a BSDF in a host's kernel.
using kernel_mixture = basic_kernel_mixture<directional_field>;

/// Mixture of a surface's BSDF and a field or product. It draws from the field with probability `fraction`,
/// and less often on narrow lobes. It draws from the BSDF alone where the field is empty, `fraction` is 0, or
/// the BSDF is delta. `Field` is a directional_field or product_field.
template <class Field>
struct basic_guide_mixture {
  Field field;  ///< the guide's density over directions; may be empty
  /// Probability of the field, in [0, 1], before narrow lobes reduce it. With 1 the result is unbiased only
  /// where the field is positive wherever the BSDF is.
  float fraction = 0.0f;
  /// Number of the field, which sampled directions carry in sampled_direction::field.
  std::uint32_t number = no_field;
  /// Probability of the field on narrow surfaces (guide_share), in [0, 1], before their lobes reduce it. One
  /// below 0 stands for `fraction`.
  float narrow = -1.0f;

  /// Returns the mixture for kernels that sample and evaluate their BSDF themselves. `part`: what the host
  /// knows of its narrow lobes.
  WFPG_HD basic_kernel_mixture<Field> with(const glossy_part& part) const {
    if (!guides()) return {};
    const float resolved = field.resolved_alpha();
    const float kept = guided_fraction(1.0f, part, resolved);
    return {field, guided_fraction(fraction_at(kept), part, resolved), number, kept};
  }

  /// Draws a direction at a surface, with the mixture's density. `u_technique` in [0, 1) chooses the
  /// technique, u in [0, 1)² the direction. Technique `none` is returned where the BSDF's sampling fails. It
  /// fails where the direction or density is not finite, or the density is not positive. Technique `delta`
  /// is returned for a delta lobe, with its probability in the mixture. O(log F) and the BSDF.
  template <class Bsdf>
  WFPG_HD sampled_direction sample(const surface<Bsdf>& s, float u_technique, vec2 u) const {
    // A delta lobe has no density per steradian, so no mixture can contain it.
    if (s.bsdf.is_delta()) return from_bsdf(s.bsdf.sample(s.outgoing, u), true);
    if (!guides()) return from_bsdf(s.bsdf.sample(s.outgoing, u), false);
    float kept;
    const mixture_fractions parts = fractions_of(s, kept);
    const kernel_mixture_type mixture{field, parts.guide, number};
    float rescaled = u_technique;
    sampled_direction result;
    result.field = number;
    float of_field;
    if (mixture.choose(rescaled)) {
      result.direction = field.sample(u, of_field);
      result.technique = sampling_technique::guide;
    } else {
      // The technique's number chooses among three intervals: the guide's, the narrow part's, the rest's.
      // Where there is no rest, rounding must not choose it.
      const bool is_narrow = u_technique < parts.guide + parts.glossy || !(parts.smooth > 0.0f);
      const bsdf_sample drawn = draw(s, is_narrow, u);
      // The whole sample fails: drawing again from the guide would change the density.
      if (!is_drawn(drawn)) return {};
      if (drawn.is_delta)
        return {drawn.direction, part_probability<Bsdf>(parts, is_narrow) * drawn.pdf,
                sampling_technique::delta, guide_share(), no_field};
      result.direction = drawn.direction;
      result.technique = sampling_technique::bsdf;
      of_field = field.pdf(drawn.direction);
    }
    // All techniques' densities count, whichever drew the direction. This is one-sample MIS with the balance
    // heuristic, so the estimate's weight is simply value / pdf. A GPU's threads are together again here.
    const float of_guide = parts.guide * of_field;
    result.pdf = of_guide + bsdf_pdf(s, parts, result.direction);
    result.share = guide_share::of(of_guide, result.pdf, kept);
    return result;
  }

  /// Density with which sample() draws a unit direction, per steradian, delta lobes aside. It is 0 on delta
  /// BSDFs, and for a direction that is not finite. It is never NaN, infinite or negative: a BSDF's density
  /// that is counts as 0.
  template <class Bsdf>
  WFPG_HD float pdf(const surface<Bsdf>& s, vec3 direction) const {
    if (s.bsdf.is_delta() || !is_finite(direction)) return 0.0f;
    if (!guides()) return kernel_mixture_type::sound_density(s.bsdf.pdf(s.outgoing, direction));
    const mixture_fractions parts = fractions_of(s);
    return parts.guide * field.pdf(direction) + bsdf_pdf(s, parts, direction);
  }

  /// Probabilities of the guide and of the BSDF's parts at a surface. A BSDF without glossy() gives
  /// `fraction` to the guide and the rest to itself. Precondition: the field is not empty.
  template <class Bsdf>
  WFPG_HD mixture_fractions fractions_of(const surface<Bsdf>& s) const {
    float kept;
    return fractions_of(s, kept);
  }

 private:
  using kernel_mixture_type = basic_kernel_mixture<Field>;

  /// Fraction of a surface that leaves the guide a part `kept` of it, before that reduces it.
  WFPG_HD float fraction_at(float kept) const {
    const bool is_narrow = kept < guide_share::least_smooth;
    return is_narrow && narrow >= 0.0f ? narrow : fraction;
  }

  /// fractions_of(), and the part of its fraction that the surface leaves the guide.
  template <class Bsdf>
  WFPG_HD mixture_fractions fractions_of(const surface<Bsdf>& s, float& kept) const {
    kept = 1.0f;
    if constexpr (!has_glossy_part_v<Bsdf>)
      return {fraction, 0.0f, 1.0f - fraction};
    else {
      const glossy_part part = s.bsdf.glossy(s.outgoing);
      const float resolved = field.resolved_alpha();
      kept = guided_fraction(1.0f, part, resolved);
      const float of_all = fraction_at(kept);
      const float guide = guided_fraction(of_all, part, resolved);
      if constexpr (!has_separate_parts_v<Bsdf>)
        return {guide, 0.0f, 1.0f - guide};
      else {
        // Each part of the BSDF keeps what the guide leaves of it. The three sum to 1.
        const float on_narrow = narrow_fraction(of_all, part.alpha, resolved);
        return {guide, part.fraction * (1.0f - on_narrow), (1.0f - part.fraction) * (1.0f - of_all)};
      }
    }
  }

  /// Whether directions may come from the field. It is false for a product that is black everywhere.
  WFPG_HD bool guides() const { return fraction > 0.0f && !field.empty(); }

  /// Whether a BSDF drew a direction that a path can take.
  WFPG_HD static bool is_drawn(const bsdf_sample& drawn) {
    return kernel_mixture_type::sound_density(drawn.pdf) > 0.0f && is_finite(drawn.direction);
  }

  /// Result of a BSDF that is sampled alone. It names no field: there was none to choose.
  WFPG_HD static sampled_direction from_bsdf(const bsdf_sample& drawn, bool all_delta) {
    if (!is_drawn(drawn)) return {};
    const bool is_delta = all_delta || drawn.is_delta;
    return {drawn.direction, drawn.pdf, is_delta ? sampling_technique::delta : sampling_technique::bsdf,
            guide_share(), no_field};
  }

  /// Draws from the BSDF, from the part that was chosen where its parts can be drawn alone.
  template <class Bsdf>
  WFPG_HD static bsdf_sample draw(const surface<Bsdf>& s, bool is_narrow, vec2 u) {
    // Only a BSDF with sample_part() can be asked for one lobe; `is_narrow` means nothing to others.
    if constexpr (has_separate_parts_v<Bsdf>)
      return s.bsdf.sample_part(is_narrow, s.outgoing, u);
    else
      return s.bsdf.sample(s.outgoing, u);
  }
  /// Probability of what draw() drew from: one part, or all of the BSDF.
  template <class Bsdf>
  WFPG_HD static float part_probability(const mixture_fractions& parts, bool is_narrow) {
    return has_separate_parts_v<Bsdf> && is_narrow ? parts.glossy : parts.smooth;
  }

  /// The BSDF's term of the mixture's density. A part that is never drawn is not evaluated.
  template <class Bsdf>
  WFPG_HD static float bsdf_pdf(const surface<Bsdf>& s, const mixture_fractions& parts, vec3 direction) {
    if constexpr (has_separate_parts_v<Bsdf>)
      return part_pdf(s, true, parts.glossy, direction) + part_pdf(s, false, parts.smooth, direction);
    else
      return parts.smooth * kernel_mixture_type::sound_density(s.bsdf.pdf(s.outgoing, direction));
  }
  /// Density of one part, weighted with its probability.
  template <class Bsdf>
  WFPG_HD static float part_pdf(const surface<Bsdf>& s, bool is_narrow, float probability, vec3 direction) {
    if (!(probability > 0.0f)) return 0.0f;
    return probability *
           kernel_mixture_type::sound_density(s.bsdf.pdf_part(is_narrow, s.outgoing, direction));
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
