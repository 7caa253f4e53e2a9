// The solids that a ray is in, and what it meets at their surfaces. Solids may overlap: of those around a
// point, the one with the largest priority is there, and of several such the one that the ray entered last.
// Source: Schmidt and Budge 2002, "Simple nested dielectrics in ray traced images".
#pragma once

#include "scene/device_scene.hpp"

#include <wfpg/host/medium.hpp>

namespace render {

WFPG_HD inline wfpg::homogeneous_medium coefficients_of(const medium& m) {
  return {m.absorption, m.scattering};
}

/// Numbers of materials, in the order in which a ray entered them. Trivially copyable.
class solid_stack {
 public:
  static constexpr int capacity = 4;
  static constexpr std::uint32_t none = 0xffffffffu;

  WFPG_HD std::uint32_t operator[](int i) const { return solids_[i]; }

  /// The solid that is there, or none.
  WFPG_HD std::uint32_t top(const scene_view& scene) const {
    std::uint32_t best = none;
    for (const std::uint32_t solid : solids_)
      if (solid != none &&
          (best == none || scene.materials[solid].priority >= scene.materials[best].priority))
        best = solid;
    return best;
  }

  /// The medium around the ray.
  WFPG_HD medium medium_of(const scene_view& scene) const {
    const std::uint32_t solid = top(scene);
    return solid == none ? scene.fog : interior_of(scene.materials[solid]);
  }

  /// Adds a solid. A full stack forgets the one of least priority, of several such the first.
  WFPG_HD void enter(const scene_view& scene, std::uint32_t solid) {
    if (solids_[capacity - 1] != none) {
      int least = 0;
      for (int i = 1; i < capacity; ++i)
        if (scene.materials[solids_[i]].priority < scene.materials[solids_[least]].priority) least = i;
      remove(least);
    }
    int i = 0;
    while (solids_[i] != none) ++i;
    solids_[i] = solid;
  }

  /// Removes a solid, the one entered last of several alike. Returns whether the ray was in it.
  WFPG_HD bool leave(const scene_view& scene, std::uint32_t solid) {
    for (int i = capacity - 1; i >= 0; --i)
      if (solids_[i] != none && bound_same_solid(scene.materials[solids_[i]], scene.materials[solid])) {
        remove(i);
        return true;
      }
    return false;
  }

 private:
  WFPG_HD void remove(int i) {
    for (; i + 1 < capacity; ++i) solids_[i] = solids_[i + 1];
    solids_[capacity - 1] = none;
  }

  std::uint32_t solids_[capacity] = {none, none, none, none};
};

/// What a ray meets at the surface of a solid.
struct solid_boundary {
  bool exists = true;  ///< false: another solid covers it, and the ray goes on as if it were not there
  float ior = 1.0f;    ///< of the inside over that of the outside
  solid_stack beyond;  ///< behind it

  /// `around`: the solids before it. `enters`: whether the ray meets the outside. A ray that leaves a solid
  /// which it never entered stays in the others.
  WFPG_HD solid_boundary(const scene_view& scene, const solid_stack& around, std::uint32_t solid, bool enters)
      : beyond(around) {
    const material& inside = scene.materials[solid];
    const bool was_inside = !enters && beyond.leave(scene, solid);
    const std::uint32_t outside = beyond.top(scene);
    if (outside != solid_stack::none) ior = scene.materials[outside].ior;
    ior = inside.ior / ior;
    if (enters) {
      exists = outside == solid_stack::none || inside.priority >= scene.materials[outside].priority;
      beyond.enter(scene, solid);
    } else if (was_inside) {
      exists = bound_same_solid(scene.materials[around.top(scene)], inside);
    }
  }

  /// Whether light passes the boundary unbent and without reflection. Both sides have the same index.
  WFPG_HD bool is_matched(const material& m) const {
    return m.kind != material_kind::metallic_roughness && std::abs(ior - 1.0f) < least_index_step;
  }
  /// The index of rough facets, which cannot refract where it is 1.
  WFPG_HD float ior_of(const material& m) const {
    if (m.kind == material_kind::dielectric || std::abs(ior - 1.0f) >= least_rough_step) return ior;
    return ior < 1.0f ? 1.0f - least_rough_step : 1.0f + least_rough_step;
  }

  static constexpr float least_rough_step = 0.01f;
};

}  // namespace render
