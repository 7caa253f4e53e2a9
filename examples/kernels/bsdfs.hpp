// The host's BSDFs. Each exists only inside the kernel of its material. Directions are in the surface's
// frame, z along the shading normal. A BSDF has
//   spectrum value(wo, wi, numbers)            f |cos| without delta lobes; may be an estimate
//   float density(wo, wi, numbers)             of draw(), per steradian, without delta lobes; may be one
//   drawn_direction draw(wo, u, u2, numbers)   u chooses a lobe, u2 draws from it
//   is_delta                                   all its lobes are
// What only the layered one draws at random comes from `numbers`. That of value() and density() is
// independent.
#pragma once

#include "materials/microfacet.hpp"
#include "spectrum.hpp"

namespace kernels {

using render::fresnel_dielectric;
using render::ggx;
using render::material_kind;
using render::mirrored;
using render::pi;

/// Inputs of a BSDF: all that a material's kernel knows of a hit.
struct lobe_inputs {
  spectrum colour{0.0f};
  float alpha = 0.1f;  ///< GGX roughness
  float ior = 1.5f;    ///< inside over outside

  /// Index beyond the boundary over that on the side of `w`.
  KERNELS_BOTH float eta(vec3 w) const { return w.z < 0.0f ? 1.0f / ior : ior; }
};

/// `w` as a mirror reflects it.
KERNELS_BOTH inline vec3 flipped(vec3 w) {
  return {-w.x, -w.y, w.z};
}

/// 1 above the surface, and -1 below.
KERNELS_BOTH inline float side_of(vec3 w) {
  return w.z < 0.0f ? -1.0f : 1.0f;
}

struct drawn_direction {
  vec3 wi{0.0f};
  spectrum weight{0.0f};  ///< f |cos| over the density, or over a delta lobe's probability; 0: drawing failed
  float pdf = 0.0f;       ///< of a delta lobe its probability; else not yet known, ask density()
  bool is_delta = false;
};

KERNELS_BOTH inline bool both_above(vec3 wo, vec3 wi) {
  return wo.z > 0.0f && wi.z > 0.0f;
}

/// The direction `wi` that a BSDF drew, with its weight.
template <class Bsdf, class Numbers>
KERNELS_BOTH drawn_direction weighted(const Bsdf& bsdf, vec3 wo, vec3 wi, Numbers& n) {
  const float pdf = bsdf.density(wo, wi, n);
  return pdf > 0.0f ? drawn_direction{wi, bsdf.value(wo, wi, n) / pdf} : drawn_direction{};
}

struct matte {
  static constexpr material_kind kind = material_kind::lambert;
  static constexpr bool is_delta = false;
  lobe_inputs in;

  template <class Numbers>
  KERNELS_BOTH spectrum value(vec3 wo, vec3 wi, Numbers& n) const {
    return in.colour * density(wo, wi, n);
  }
  template <class Numbers>
  KERNELS_BOTH float density(vec3 wo, vec3 wi, Numbers&) const {
    return both_above(wo, wi) ? wi.z / pi : 0.0f;
  }
  template <class Numbers>
  KERNELS_BOTH drawn_direction draw(vec3 wo, float, vec2 u2, Numbers&) const {
    return {render::cosine_hemisphere(u2), wo.z > 0.0f ? in.colour : spectrum(0.0f)};
  }
};

/// Metal of GGX facets.
struct metal {
  static constexpr material_kind kind = material_kind::conductor;
  static constexpr bool is_delta = false;
  lobe_inputs in;

  template <class Numbers>
  KERNELS_BOTH spectrum value(vec3 wo, vec3 wi, Numbers&) const {
    if (!both_above(wo, wi)) return spectrum(0.0f);
    const vec3 h = glm::normalize(wo + wi);
    return render::fresnel_schlick(in.colour, glm::dot(wo, h)) * ggx{in.alpha}.eval(wo, wi, h);
  }
  template <class Numbers>
  KERNELS_BOTH float density(vec3 wo, vec3 wi, Numbers&) const {
    return both_above(wo, wi) ? ggx{in.alpha}.pdf(wo, glm::normalize(wo + wi)) : 0.0f;
  }
  template <class Numbers>
  KERNELS_BOTH drawn_direction draw(vec3 wo, float, vec2 u2, Numbers& n) const {
    if (!(wo.z > 0.0f)) return {};
    const vec3 wi = mirrored(wo, ggx{in.alpha}.sample(wo, u2));
    return weighted(*this, wo, wi, n);
  }
};

/// Base of BSDFs that have delta lobes alone.
struct delta_lobes {
  template <class Numbers>
  KERNELS_BOTH spectrum value(vec3, vec3, Numbers&) const {
    return spectrum(0.0f);
  }
  template <class Numbers>
  KERNELS_BOTH float density(vec3, vec3, Numbers&) const {
    return 0.0f;
  }
};

struct mirror : delta_lobes {
  static constexpr material_kind kind = material_kind::mirror;
  static constexpr bool is_delta = true;
  lobe_inputs in;

