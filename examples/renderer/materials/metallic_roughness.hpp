// The metallic-roughness model of glTF 2.0 (appendix B of its specification). It includes the lobes of
// KHR_materials_ior, _specular, _transmission and _diffuse_transmission. Facets reflect and refract over a
// base that scatters to either side. Directions are in the frame of the surface, z along its normal.
#pragma once

#include "materials/microfacet.hpp"

#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>

#include <cstdint>

namespace render {

/// A number in [0, 1] in a byte.
class unorm8 {
 public:
  unorm8() = default;
  WFPG_HD explicit unorm8(float x)
      : bits_(static_cast<std::uint8_t>(glm::clamp(x, 0.0f, 1.0f) * 255.0f + 0.5f)) {}
  WFPG_HD operator float() const { return static_cast<float>(bits_) / 255.0f; }

 private:
  std::uint8_t bits_;
};

/// A colour in three bytes.
struct unorm8x3 {
  unorm8 r, g, b;

  unorm8x3() = default;
  WFPG_HD explicit unorm8x3(vec3 rgb) : r(rgb.x), g(rgb.y), b(rgb.z) {}
  WFPG_HD explicit operator vec3() const { return {r, g, b}; }
};

/// Fractions of the light for each lobe of a surface.
struct lobe_factors {
  unorm8 metallic;              ///< fraction of metal
  unorm8 specular;              ///< times Fresnel's reflectance of the part that is not metal
  unorm8 transmission;          ///< of facets that refract over a diffuse base
  unorm8 diffuse_transmission;  ///< of the diffuse base that scatters to the other side

  WFPG_HD bool transmits() const {
    return metallic < 1.0f && (transmission > 0.0f || diffuse_transmission > 0.0f);
  }
};

/// All lobes, seen from above: `outgoing.z` is positive in every function here. Transports radiance, as in
/// <wfpg/testing>.
struct metallic_roughness {
  vec3 colour;              ///< of metal, of the diffuse base, of refracted light
  vec3 transmitted_colour;  ///< of light that the diffuse base scatters to the other side
  lobe_factors factors;
  float alpha;  ///< GGX roughness, (0, 1]
  float eta;    ///< index beyond the surface over that on the outgoing side
  bool thin;    ///< a sheet, equal from both sides; light goes straight through

  /// f |cos| per channel, per steradian.
  WFPG_HD vec3 eval(vec3 outgoing, vec3 incident) const {
    const vec3 below = (1.0f - factors.metallic) * (1.0f - factors.transmission) *
                       (1.0f - fresnel(outgoing.z)) * (1.0f - fresnel(std::abs(incident.z))) *
                       (std::abs(incident.z) / pi) * base_colour(incident.z > 0.0f);
    const facet f = facet_between(outgoing, incident);
    return f.exists ? below + specular(f, outgoing) : below;
  }

  /// The probability of facets rather than the diffuse base. It is their fraction of the reflectance, bounded
  /// so that neither is left out.
  WFPG_HD float specular_probability(float cosine) const {
    const float facets = reflection_weight(cosine) + refraction_weight(cosine);
    const float base = (1.0f - factors.transmission) * not_reflected(cosine) *
                       (wfpg::luminance(base_colour(true)) + wfpg::luminance(base_colour(false)));
    const bool has_facets = mirrors() || refracts();
    if (!(base > 0.0f)) return has_facets ? 1.0f : 0.0f;
    return has_facets ? glm::clamp(facets / (facets + base), 0.1f, 0.9f) : 0.0f;
  }

  /// Density of sample() of one part, per steradian.
  WFPG_HD float pdf(bool facets, vec3 outgoing, vec3 incident) const {
    if (!facets) return side_probability(false, outgoing.z, incident.z > 0.0f) * std::abs(incident.z) / pi;
    const facet f = facet_between(outgoing, incident);
    if (!f.exists) return 0.0f;
    const float side = side_probability(true, outgoing.z, f.mirrors);
    const ggx distribution{alpha};
    return side * (f.mirrors || thin ? distribution.pdf(outgoing, f.h)
                                     : distribution.pdf_through(outgoing, f.incident, f.h, eta));
  }

