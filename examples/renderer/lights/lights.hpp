// The lights of a scene, chosen in proportion to their power. They are emitting triangles, sampled uniformly
// by area, lights without extent, and an environment map. BSDFs and guiding find a constant environment.
#pragma once

#include "lights/light_groups.hpp"
#include "scene/alias_table.hpp"
#include "scene/device_scene.hpp"
#include "tracer/rng.hpp"

#include <wfpg/guides/octree/light_guide.hpp>

namespace render {

/// A point on an emitter.
struct emitter_point {
  vec3 position{0.0f};
  vec3 normal{0.0f};  ///< geometric, unit length, on the side that emits
  vec3 radiance{0.0f};
  float pdf = 0.0f;     ///< per unit area
  float offset = 0.0f;  ///< as in surface_point
};

/// Light at a point from one direction.
struct light_sample {
  vec3 direction{0.0f};  ///< toward the light, unit length
  float pdf = 0.0f;     ///< per steradian, or the probability of a light without extent; 0: there is no light
  vec3 radiance{0.0f};  ///< of a light without extent: irradiance of a surface that faces it
  bool is_delta = false;    ///< it has no extent
  bool is_distant = false;  ///< `end` has no meaning
  vec3 end{0.0f};           ///< where a ray toward it ends
};

/// Converts a density by area into one by solid angle.
WFPG_HD inline float solid_angle_pdf(float area_pdf, float distance, float cosine) {
  return cosine > 0.0f ? area_pdf * distance * distance / cosine : 0.0f;
}

/// Trivially copyable.
struct light_view {
  wfpg::array_view<const std::uint32_t> lights;  ///< as in grouped_lights
  wfpg::array_view<const punctual_light> punctual;
  wfpg::array_view<const alias_column> table;  ///< by power inside a group, a column a light
  wfpg::array_view<const light_group> groups;
  wfpg::array_view<const std::uint8_t> triangle_groups;  ///< of all triangles; empty: there is one group
  float total_power = 0.0f;   ///< over pi; of an emitter, mean luminance times area
  float scene_radius = 0.0f;  ///< of a sphere around the scene

  /// Power over pi of light that may hit a scene of that radius.
  WFPG_HD static float power_of(const punctual_light& source, float radius) {
    const float luminance = wfpg::luminance(source.intensity);
    if (source.kind == punctual_kind::directional) return radius * radius * luminance;
    return (source.kind == punctual_kind::point ? 4.0f : 2.0f * (1.0f - source.cos_outer)) * luminance;
  }

  WFPG_HD static float power_of(const environment_view& environment, float radius) {
    return radius * radius * environment.total();
  }

  /// Density by area of any point on an emitter with this mean luminance.
  WFPG_HD float pdf(float luminance) const { return total_power > 0.0f ? luminance / total_power : 0.0f; }

  /// A point on the emitter in a column of the table.
  WFPG_HD emitter_point sample_emitter(const scene_view& scene, std::uint32_t light, vec2 u) const {
    const float root = std::sqrt(u.x);
    const triangle_hit hit{lights[light], root * (1.0f - u.y), root * u.y};
    const surface_point at = scene.point(hit);
    const vec3 radiance =
        scene.is_cut_out(hit) ? vec3(0.0f) : scene.emitted(scene.materials[at.material], at.uv);
    return {at.position, at.geometric_normal, radiance, pdf(scene.emitted_luminances[at.material]),
            at.offset};
  }

  /// Density of sample() for the environment along a direction, per steradian.
  WFPG_HD float environment_pdf(const environment_view& environment, vec3 direction) const {
    if (!(total_power > 0.0f)) return 0.0f;
    return environment.pdf(direction) * power_of(environment, scene_radius) / total_power;
  }

  /// The group of an emitting triangle, and of the environment.
  WFPG_HD std::uint32_t group_of(std::uint32_t triangle) const {
    return triangle_groups.empty() ? 0u : triangle_groups[triangle];
  }
  WFPG_HD std::uint32_t sky_group() const { return static_cast<std::uint32_t>(groups.size() - 1); }

  /// Samples light for a point from the chosen group. draw(dimension) returns random numbers in [0,1)².
  template <class Draw>
  WFPG_HD light_sample sample(const scene_view& scene, vec3 from, const wfpg::light_choice& choice,
                              const Draw& draw) const {
    if (table.empty()) return {};
    const light_group group = groups[choice.group];
    const std::uint32_t column =
        pick({table.data() + group.first, group.count}, draw(dimension::light_choice));
    light_sample light = sample_light(scene, from, group.first + column, draw);
    light.pdf *= choice.probability / group.share;
    return light;
  }

 private:
  /// Samples light as if all lights were one group.
  template <class Draw>
  WFPG_HD light_sample sample_light(const scene_view& scene, vec3 from, std::uint32_t light,
                                    const Draw& draw) const {
    const std::uint32_t number = lights[light];
    if ((number & grouped_lights::beyond_triangles) == 0)
      return from_emitter(sample_emitter(scene, light, draw(dimension::light_point)), from);
    const std::uint32_t beyond = number & ~grouped_lights::beyond_triangles;
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

/// The distribution over a scene's lights, in a policy's memory.
template <class Exec>
class light_distribution {
 public:
  /// Throws std::invalid_argument if the lights' sum is above largest_light_power.
  light_distribution(const Exec& exec, const scene& host, std::uint32_t most_groups = 1)
      : light_distribution(exec, host, group_lights(host, most_groups)) {}

  light_view view() const {
    light_view v;
    v.lights = lights_.view();
    v.punctual = punctual_.view();
    v.table = table_.view();
    v.groups = groups_.view();
    v.triangle_groups = triangle_groups_.view();
    v.total_power = total_power_;
    v.scene_radius = radius_;
    return v;
  }

  /// The fraction of each group in the lights' power.
  const std::vector<float>& shares() const { return shares_; }

 private:
  light_distribution(const Exec& exec, const scene& host, const grouped_lights& grouped)
      : lights_(exec, grouped.lights),
        punctual_(exec, host.punctual_lights),
        groups_(exec, grouped.groups),
        triangle_groups_(exec, grouped.triangle_groups),
        total_power_(checked(grouped.total_power)),
        radius_(grouped.scene_radius) {
    std::vector<alias_column> table;
    for (const light_group& group : grouped.groups) {
      const auto begin = grouped.powers.begin() + group.first;
      const std::vector<alias_column> columns =
          make_alias_table(std::vector<double>(begin, begin + group.count));
      table.insert(table.end(), columns.begin(), columns.end());
      shares_.push_back(group.share);
    }
    table_ = wfpg::buffer<alias_column, Exec>(exec, table);
  }

  static float checked(double total_power) {
    wfpg::require(total_power <= largest_light_power, "the sum of radiance times area over all lights",
                  total_power, "at most 1e+30");
    return static_cast<float>(total_power);
  }

  wfpg::buffer<std::uint32_t, Exec> lights_;
  wfpg::buffer<punctual_light, Exec> punctual_;
  wfpg::buffer<light_group, Exec> groups_;
  wfpg::buffer<std::uint8_t, Exec> triangle_groups_;
  wfpg::buffer<alias_column, Exec> table_;
  std::vector<float> shares_;
  float total_power_;
  float radius_;
};

}  // namespace render
