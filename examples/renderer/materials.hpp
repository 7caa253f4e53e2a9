// The BSDF of the renderer: one tagged, trivially copyable type, so that a kernel needs no virtual call.
// Directions as in <wfpg/bsdf.hpp>: world space, unit length, away from the surface.
#pragma once

#include "microfacet.hpp"
#include "scene.hpp"

#include <wfpg/bsdf.hpp>

#include <type_traits>

namespace render {

/// How one point scatters. Reflecting kinds do so on the side that both normals face; dielectrics' normals
/// face outward. Directions that the two normals put on different sides carry nothing: no light leaks through
/// a surface because its shading normal leans.
struct bsdf {
  vec3 normal{0.0f, 0.0f, 1.0f};  ///< shading normal, unit length
  vec3 geometric_normal{0.0f, 0.0f, 1.0f};
  vec3 colour{0.8f};  ///< material::base_color at this point
  float alpha = 0.1f;
  float ior = 1.5f;
  material_kind kind = material_kind::lambert;

  WFPG_HD bool is_delta() const { return kind == material_kind::mirror || kind == material_kind::dielectric; }
  WFPG_HD bool transmits() const {
    return kind == material_kind::dielectric || kind == material_kind::rough_dielectric;
  }

  /// f |cos| per channel, per steradian; 0 for delta lobes.
  WFPG_HD vec3 eval_rgb(vec3 outgoing, vec3 incident) const {
    if (kind == material_kind::rough_dielectric) return eval_rough(outgoing, incident);
    if (is_delta() || !reflects(outgoing, incident)) return vec3(0.0f);
    const frame local(normal);
    const vec3 wo = local.to_local(outgoing);
    const vec3 wi = local.to_local(incident);
    if (kind == material_kind::lambert) return colour * (wi.z / pi);
    const vec3 h = glm::normalize(wo + wi);
    const float facets = ggx{alpha}.eval(wo, wi, h);
    if (kind == material_kind::conductor) return fresnel_schlick(colour, glm::dot(wo, h)) * facets;
    const float below = (1.0f - fresnel_dielectric(wo.z, ior)) * (1.0f - fresnel_dielectric(wi.z, ior));
    return vec3(fresnel_dielectric(glm::dot(wo, h), ior) * facets) + colour * (below * wi.z / pi);
  }
  WFPG_HD float eval(vec3 outgoing, vec3 incident) const {
    if (kind != material_kind::lambert) return wfpg::luminance(eval_rgb(outgoing, incident));
    return reflects(outgoing, incident) ? wfpg::luminance(colour) * glm::dot(incident, normal) / pi : 0.0f;
  }

  /// The plastic's coat, or all of what has facets alone; and how often sample() draws from it.
  WFPG_HD wfpg::glossy_part glossy(vec3 outgoing) const {
    if (kind == material_kind::conductor || kind == material_kind::rough_dielectric) return {1.0f, alpha};
    if (kind == material_kind::plastic) return {coat_probability(glm::dot(outgoing, normal)), alpha};
    return {};
  }

  /// Density of sample(), per steradian; 0 for delta lobes.
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    const float coat = glossy(outgoing).share;
    return (coat > 0.0f ? coat * pdf_part(true, outgoing, incident) : 0.0f) +
           (coat < 1.0f ? (1.0f - coat) * pdf_part(false, outgoing, incident) : 0.0f);
  }
  /// The same of one part.
  WFPG_HD float pdf_part(bool coat, vec3 outgoing, vec3 incident) const {
    if (kind == material_kind::rough_dielectric) return coat ? pdf_rough(outgoing, incident) : 0.0f;
    if (is_delta() || is_black() || !reflects(outgoing, incident)) return 0.0f;
    if (!coat) return glm::dot(incident, normal) / pi;
    const frame local(normal);
    const vec3 wo = local.to_local(outgoing);
    return ggx{alpha}.pdf(wo, glm::normalize(wo + local.to_local(incident)));
  }

