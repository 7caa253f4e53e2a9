// Fresnel reflectances, and the GGX distribution of microfacets (Walter et al. 2007) with visible normals
// (Heitz 2018). Directions are in the frame of the surface, z along its normal. `eta` is the index beyond the
// surface over that on the outgoing side.
#pragma once

#include "scene/frame.hpp"

namespace render {

/// Unpolarised reflectance of a smooth boundary. `eta` is the index beyond over that on the incident side.
/// Both cosines are positive.
WFPG_HD inline float fresnel_dielectric(float cosine, float transmitted, float eta) {
  const float parallel = (eta * cosine - transmitted) / (eta * cosine + transmitted);
  const float perpendicular = (cosine - eta * transmitted) / (cosine + eta * transmitted);
  return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

/// Unpolarised reflectance from the incident cosine, at least 0. 1 for total reflection.
WFPG_HD inline float fresnel_dielectric(float cosine, float eta) {
  const float sine2 = glm::max(0.0f, 1.0f - cosine * cosine) / (eta * eta);
  return sine2 < 1.0f ? fresnel_dielectric(cosine, std::sqrt(1.0f - sine2), eta) : 1.0f;
}

/// Schlick's approximation from the reflectance at normal incidence, per channel.
template <class Colour>
WFPG_HD Colour fresnel_schlick(const Colour& normal_reflectance, float cosine) {
  const float x = glm::max(0.0f, 1.0f - cosine);
  const float x2 = x * x;
  return normal_reflectance + (Colour(1.0f) - normal_reflectance) * (x2 * x2 * x);
}

/// `w` mirrored about a unit vector.
WFPG_HD inline vec3 mirrored(vec3 w, vec3 about) {
  return 2.0f * glm::dot(w, about) * about - w;
}

/// `w` refracted at a boundary whose normal is on its side. 0 for total reflection.
WFPG_HD inline vec3 refracted(vec3 w, vec3 about, float eta) {
  const float cosine = glm::dot(w, about), square = 1.0f - (1.0f - cosine * cosine) / (eta * eta);
  return square > 0.0f ? (cosine / eta - std::sqrt(square)) * about - w / eta : vec3(0.0f);
}

/// True with the given probability. `u` is a random number in [0,1), and is uniform again afterwards.
WFPG_HD inline bool chosen(float& u, float probability) {
  const bool is_chosen = u < probability;
  u = is_chosen ? u / probability : (u - probability) / (1.0f - probability);
  u = glm::min(0x1.fffffep-1f, u);
  return is_chosen;
}

/// The GGX distribution of roughness `alpha` in (0, 1], isotropic.
struct ggx {
  float alpha = 1.0f;

  /// Density of facets by solid angle of their normal `h` (above the surface), projected.
  WFPG_HD float distribution(vec3 h) const {
    // Avoids h.z alone: 1 - h.z² loses the digits of smooth surfaces.
    const float a2 = alpha * alpha;
    const float t = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
    return 1.0f / (pi * a2 * t * t);
  }

  /// D G2 cos(incident) / (4 cos(incident) cos(outgoing)): the BRDF times the cosine, without Fresnel's term.
  /// Both directions are above the surface. G2 is the height-correlated shadowing and masking.
  WFPG_HD float eval(vec3 outgoing, vec3 incident, vec3 h) const {
    const float terms = outgoing.z * slope_term(incident.z) + incident.z * slope_term(outgoing.z);
    return distribution(h) * incident.z / (2.0f * terms);
  }

  /// Density of the reflected direction if sample() samples h.
  WFPG_HD float pdf(vec3 outgoing, vec3 h) const {
    return distribution(h) / (2.0f * (outgoing.z + slope_term(outgoing.z)));
  }

  /// The BTDF times |cos(incident)| of light refracted by facets of normal `h`, without Fresnel's term.
  /// `outgoing` is above the surface, `incident` below (Walter et al. 2007, Eq. 21, for radiance).
  WFPG_HD float eval_through(vec3 outgoing, vec3 incident, vec3 h, float eta) const {
    const float below = -incident.z, out = glm::dot(outgoing, h), in = glm::dot(incident, h);
    const float terms = outgoing.z * slope_term(below) + below * slope_term(outgoing.z);
    const float q = out + eta * in;
    return 2.0f * distribution(h) * below * out * std::abs(in) / (terms * q * q);
  }

  /// Density of the refracted direction if sample() samples h.
  WFPG_HD float pdf_through(vec3 outgoing, vec3 incident, vec3 h, float eta) const {
    const float out = glm::dot(outgoing, h), in = glm::dot(incident, h);
    const float q = (out + eta * in) / eta;
    return 4.0f * pdf(outgoing, h) * out * std::abs(in) / (q * q);
  }

  /// Samples a facet's normal that is visible from `outgoing`, above the surface.
  WFPG_HD vec3 sample(vec3 outgoing, vec2 u) const {
    const vec3 stretched = glm::normalize(vec3(alpha * outgoing.x, alpha * outgoing.y, outgoing.z));
    const frame view(stretched);
    // The frame's first axis must be in the surface, so that the two half disks below are right.
    const float planar2 = stretched.x * stretched.x + stretched.y * stretched.y;
    const vec3 first = planar2 > 1e-12f ? vec3(-stretched.y, stretched.x, 0.0f) / std::sqrt(planar2) : view.x;
    const vec3 second = glm::cross(stretched, first);
    const vec2 disk = uniform_disk(u);
    const float side = 0.5f * (1.0f + stretched.z);
    const float y = (1.0f - side) * std::sqrt(glm::max(0.0f, 1.0f - disk.x * disk.x)) + side * disk.y;
    const float z = std::sqrt(glm::max(0.0f, 1.0f - disk.x * disk.x - y * y));
    const vec3 h = disk.x * first + y * second + z * stretched;
    return glm::normalize(vec3(alpha * h.x, alpha * h.y, glm::max(1e-6f, h.z)));
  }

 private:
  WFPG_HD float slope_term(float cosine) const {
    const float a2 = alpha * alpha;
    return std::sqrt(a2 + (1.0f - a2) * cosine * cosine);
  }
};

}  // namespace render