  /// Samples a direction of one part. Zero if it fails.
  WFPG_HD vec3 sample(bool facets, vec3 outgoing, vec2 u) const {
    const bool same_side = chosen(u.x, side_probability(facets, outgoing.z, true));
    if (!facets) return other_side_unless(same_side, cosine_hemisphere(u));
    const vec3 h = ggx{alpha}.sample(outgoing, u);
    if (same_side || thin) {
      const vec3 incident = mirrored(outgoing, h);
      return incident.z > 0.0f ? other_side_unless(same_side, incident) : vec3(0.0f);
    }
    const vec3 incident = refracted(outgoing, h, eta);
    return incident.z < 0.0f ? incident : vec3(0.0f);
  }

 private:
  /// The facet that scatters light from one direction to the other.
  struct facet {
    vec3 incident{0.0f};  ///< of a thin sheet: mirrored to above it
    vec3 h{0.0f};
    bool mirrors = true;  ///< light stays on its side
    bool exists = false;
  };

  WFPG_HD facet facet_between(vec3 outgoing, vec3 incident) const {
    facet f;
    f.mirrors = incident.z > 0.0f;
    if (f.mirrors ? !mirrors() : !refracts()) return f;
    f.incident = thin ? other_side_unless(f.mirrors, incident) : incident;
    const bool bends = f.incident.z < 0.0f;
    const vec3 sum = outgoing + (bends ? eta : 1.0f) * f.incident;
    f.h = glm::normalize(sum.z < 0.0f ? -sum : sum);
    f.exists = glm::dot(outgoing, f.h) > 0.0f && (!bends || glm::dot(f.incident, f.h) < 0.0f);
    return f;
  }

  WFPG_HD vec3 specular(const facet& f, vec3 outgoing) const {
    const float cosine = glm::dot(outgoing, f.h);
    const ggx distribution{alpha};
    if (f.mirrors) return reflectance(cosine) * distribution.eval(outgoing, f.incident, f.h);
    const float scale = factors.transmission * (1.0f - factors.metallic);
    if (thin)
      return colour * (scale * (1.0f - fresnel(cosine)) * distribution.eval(outgoing, f.incident, f.h));
    // Uses both cosines, since they are more precise than one near total reflection.
    const float reflected = factors.specular * fresnel_dielectric(cosine, -glm::dot(f.incident, f.h), eta);
    return colour * (scale * (1.0f - reflected) * distribution.eval_through(outgoing, f.incident, f.h, eta));
  }

  // Total reflection stays total: the rest of the light is absorbed.
  WFPG_HD float fresnel(float cosine) const {
    const float reflected = fresnel_dielectric(cosine, eta);
    return eta < 1.0f && reflected >= 1.0f ? 1.0f : factors.specular * reflected;
  }
  WFPG_HD vec3 reflectance(float cosine) const {
    return glm::mix(vec3(fresnel(cosine)), fresnel_schlick(colour, cosine), float(factors.metallic));
  }
  WFPG_HD float not_reflected(float cosine) const {
    return (1.0f - factors.metallic) * (1.0f - fresnel(cosine));
  }
  WFPG_HD vec3 base_colour(bool same_side) const {
    const float through = factors.diffuse_transmission;
    return same_side ? (1.0f - through) * colour : through * transmitted_colour;
  }

  WFPG_HD bool mirrors() const { return factors.metallic > 0.0f || factors.specular > 0.0f || eta < 1.0f; }
  WFPG_HD bool refracts() const { return factors.transmission > 0.0f && factors.metallic < 1.0f; }

  WFPG_HD float reflection_weight(float cosine) const { return wfpg::luminance(reflectance(cosine)); }
  WFPG_HD float refraction_weight(float cosine) const {
    return factors.transmission * not_reflected(cosine) * wfpg::luminance(colour);
  }

  // The boundary's probability if it were smooth. Two random numbers are too few to ask the sampled facet.
  WFPG_HD float side_probability(bool facets, float cosine, bool same_side) const {
    float same = 1.0f;
    if (!facets) {
      const float reflected = wfpg::luminance(base_colour(true));
      const float through = wfpg::luminance(base_colour(false));
      if (through > 0.0f) same = reflected / (reflected + through);
    } else if (refracts()) {
      const float reflected = reflection_weight(cosine), through = refraction_weight(cosine);
      const float sum = reflected + through;
      same = mirrors() ? glm::clamp(sum > 0.0f ? reflected / sum : 1.0f, 0.1f, 0.9f) : 0.0f;
    }
    return same_side ? same : 1.0f - same;
  }

  WFPG_HD static vec3 other_side_unless(bool same_side, vec3 w) { return {w.x, w.y, same_side ? w.z : -w.z}; }
};

}  // namespace render