  WFPG_HD wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    if (is_black()) return {};
    if (kind == material_kind::dielectric) return sample_dielectric(outgoing, u.x);
    if (kind == material_kind::mirror) {
      const vec3 incident = mirrored(outgoing, normal);
      return {incident, reflects(outgoing, incident) ? 1.0f : 0.0f};
    }
    const float coat = glossy(outgoing).share;
    const bool from_coat = chosen(u.x, coat);
    wfpg::bsdf_sample drawn = sample_part(from_coat, outgoing, u);
    if (drawn.pdf > 0.0f && coat > 0.0f) drawn.pdf = pdf(outgoing, drawn.direction);
    return drawn;
  }
  /// The same from one part, with its density.
  WFPG_HD wfpg::bsdf_sample sample_part(bool coat, vec3 outgoing, vec2 u) const {
    if (kind == material_kind::rough_dielectric)
      return coat ? sample_rough(outgoing, u) : wfpg::bsdf_sample{};
    const frame local(normal);
    const vec3 wo = local.to_local(outgoing);
    if (is_delta() || is_black() || wo.z <= 0.0f) return {};
    const vec3 wi = coat ? mirrored(wo, ggx{alpha}.sample(wo, u)) : cosine_hemisphere(u);
    const vec3 incident = glm::normalize(local.to_world(wi));
    return {incident, pdf_part(coat, outgoing, incident)};
  }

  /// Value over probability of the delta lobe that joins two directions, per channel.
  WFPG_HD vec3 delta_weight_rgb(vec3 outgoing, vec3 incident) const {
    if (kind == material_kind::mirror) return colour;
    const float above = glm::dot(outgoing, normal);
    if (above * glm::dot(incident, normal) > 0.0f) return vec3(1.0f);
    // Radiance is squeezed into a smaller solid angle where the index is larger.
    const float eta = relative_ior(above);
    return colour / (eta * eta);
  }

  /// What part of the light goes on, roughly and per sample of this BSDF: for Russian roulette.
  /// Does not see how radiance changes with the index of refraction, which paths that leave again get back.
  WFPG_HD float reflectance(vec3 outgoing, vec3 incident) const {
    if (is_delta()) return wfpg::luminance(colour);
    const float density = pdf(outgoing, incident);
    if (!(density > 0.0f)) return 0.0f;
    const float above = glm::dot(outgoing, normal);
    const float eta = above * glm::dot(incident, normal) < 0.0f ? relative_ior(above) : 1.0f;
    return eta * eta * eval(outgoing, incident) / density;
  }

 private:
  WFPG_HD bool is_black() const {
    const bool needs_colour = kind == material_kind::lambert || kind == material_kind::mirror;
    return needs_colour && !(wfpg::luminance(colour) > 0.0f);
  }

  WFPG_HD bool reflects(vec3 outgoing, vec3 incident) const {
    return glm::dot(outgoing, normal) > 0.0f && glm::dot(outgoing, geometric_normal) > 0.0f &&
           glm::dot(incident, normal) > 0.0f && glm::dot(incident, geometric_normal) > 0.0f;
  }

  WFPG_HD static vec3 mirrored(vec3 w, vec3 about) { return 2.0f * glm::dot(w, about) * about - w; }

  WFPG_HD float relative_ior(float outgoing_cosine) const {
    return outgoing_cosine > 0.0f ? ior : 1.0f / ior;
  }

  /// True with a probability, from a number in [0,1), which is one again after it.
  WFPG_HD static bool chosen(float& u, float probability) {
    const bool is_chosen = u < probability;
    u = is_chosen ? u / probability : (u - probability) / (1.0f - probability);
    u = glm::min(0x1.fffffep-1f, u);
    return is_chosen;
  }

  // How often a plastic's sample comes from its coat: as the two reflect, but neither is ever left out.
  WFPG_HD float coat_probability(float cosine) const {
    const float base = wfpg::luminance(colour);
    if (!(base > 0.0f)) return 1.0f;
    const float coat = fresnel_dielectric(cosine, ior);
    return glm::min(0.9f, glm::max(0.1f, coat / (coat + (1.0f - coat) * base)));
  }

  /// Two directions and the facet between them, where there is one, on a rough boundary: turned so that
  /// `outgoing` is above it.
  struct facet {
    vec3 outgoing{0.0f}, incident{0.0f}, h{0.0f};
    float eta = 1.0f;
    bool exists = false;

    WFPG_HD bool mirrors() const { return incident.z > 0.0f; }
  };

  WFPG_HD facet facet_between(vec3 outgoing, vec3 incident) const {
    facet f;
    const frame local(normal);
    const float above = glm::dot(outgoing, normal), side = above < 0.0f ? -1.0f : 1.0f;
    f.outgoing = side * local.to_local(outgoing);
    f.incident = side * local.to_local(incident);
    f.eta = relative_ior(above);
    const vec3 sum = f.outgoing + (f.mirrors() ? 1.0f : f.eta) * f.incident;
    f.h = glm::normalize(sum.z < 0.0f ? -sum : sum);
    const bool sides_agree = above * glm::dot(outgoing, geometric_normal) > 0.0f &&
                             glm::dot(incident, normal) * glm::dot(incident, geometric_normal) > 0.0f;
    f.exists =
        sides_agree && glm::dot(f.outgoing, f.h) > 0.0f && (f.mirrors() || glm::dot(f.incident, f.h) < 0.0f);
    return f;
  }

  WFPG_HD vec3 eval_rough(vec3 outgoing, vec3 incident) const {
    const facet f = facet_between(outgoing, incident);
    if (!f.exists) return vec3(0.0f);
    const float cosine = glm::dot(f.outgoing, f.h);
    if (f.mirrors())
      return vec3(fresnel_dielectric(cosine, f.eta) * ggx{alpha}.eval(f.outgoing, f.incident, f.h));
    const float reflected = fresnel_dielectric(cosine, -glm::dot(f.incident, f.h), f.eta);
    return colour * ((1.0f - reflected) * ggx{alpha}.eval_through(f.outgoing, f.incident, f.h, f.eta));
  }

  // As the boundary would if it were smooth: two numbers do not suffice to ask the facet that was drawn.
  WFPG_HD static float mirror_probability(float cosine, float eta) {
    return glm::clamp(fresnel_dielectric(cosine, eta), 0.1f, 0.9f);
  }

  WFPG_HD float pdf_rough(vec3 outgoing, vec3 incident) const {
    const facet f = facet_between(outgoing, incident);
    if (!f.exists) return 0.0f;
    const float mirrored = mirror_probability(f.outgoing.z, f.eta);
    if (f.mirrors()) return mirrored * ggx{alpha}.pdf(f.outgoing, f.h);
    return (1.0f - mirrored) * ggx{alpha}.pdf_through(f.outgoing, f.incident, f.h, f.eta);
  }

  WFPG_HD wfpg::bsdf_sample sample_rough(vec3 outgoing, vec2 u) const {
    const frame local(normal);
    const float above = glm::dot(outgoing, normal), side = above < 0.0f ? -1.0f : 1.0f;
    const vec3 wo = side * local.to_local(outgoing);
    if (wo.z <= 0.0f) return {};
    const float eta = relative_ior(above), mirrors = mirror_probability(wo.z, eta);
    const bool reflect = chosen(u.x, mirrors);
    const vec3 h = ggx{alpha}.sample(wo, u);
    const vec3 wi = reflect ? mirrored(wo, h) : refracted(wo, h, eta);
    if (wi.z == 0.0f || (wi.z > 0.0f) != reflect) return {};
    const vec3 incident = glm::normalize(local.to_world(side * wi));
    return {incident, pdf_rough(outgoing, incident)};
  }

  /// 0 where all is reflected.
  WFPG_HD static vec3 refracted(vec3 w, vec3 about, float eta) {
    const float cosine = glm::dot(w, about), square = 1.0f - (1.0f - cosine * cosine) / (eta * eta);
    return square > 0.0f ? (cosine / eta - std::sqrt(square)) * about - w / eta : vec3(0.0f);
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
};

static_assert(wfpg::is_bsdf_v<bsdf> && wfpg::has_separate_parts_v<bsdf> &&
              std::is_trivially_copyable_v<bsdf>);

}  // namespace render
