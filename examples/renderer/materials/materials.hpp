// The BSDF of the renderer: one tagged, trivially copyable type, so that kernels need no virtual calls.
// Directions are as in <wfpg/host/bsdf.hpp>: world space, unit length, away from the surface.
#pragma once

#include "materials/metallic_roughness.hpp"
#include "scene/scene.hpp"

#include <wfpg/host/bsdf.hpp>

#include <type_traits>

namespace render {

/// How one point scatters. Reflecting kinds scatter on the side that both normals face. Dielectrics' normals
/// face outward. A direction that the two normals put on different sides has the value 0. Shading normals
/// therefore leak no light.
struct bsdf {
  vec3 normal{0.0f, 0.0f, 1.0f};  ///< shading normal, unit length
  vec3 geometric_normal{0.0f, 0.0f, 1.0f};
  vec3 colour{0.8f};  ///< material::base_color at this point
  float alpha = 0.1f;
  float ior = 1.5f;
  material_kind kind = material_kind::lambert;
  unorm8x3 transmitted_colour{};  ///< this and the next: only for the two kinds with all lobes
  lobe_factors factors{};

  WFPG_HD bool is_delta() const { return is_smooth(kind); }
  WFPG_HD bool transmits() const {
    switch (kind) {
      case material_kind::dielectric:
      case material_kind::thin_dielectric:
      case material_kind::rough_dielectric:
        return true;
      case material_kind::metallic_roughness:
      case material_kind::thin_metallic_roughness:
        return factors.transmits();
      default:
        return false;
    }
  }

  /// f |cos| per channel, per steradian. Without delta lobes.
  WFPG_HD vec3 eval_rgb(vec3 outgoing, vec3 incident) const {
    if (has_all_lobes()) {
      const local_pair pair(*this, outgoing, incident);
      return pair.exists ? lobes(pair.side).eval(pair.outgoing, pair.incident) : vec3(0.0f);
    }
    if (is_delta() || !reflects(outgoing, incident)) return vec3(0.0f);
    if (kind == material_kind::lambert) return colour * (glm::dot(incident, normal) / pi);
    const frame local(normal);
    const vec3 wo = local.to_local(outgoing);
    const vec3 wi = local.to_local(incident);
    if (kind == material_kind::smooth_plastic) return colour * (below_coat(wo.z, wi.z) * wi.z / pi);
    const vec3 h = glm::normalize(wo + wi);
    const float facets = ggx{alpha}.eval(wo, wi, h);
    if (kind == material_kind::conductor) return fresnel_schlick(colour, glm::dot(wo, h)) * facets;
    const float below = below_coat(wo.z, wi.z);
    return vec3(fresnel_dielectric(glm::dot(wo, h), ior) * facets) + colour * (below * wi.z / pi);
  }
  WFPG_HD float eval(vec3 outgoing, vec3 incident) const {
    if (kind != material_kind::lambert) return wfpg::luminance(eval_rgb(outgoing, incident));
    return reflects(outgoing, incident) ? wfpg::luminance(colour) * glm::dot(incident, normal) / pi : 0.0f;
  }

  /// The light that facets or a smooth coat reflect and refract, and the probability that sample() chooses
  /// them.
  WFPG_HD wfpg::glossy_part glossy(vec3 outgoing) const {
    if (kind == material_kind::lambert) return {};
    if (kind == material_kind::conductor) return {1.0f, alpha};
    const float above = glm::dot(outgoing, normal);
    if (kind == material_kind::plastic) return {coat_probability(above), alpha};
    if (kind == material_kind::smooth_plastic) return {coat_probability(above), 0.0f};
    if (has_all_lobes()) return {lobes(side_of(above)).specular_probability(std::abs(above)), alpha};
    return {};
  }

  /// Density of sample(), per steradian. Without delta lobes.
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    const float coat = glossy(outgoing).fraction;
    return (coat > 0.0f ? coat * pdf_part(true, outgoing, incident) : 0.0f) +
           (coat < 1.0f ? (1.0f - coat) * pdf_part(false, outgoing, incident) : 0.0f);
  }
  /// Density of sample_part(), per steradian.
  WFPG_HD float pdf_part(bool coat, vec3 outgoing, vec3 incident) const {
    if (has_all_lobes()) {
      const local_pair pair(*this, outgoing, incident);
      return pair.exists ? lobes(pair.side).pdf(coat, pair.outgoing, pair.incident) : 0.0f;
    }
    if (is_delta() || is_black() || !reflects(outgoing, incident)) return 0.0f;
    if (!coat) return glm::dot(incident, normal) / pi;
    if (kind == material_kind::smooth_plastic) return 0.0f;
    const frame local(normal);
    const vec3 wo = local.to_local(outgoing);
    return ggx{alpha}.pdf(wo, glm::normalize(wo + local.to_local(incident)));
  }