  template <class Numbers>
  KERNELS_BOTH drawn_direction draw(vec3 wo, float, vec2, Numbers&) const {
    return {flipped(wo), wo.z > 0.0f ? in.colour : spectrum(0.0f), 1.0f, true};
  }
};

/// Smooth glass, whose normal points out of it.
struct glass : delta_lobes {
  static constexpr material_kind kind = material_kind::dielectric;
  static constexpr bool is_delta = true;
  lobe_inputs in;

  template <class Numbers>
  KERNELS_BOTH drawn_direction draw(vec3 wo, float u, vec2, Numbers&) const {
    const float side = side_of(wo), eta = in.eta(wo);
    const float reflected = fresnel_dielectric(side * wo.z, eta);
    if (u < reflected) return {flipped(wo), spectrum(1.0f), reflected, true};
    // Radiance is compressed where the index is larger.
    return {glm::normalize(render::refracted(wo, vec3(0.0f, 0.0f, side), eta)), in.colour / (eta * eta),
            1.0f - reflected, true};
  }
};

/// Glass of GGX facets, whose normal points out of it.
struct frosted_glass {
  static constexpr material_kind kind = material_kind::rough_dielectric;
  static constexpr bool is_delta = false;
  lobe_inputs in;

  template <class Numbers>
  KERNELS_BOTH spectrum value(vec3 wo, vec3 wi, Numbers&) const {
    const facet f(*this, wo, wi);
    if (!f.exists) return spectrum(0.0f);
    if (f.reflects) return spectrum(f.reflected * ggx{in.alpha}.eval(f.wo, f.wi, f.h));
    return in.colour * ((1.0f - f.reflected) * ggx{in.alpha}.eval_through(f.wo, f.wi, f.h, f.eta));
  }
  template <class Numbers>
  KERNELS_BOTH float density(vec3 wo, vec3 wi, Numbers&) const {
    const facet f(*this, wo, wi);
    if (!f.exists) return 0.0f;
    return f.reflects ? f.reflected * ggx{in.alpha}.pdf(f.wo, f.h)
                      : (1.0f - f.reflected) * ggx{in.alpha}.pdf_through(f.wo, f.wi, f.h, f.eta);
  }
  template <class Numbers>
  KERNELS_BOTH drawn_direction draw(vec3 wo, float u, vec2 u2, Numbers& n) const {
    const float side = side_of(wo), eta = in.eta(wo);
    const vec3 h = ggx{in.alpha}.sample(side * wo, u2);
    const bool reflects = u < fresnel_dielectric(glm::dot(side * wo, h), eta);
    const vec3 seen = reflects ? mirrored(side * wo, h) : render::refracted(side * wo, h, eta);
    if ((seen.z > 0.0f) != reflects) return {};  // a second facet would be in the way
    const vec3 wi = side * seen;
    return weighted(*this, wo, wi, n);
  }

 private:
  /// The facet that joins two directions, seen with `wo` above.
  struct facet {
    vec3 wo, wi, h{0.0f, 0.0f, 1.0f};
    float eta, reflected = 1.0f;
    bool reflects, exists = false;

    KERNELS_BOTH facet(const frosted_glass& of, vec3 from, vec3 to) {
      const float side = side_of(from);
      wo = side * from, wi = side * to, eta = of.in.eta(from);
      reflects = wi.z > 0.0f;
      vec3 sum = wo + (reflects ? 1.0f : eta) * wi;
      if (wo.z == 0.0f || wi.z == 0.0f || sum == vec3(0.0f)) return;
      h = glm::normalize(sum.z < 0.0f ? -sum : sum);
      const float outside = glm::dot(wo, h), inside = glm::dot(wi, h);
      exists = outside > 0.0f && (reflects || inside < 0.0f);
      if (exists)
        reflected = reflects ? fresnel_dielectric(outside, eta) : fresnel_dielectric(outside, -inside, eta);
    }
  };
};

/// A smooth coat over a diffuse base with metal flakes: a delta lobe, a narrow one and a wide one.
struct varnish {
  static constexpr material_kind kind = material_kind::smooth_plastic;
  static constexpr bool is_delta = false;
  static constexpr float flakes = 0.25f, flakes_alpha = 0.15f;  ///< part of the base, GGX roughness
  lobe_inputs in;

  /// The probability that draw() takes the coat.
  KERNELS_BOTH float coat(vec3 wo) const {
    return glm::clamp(fresnel_dielectric(glm::max(wo.z, 0.0f), in.ior), 0.1f, 0.9f);
  }
  /// The probability that draw() takes the coat or the flakes.
  KERNELS_BOTH float narrow(vec3 wo) const { return glm::mix(coat(wo), 1.0f, flakes); }

