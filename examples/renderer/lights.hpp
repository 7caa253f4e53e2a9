// The lights of a scene, picked in proportion to their power: emitting triangles, sampled uniformly by area,
// and lights without extent. And an environment that is a map; BSDFs and guiding find a constant one.
#pragma once

#include "alias_table.hpp"
#include "device_scene.hpp"
#include "rng.hpp"

#include <numeric>

namespace render {

/// A point of an emitter.
struct emitter_point {
  vec3 position{0.0f};
  vec3 normal{0.0f};  ///< geometric, unit length, on the side that emits
  vec3 radiance{0.0f};
  float pdf = 0.0f;     ///< per unit area
  float offset = 0.0f;  ///< as in surface_point
};

/// Light that a point may get from one direction.
struct light_sample {
  vec3 direction{0.0f};  ///< toward the light, unit length
  float pdf = 0.0f;     ///< per steradian, or the probability of a light without extent; 0: there is no light
  vec3 radiance{0.0f};  ///< of a light without extent: irradiance of what faces it
  bool is_delta = false;    ///< it has no extent
  bool is_distant = false;  ///< `end` says nothing
  vec3 end{0.0f};           ///< where a ray toward it ends
};

/// Density per solid angle of a direction, from the density by area of the point it leads to.
WFPG_HD inline float solid_angle_pdf(float area_pdf, float distance, float cosine) {
  return cosine > 0.0f ? area_pdf * distance * distance / cosine : 0.0f;
}

/// Trivially copyable.
struct light_view {
  wfpg::array_view<const std::uint32_t> triangles;
  wfpg::array_view<const punctual_light> punctual;
  wfpg::array_view<const alias_column>
      table;                 ///< by power: a column for each triangle, each other light, and a map
  float total_power = 0.0f;  ///< over pi; of an emitter, mean luminance times area

  float scene_radius = 0.0f;  ///< of a sphere around the scene

  /// Over pi, of the light that may meet a scene of that radius.
  WFPG_HD static float power_of(const punctual_light& source, float radius) {
    const float luminance = wfpg::luminance(source.intensity);
    if (source.kind == punctual_kind::directional) return radius * radius * luminance;
    return (source.kind == punctual_kind::point ? 4.0f : 2.0f * (1.0f - source.cos_outer)) * luminance;
  }

  WFPG_HD static float power_of(const environment_view& environment, float radius) {
    return radius * radius * environment.total();
  }

  /// Density by area of any point of an emitter with this mean luminance.
  WFPG_HD float pdf(float luminance) const { return total_power > 0.0f ? luminance / total_power : 0.0f; }

  /// A point of emitter number `light`.
  WFPG_HD emitter_point sample_emitter(const scene_view& scene, std::uint32_t light, vec2 u) const {
    const float root = std::sqrt(u.x);
    const triangle_hit hit{triangles[light], root * (1.0f - u.y), root * u.y};
    const surface_point at = scene.point(hit);
    const vec3 radiance =
        scene.is_cut_out(hit) ? vec3(0.0f) : scene.emitted(scene.materials[at.material], at.uv);
    return {at.position, at.geometric_normal, radiance, pdf(scene.emitted_luminances[at.material]),
            at.offset};
  }

  /// Density per steradian with which sample() finds the environment along a direction.
  WFPG_HD float environment_pdf(const environment_view& environment, vec3 direction) const {
    if (!(total_power > 0.0f)) return 0.0f;
    return environment.pdf(direction) * power_of(environment, scene_radius) / total_power;
  }

  /// Light for a point; draw(dimension) gives random numbers in [0,1)².
  template <class Draw>
  WFPG_HD light_sample sample(const scene_view& scene, vec3 from, const Draw& draw) const {
    if (table.empty()) return {};
    const std::uint32_t light = pick(table, draw(dimension::light_choice));
    if (light < triangles.size())
      return from_emitter(sample_emitter(scene, light, draw(dimension::light_point)), from);
    const std::size_t beyond = light - triangles.size();
    if (beyond < punctual.size()) return from_punctual(punctual[beyond], from);
    const vec3 direction =
        scene.environment.sample(draw(dimension::light_texel), draw(dimension::light_point));
    light_sample sky;
    sky.direction = direction;
    sky.pdf = environment_pdf(scene.environment, direction);
    sky.radiance = scene.environment.radiance(direction);
    sky.is_distant = true;
    return sky;
  }