  WFPG_HD wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    if (is_black()) return {};
    if (kind == material_kind::dielectric) return sample_dielectric(outgoing, u.x);
    if (kind == material_kind::thin_dielectric) return sample_thin_dielectric(outgoing, u.x);
    if (kind == material_kind::mirror) return sample_mirror(outgoing);
    const float coat = glossy(outgoing).fraction;
    const bool from_coat = chosen(u.x, coat);
    wfpg::bsdf_sample drawn = sample_part(from_coat, outgoing, u);
    if (drawn.is_delta)
      drawn.pdf *= coat;
    else if (drawn.pdf > 0.0f && coat > 0.0f)
      drawn.pdf = pdf(outgoing, drawn.direction);
    return drawn;
  }
  /// Samples one part, with that part's density. A smooth coat is a delta lobe.
  WFPG_HD wfpg::bsdf_sample sample_part(bool coat, vec3 outgoing, vec2 u) const {
    if (is_delta() || is_black()) return {};
    if (coat && kind == material_kind::smooth_plastic) return sample_mirror(outgoing);
    const frame local(normal);
    if (kind == material_kind::lambert) {
      if (glm::dot(outgoing, normal) <= 0.0f) return {};
      const vec3 incident = glm::normalize(local.to_world(cosine_hemisphere(u)));
      return {incident, pdf_part(false, outgoing, incident)};
    }
    vec3 wo = local.to_local(outgoing), wi;
    if (has_all_lobes()) {
      const float side = side_of(wo.z);
      wo = transmits() ? side * wo : wo;
      if (wo.z <= 0.0f) return {};
      wi = lobes(side).sample(coat, wo, u);
      if (wi == vec3(0.0f)) return {};
      wi = side * wi;
    } else {
      if (wo.z <= 0.0f) return {};
      wi = coat ? mirrored(wo, ggx{alpha}.sample(wo, u)) : cosine_hemisphere(u);
    }
    const vec3 incident = glm::normalize(local.to_world(wi));
    return {incident, pdf_part(coat, outgoing, incident)};
  }

  /// Value over probability of the delta lobe that joins two directions, per channel. `probability`: that
  /// of the lobe where a mixture drew it. It is sample()'s own where is_delta(), and is not read there.
  WFPG_HD vec3 delta_weight_rgb(vec3 outgoing, vec3 incident, float probability) const {
    if (kind == material_kind::mirror) return colour;
    const float above = glm::dot(outgoing, normal);
    if (kind == material_kind::smooth_plastic) return vec3(fresnel_dielectric(above, ior) / probability);
    if (above * glm::dot(incident, normal) > 0.0f) return vec3(1.0f);
    // Refraction compresses radiance into a smaller solid angle where the index is larger.
    const float eta = is_thin() ? 1.0f : relative_ior(above);
    return colour / (eta * eta);
  }

  /// About the fraction of the light that continues, per sample of this BSDF, for Russian roulette. Ignores
  /// how the index of refraction changes radiance, since paths that leave again undo this. `by_delta`: a
  /// delta lobe drew the direction.
  WFPG_HD float reflectance(vec3 outgoing, vec3 incident, bool by_delta) const {
    const float eta = ior_beyond(outgoing, incident);
    if (by_delta) {
      const float probability = glossy(outgoing).fraction;
      return eta * eta * wfpg::luminance(delta_weight_rgb(outgoing, incident, probability));
    }
    const float density = pdf(outgoing, incident);
    if (!(density > 0.0f)) return 0.0f;
    return eta * eta * eval(outgoing, incident) / density;
  }

  /// The index of refraction on the incident side, over that on the other side.
  WFPG_HD float ior_beyond(vec3 outgoing, vec3 incident) const {
    const float above = glm::dot(outgoing, normal);
    const bool enters = !is_thin() && above * glm::dot(incident, normal) < 0.0f;
    return enters ? relative_ior(above) : 1.0f;
  }

 private:
  WFPG_HD bool has_all_lobes() const {
    return kind == material_kind::rough_dielectric || kind == material_kind::metallic_roughness ||
           kind == material_kind::thin_metallic_roughness;
  }
  WFPG_HD bool is_thin() const {
    return kind == material_kind::thin_dielectric || kind == material_kind::thin_metallic_roughness;
  }

  WFPG_HD bool is_black() const {
    if (kind == material_kind::metallic_roughness || kind == material_kind::thin_metallic_roughness)
      return !(factors.specular > 0.0f || wfpg::luminance(colour) > 0.0f ||
               (factors.diffuse_transmission > 0.0f && wfpg::luminance(vec3(transmitted_colour)) > 0.0f));
    const bool needs_colour = kind == material_kind::lambert || kind == material_kind::mirror;
    return needs_colour && !(wfpg::luminance(colour) > 0.0f);
  }

  WFPG_HD bool reflects(vec3 outgoing, vec3 incident) const {
    return glm::dot(outgoing, normal) > 0.0f && glm::dot(outgoing, geometric_normal) > 0.0f &&
           glm::dot(incident, normal) > 0.0f && glm::dot(incident, geometric_normal) > 0.0f;
  }

  WFPG_HD float relative_ior(float outgoing_cosine) const {
    return outgoing_cosine > 0.0f ? ior : 1.0f / ior;
  }

  // The light that passes a coat twice: to the diffuse base and back.
  WFPG_HD float below_coat(float outgoing_cosine, float incident_cosine) const {
    return (1.0f - fresnel_dielectric(outgoing_cosine, ior)) *
           (1.0f - fresnel_dielectric(incident_cosine, ior));
  }

  // The probability of a plastic's coat: its fraction of the reflectance, bounded so that neither part is
  // left out.
  WFPG_HD float coat_probability(float cosine) const {
    const float base = wfpg::luminance(colour);
    if (!(base > 0.0f)) return 1.0f;
    const float coat = fresnel_dielectric(cosine, ior);
    return glm::min(0.9f, glm::max(0.1f, coat / (coat + (1.0f - coat) * base)));
  }

  WFPG_HD static float side_of(float cosine) { return cosine < 0.0f ? -1.0f : 1.0f; }

  /// Two directions in the surface's frame with `outgoing` above, if light can pass between them.
  struct local_pair {
    vec3 outgoing, incident;
    float side;
    bool exists;

    WFPG_HD local_pair(const bsdf& f, vec3 world_outgoing, vec3 world_incident) {
      const frame local(f.normal);
      outgoing = local.to_local(world_outgoing);
      incident = local.to_local(world_incident);
      side = side_of(outgoing.z);
      exists = outgoing.z * glm::dot(world_outgoing, f.geometric_normal) > 0.0f &&
               incident.z * glm::dot(world_incident, f.geometric_normal) > 0.0f &&
               (f.transmits() || (outgoing.z > 0.0f && incident.z > 0.0f)) && !f.is_black();
      outgoing = side * outgoing;
      incident = side * incident;
    }
  };

  /// All lobes as seen from the side of `outgoing`.
  WFPG_HD metallic_roughness lobes(float side) const {
    lobe_factors fractions = factors;
    if (kind == material_kind::rough_dielectric) fractions.specular = fractions.transmission = unorm8(1.0f);
    const bool solid = fractions.transmits() && !is_thin();
    return {colour, vec3(transmitted_colour), fractions, alpha, solid ? relative_ior(side) : ior, is_thin()};
  }

  WFPG_HD wfpg::bsdf_sample sample_mirror(vec3 outgoing) const {
    const vec3 incident = mirrored(outgoing, normal);
    return {incident, reflects(outgoing, incident) ? 1.0f : 0.0f, true};
  }

  WFPG_HD wfpg::bsdf_sample sample_dielectric(vec3 outgoing, float u) const {
    const float above = glm::dot(outgoing, normal);
    const vec3 facing = above < 0.0f ? -normal : normal;
    const float cosine = std::abs(above);
    const float eta = relative_ior(above);
    const float reflected = fresnel_dielectric(cosine, eta);
    const bool reflect = u < reflected;
    const vec3 incident =
        glm::normalize(reflect ? mirrored(outgoing, facing) : refracted(outgoing, facing, eta));
    const bool same_side = glm::dot(outgoing, geometric_normal) * glm::dot(incident, geometric_normal) > 0.0f;
    if (same_side != reflect) return {};
    return {incident, reflect ? reflected : 1.0f - reflected};
  }

  WFPG_HD wfpg::bsdf_sample sample_thin_dielectric(vec3 outgoing, float u) const {
    const float reflected = fresnel_dielectric(std::abs(glm::dot(outgoing, normal)), ior);
    if (u >= reflected) return {-outgoing, 1.0f - reflected};
    const vec3 incident = mirrored(outgoing, normal);
    const bool same_side = glm::dot(outgoing, geometric_normal) * glm::dot(incident, geometric_normal) > 0.0f;
    return {incident, same_side ? reflected : 0.0f};
  }
};

static_assert(wfpg::is_bsdf_v<bsdf> && wfpg::has_separate_parts_v<bsdf> &&
              std::is_trivially_copyable_v<bsdf>);

}  // namespace render