  template <class Numbers>
  KERNELS_BOTH spectrum value(vec3 wo, vec3 wi, Numbers& n) const {
    if (!both_above(wo, wi)) return spectrum(0.0f);
    const float passes =
        (1.0f - fresnel_dielectric(wo.z, in.ior)) * (1.0f - fresnel_dielectric(wi.z, in.ior));
    return passes * glm::mix(matte{in}.value(wo, wi, n), metal_flakes().value(wo, wi, n), flakes);
  }
  template <class Numbers>
  KERNELS_BOTH float density(vec3 wo, vec3 wi, Numbers& n) const {
    return (1.0f - coat(wo)) *
           glm::mix(matte{in}.density(wo, wi, n), metal_flakes().density(wo, wi, n), flakes);
  }
  template <class Numbers>
  KERNELS_BOTH drawn_direction draw(vec3 wo, float u, vec2 u2, Numbers& n) const {
    if (!(wo.z > 0.0f)) return {};
    const float of_coat = coat(wo);
    if (u < of_coat)
      return {flipped(wo), spectrum(fresnel_dielectric(wo.z, in.ior) / of_coat), of_coat, true};
    const bool is_flake = u < narrow(wo);
    const vec3 wi = is_flake ? metal_flakes().draw(wo, u, u2, n).wi : render::cosine_hemisphere(u2);
    return weighted(*this, wo, wi, n);
  }

 private:
  KERNELS_BOTH metal metal_flakes() const { return {{in.colour, flakes_alpha, in.ior}}; }
};

/// A diffuse base below a rough dielectric boundary. Light that passes the boundary is reflected between both
/// until it leaves. How much the boundary reflects depends on the facet that light meets, and how much the
/// base absorbs on the number of reflections. No closed form exists for either, so that both the value and
/// the density are estimates.
struct paint {
  static constexpr material_kind kind = material_kind::plastic;
  static constexpr bool is_delta = false;
  lobe_inputs in;

  template <class Numbers>
  KERNELS_BOTH spectrum value(vec3 wo, vec3 wi, Numbers& n) const {
    if (!both_above(wo, wi)) return spectrum(0.0f);
    const vec3 h = glm::normalize(wo + wi);
    const float of_facets = fresnel_dielectric(glm::dot(wo, h), in.ior) * ggx{in.alpha}.eval(wo, wi, h);
    return spectrum(of_facets) + below(passed(wo, n) * passed(wi, n), n) * (wi.z / pi);
  }
  template <class Numbers>
  KERNELS_BOTH float density(vec3 wo, vec3 wi, Numbers& n) const {
    if (!both_above(wo, wi)) return 0.0f;
    const vec3 h = glm::normalize(wo + wi);
    return fresnel_dielectric(glm::dot(wo, h), in.ior) * ggx{in.alpha}.pdf(wo, h) +
           passed(wo, n) * (wi.z / pi);
  }
  template <class Numbers>
  KERNELS_BOTH drawn_direction draw(vec3 wo, float u, vec2 u2, Numbers& n) const {
    if (!(wo.z > 0.0f)) return {};
    const vec3 h = ggx{in.alpha}.sample(wo, n());
    const float reflected = fresnel_dielectric(glm::dot(wo, h), in.ior);
    if (u < reflected) {
      const vec3 wi = mirrored(wo, h);
      if (!(wi.z > 0.0f)) return {};
      return {wi, spectrum(ggx{in.alpha}.eval(wo, wi, h) / ggx{in.alpha}.pdf(wo, h))};
    }
    const vec3 wi = render::cosine_hemisphere(u2);
    return {wi, below(passed(wi, n), n)};
  }

 private:
  // Means over all directions of what a smooth boundary of index 1.5 reflects, from outside and from inside.
  static constexpr float mean_outside = 0.0918f, mean_inside = 0.5963f;

  /// The part of light along `w` that passes one facet, drawn among those that it meets.
  template <class Numbers>
  KERNELS_BOTH float passed(vec3 w, Numbers& n) const {
    return 1.0f - fresnel_dielectric(glm::dot(w, ggx{in.alpha}.sample(w, n())), in.ior);
  }
  /// What the base reflects, of light and back through facets that pass `facets`: a walk between base and
  /// boundary.
  template <class Numbers>
  KERNELS_BOTH spectrum below(float facets, Numbers& n) const {
    spectrum left = spectrum(facets / (1.0f - mean_outside)) * in.colour;
    for (int i = 0; i < 32 && n().x < mean_inside; ++i) left *= in.colour;
    return left;
  }
};

/// The density of a BSDF where its narrowest lobe is: at the mirrored direction.
template <class Bsdf, class Numbers>
KERNELS_BOTH float peak(const Bsdf& bsdf, vec3 wo, Numbers& n) {
  return bsdf.density(wo, flipped(wo), n);
}
/// Of rough glass, it may be at the refracted direction.
template <class Numbers>
KERNELS_BOTH float peak(const frosted_glass& bsdf, vec3 wo, Numbers& n) {
  const float mirrored_pdf = bsdf.density(wo, flipped(wo), n);
  const vec3 through = render::refracted(wo, vec3(0.0f, 0.0f, side_of(wo)), bsdf.in.eta(wo));
  return through == vec3(0.0f) ? mirrored_pdf : glm::max(mirrored_pdf, bsdf.density(wo, through, n));
}

}  // namespace kernels
