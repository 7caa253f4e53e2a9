// Emitting triangles, picked in proportion to their power and sampled uniformly by area. The environment is
// not sampled here: BSDFs and guiding find it.
#pragma once

#include "alias_table.hpp"
#include "device_scene.hpp"

#include <numeric>

namespace render {

/// A point of an emitter.
struct light_sample {
  vec3 position{0.0f};
  vec3 normal{0.0f};  ///< geometric, unit length, on the side that emits
  vec3 radiance{0.0f};
  float pdf = 0.0f;     ///< per unit area; 0 where there is no light
  float offset = 0.0f;  ///< as in surface_point
};

/// Density per solid angle of a direction, from the density by area of the point it leads to.
WFPG_HD inline float solid_angle_pdf(float area_pdf, float distance, float cosine) {
  return cosine > 0.0f ? area_pdf * distance * distance / cosine : 0.0f;
}

/// Trivially copyable.
struct light_view {
  wfpg::array_view<const std::uint32_t> triangles;
  wfpg::array_view<const alias_column> table;  ///< by power, a column for each of the triangles
  float total_power = 0.0f;                    ///< sum of luminance times area

  /// Density by area of any point of an emitter with this radiance.
  WFPG_HD float pdf(vec3 radiance) const {
    return total_power > 0.0f ? wfpg::luminance(radiance) / total_power : 0.0f;
  }

  WFPG_HD light_sample sample(const scene_view& scene, vec2 choice, vec2 u) const {
    if (triangles.empty()) return {};
    const std::uint32_t triangle = triangles[pick(table, choice)];
    const float root = std::sqrt(u.x);
    const surface_point point = scene.point({triangle, root * (1.0f - u.y), root * u.y});
    const vec3 radiance = scene.materials[point.material].emission;
    return {point.position, point.geometric_normal, radiance, pdf(radiance), point.offset};
  }
};

/// The distribution over a scene's emitters, in the memory of a policy.
template <class Exec>
class light_distribution {
 public:
  light_distribution(const Exec& exec, const scene& host) {
    std::vector<std::uint32_t> triangles;
    std::vector<double> powers;
    for (std::size_t i = 0; i < host.triangles.size(); ++i) {
      const double power = power_of(host, i);
      if (!(power > 0.0)) continue;
      triangles.push_back(static_cast<std::uint32_t>(i));
      powers.push_back(power);
    }
    total_power_ = static_cast<float>(std::accumulate(powers.begin(), powers.end(), 0.0));
    triangles_ = wfpg::buffer<std::uint32_t, Exec>(exec, triangles);
    table_ = wfpg::buffer<alias_column, Exec>(exec, make_alias_table(powers));
  }

  light_view view() const { return {triangles_.view(), table_.view(), total_power_}; }

 private:
  static double power_of(const scene& host, std::size_t triangle) {
    const uvec3 t = host.triangles[triangle];
    const vec3 a = host.positions[t.x];
    const float area = 0.5f * glm::length(glm::cross(host.positions[t.y] - a, host.positions[t.z] - a));
    return static_cast<double>(wfpg::luminance(host.materials[host.triangle_materials[triangle]].emission)) *
           area;
  }

  wfpg::buffer<std::uint32_t, Exec> triangles_;
  wfpg::buffer<alias_column, Exec> table_;
  float total_power_ = 0.0f;
};

}  // namespace render
