// The scene as irradiance records need it: its emitters, and how light continues at smooth surfaces.
#pragma once

#include "scene/device_scene.hpp"

#include <wfpg/guides/records/irradiance_records.hpp>

#include <algorithm>
#include <vector>

namespace render {

/// The triangles that emit, with their mean radiance.
inline std::vector<wfpg::emitting_triangle> emitters_of(const scene& host) {
  const std::vector<float> luminances = emitted_luminances(host);
  std::vector<wfpg::emitting_triangle> result;
  for (std::size_t i = 0; i < host.triangles.size(); ++i) {
    const uvec3 t = host.triangles[i];
    const float luminance = luminances[host.triangle_materials[i]];
    if (luminance > 0.0f)
      result.push_back({host.positions[t.x], host.positions[t.y], host.positions[t.z], luminance});
  }
  return result;
}

/// Whether there are surfaces through which next-event estimation finds no lights.
inline bool has_smooth_surfaces(const scene& host) {
  return std::any_of(host.materials.begin(), host.materials.end(), [](const material& m) {
    return is_smooth(m.kind) || m.kind == material_kind::smooth_plastic;
  });
}

/// Continues light at smooth materials. A Caster finds triangles inside kernels.
template <class Caster>
struct smooth_surfaces {
  Caster caster;
  scene_view scene;

  WFPG_HD wfpg::smooth_bounce operator()(std::uint32_t, const wfpg::ray& r, float, vec2 u) const {
    const triangle_hit hit = caster.intersect(r);
    if (!hit.is_hit()) return {};
    const vec3 back = -r.direction;
    const bsdf scatters = scene.surface(hit, back).surface.bsdf;
    if (!scatters.is_delta()) return {};
    const wfpg::bsdf_sample drawn = scatters.sample(back, u);
    const float left = drawn.pdf > 0.0f ? scatters.reflectance(back, drawn.direction, true) : 0.0f;
    return {true, drawn.direction, left};
  }
};

}  // namespace render