 private:
  WFPG_HD static light_sample from_emitter(const emitter_point& point, vec3 from) {
    const vec3 toward = point.position - from;
    const float distance = glm::length(toward);
    light_sample light;
    if (!(distance > 0.0f)) return light;
    light.direction = toward / distance;
    light.pdf = solid_angle_pdf(point.pdf, distance, -glm::dot(point.normal, light.direction));
    light.radiance = point.radiance;
    light.end = leave_surface(point.position, point.normal, -light.direction, point.offset);
    return light;
  }

  WFPG_HD light_sample from_punctual(const punctual_light& source, vec3 from) const {
    light_sample light;
    light.is_delta = true;
    light.pdf = power_of(source, scene_radius) / total_power;
    light.is_distant = source.kind == punctual_kind::directional;
    if (light.is_distant) {
      light.direction = -source.direction;
      light.radiance = source.intensity;
      return light;
    }
    light.end = source.position;
    const vec3 toward = source.position - from;
    const float distance = glm::length(toward);
    if (!(distance > 0.0f)) return {};
    light.direction = toward / distance;
    light.radiance = source.intensity * (dimming(source, light.direction) / (distance * distance));
    return light;
  }

  // KHR_lights_punctual, "Inner and Outer Cone Angles".
  WFPG_HD static float dimming(const punctual_light& source, vec3 toward) {
    if (source.kind != punctual_kind::spot) return 1.0f;
    const float cosine = -glm::dot(source.direction, toward);
    const float width = glm::max(1e-3f, source.cos_inner - source.cos_outer);
    const float x = glm::clamp((cosine - source.cos_outer) / width, 0.0f, 1.0f);
    return x * x;
  }
};

/// The distribution over a scene's lights, in the memory of a policy.
template <class Exec>
class light_distribution {
 public:
  light_distribution(const Exec& exec, const scene& host) : radius_(radius_of(host)) {
    std::vector<std::uint32_t> triangles;
    std::vector<double> powers;
    const std::vector<float> luminances = emitted_luminances(host);
    for (std::size_t i = 0; i < host.triangles.size(); ++i) {
      const double power = static_cast<double>(luminances[host.triangle_materials[i]]) * area_of(host, i);
      if (!(power > 0.0)) continue;
      triangles.push_back(static_cast<std::uint32_t>(i));
      powers.push_back(power);
    }
    for (const punctual_light& light : host.punctual_lights)
      powers.push_back(static_cast<double>(light_view::power_of(light, radius_)));
    const double sky_power = host.sky.texels.empty() ? 0.0 : power_of_sky(host);
    if (sky_power > 0.0) powers.push_back(sky_power);
    total_power_ = static_cast<float>(std::accumulate(powers.begin(), powers.end(), 0.0));
    triangles_ = wfpg::buffer<std::uint32_t, Exec>(exec, triangles);
    punctual_ = wfpg::buffer<punctual_light, Exec>(exec, host.punctual_lights);
    if (total_power_ > 0.0f) table_ = wfpg::buffer<alias_column, Exec>(exec, make_alias_table(powers));
  }

  light_view view() const {
    light_view v;
    v.triangles = triangles_.view();
    v.punctual = punctual_.view();
    v.table = table_.view();
    v.total_power = total_power_;
    v.scene_radius = radius_;
    return v;
  }

 private:
  double power_of_sky(const scene& host) const {
    const std::vector<double> powers = texel_powers(host.sky);
    return static_cast<double>(radius_ * radius_) * std::accumulate(powers.begin(), powers.end(), 0.0);
  }

  static double area_of(const scene& host, std::size_t triangle) {
    const uvec3 t = host.triangles[triangle];
    const vec3 a = host.positions[t.x];
    return static_cast<double>(0.5f *
                               glm::length(glm::cross(host.positions[t.y] - a, host.positions[t.z] - a)));
  }

  static float radius_of(const scene& host) {
    wfpg::bounds3 box;
    for (const vec3& p : host.positions) box = {glm::min(box.lower, p), glm::max(box.upper, p)};
    return box.empty() ? 0.0f : 0.5f * glm::length(box.extent());
  }

  wfpg::buffer<std::uint32_t, Exec> triangles_;
  wfpg::buffer<punctual_light, Exec> punctual_;
  wfpg::buffer<alias_column, Exec> table_;
  float total_power_ = 0.0f;
  float radius_ = 0.0f;
};

}  // namespace render
