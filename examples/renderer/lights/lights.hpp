// The lights of a scene, chosen in proportion to their power. They are emitting triangles, sampled uniformly
// by area, lights without extent, and an environment map. BSDFs and guiding find a constant environment.
#pragma once

#include "lights/light_groups.hpp"
#include "scene/alias_table.hpp"
#include "scene/device_scene.hpp"
#include "tracer/rng.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/light/path_weights.hpp>

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
  wfpg::light_end source;   ///< the light as the end of a path that this sample ends, picked of all
};

/// The ray from a point to a light sample. Its t_max is 0 where nothing can be between them.
WFPG_HD inline wfpg::ray ray_toward(vec3 from, const light_sample& light) {
  return light.is_distant ? ray_along(from, light.direction) : ray_between(from, light.end);
}

/// A ray of light that leaves its source.
struct emitted_ray {
  wfpg::ray ray;
  /// Emitted radiance and cosine over all densities of `source`. Zero: nothing is emitted.
  vec3 throughput{0.0f};
  wfpg::light_end source;
  std::uint32_t light = 0;  ///< its column of the table
};

/// Converts a density by area into one by solid angle.
WFPG_HD inline float solid_angle_pdf(float area_pdf, float distance, float cosine) {
  return cosine > 0.0f ? area_pdf * distance * distance / cosine : 0.0f;
}

/// Trivially copyable.
struct light_view {
  wfpg::array_view<const std::uint32_t> lights;  ///< as in grouped_lights
  wfpg::array_view<const punctual_light> punctual;
  wfpg::array_view<const alias_column> table;   ///< by power inside a group, a column a light
  wfpg::array_view<const alias_column> of_all;  ///< by power among all lights, a column a light
  wfpg::array_view<const light_group> groups;
  wfpg::array_view<const std::uint8_t> triangle_groups;  ///< of all triangles; empty: there is one group
  float total_power = 0.0f;   ///< over pi; of an emitter, mean luminance times area
  float scene_radius = 0.0f;  ///< of a sphere around the scene
  vec3 scene_centre{0.0f};    ///< of that sphere
  bool has_fog = false;       ///< no light paths come from infinitely far

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

  /// A light as the end of a path that hits it. `cosine`: at an emitter whose mean luminance is given, of the
  /// way back, positive.
  WFPG_HD wfpg::light_end end_on_emitter(float luminance, float cosine) const {
    return emitter_end(pdf(luminance), cosine);
  }
  WFPG_HD wfpg::light_end end_in_environment(const environment_view& environment, vec3 direction) const {
    return distant_end(environment_pdf(environment, direction), false);
  }

  /// The group of an emitting triangle, and of the environment.
  WFPG_HD std::uint32_t group_of(std::uint32_t triangle) const {
    return triangle_groups.empty() ? 0u : triangle_groups[triangle];
  }
  WFPG_HD std::uint32_t sky_group() const { return static_cast<std::uint32_t>(groups.size() - 1); }

  /// A light of a group, from u in [0,1)². Lights are columns of the table.
  WFPG_HD std::uint32_t pick_in(std::uint32_t group, vec2 u) const {
    const light_group of = groups[group];
    return of.first + pick({table.data() + of.first, of.count}, u);
  }
  /// A light of all. Precondition: there is one.
  WFPG_HD std::uint32_t pick_of_all(vec2 u) const { return pick(of_all, u); }

  /// Samples a light, which is a column of the table, for a point. The density assumes pick_of_all(). After
  /// another choice of group, multiply it by the preference of path_lights::chosen_light. draw(dimension)
  /// returns random numbers in [0,1)².
  template <class Draw>
  WFPG_HD light_sample sample(const scene_view& scene, vec3 from, std::uint32_t light,
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
    sky.source = distant_end(sky.pdf, false);
    return sky;
  }
  /// Picks a light of all, and samples it. There may be none.
  template <class Draw>
  WFPG_HD light_sample sample(const scene_view& scene, vec3 from, const Draw& draw) const {
    if (of_all.empty()) return {};
    return sample(scene, from, pick_of_all(draw(dimension::light_choice)), draw);
  }

  /// Samples a ray of light from all lights. draw(dimension) returns random numbers in [0,1)².
  template <class Draw>
  WFPG_HD emitted_ray emit(const scene_view& scene, const Draw& draw) const {
    if (of_all.empty()) return {};
    const std::uint32_t light = pick_of_all(draw(dimension::light_choice));
    emitted_ray emitted = emit_from(scene, light, draw);
    emitted.light = light;
    return emitted;
  }

  /// Writes where a light is: the middle of an emitter, on the side that emits. False for distant lights.
  WFPG_HD bool find_place(const scene_view& scene, std::uint32_t light, vec3& place) const {
    const std::uint32_t number = lights[light], beyond = number & ~grouped_lights::beyond_triangles;
    if ((number & grouped_lights::beyond_triangles) == 0) {
      const surface_point at = scene.point({number, 1.0f / 3.0f, 1.0f / 3.0f});
      place = leave_surface(at.position, at.geometric_normal, at.geometric_normal, at.offset);
      return true;
    }
    if (!(beyond < punctual.size()) || punctual[beyond].kind == punctual_kind::directional) return false;
    place = punctual[beyond].position;
    return true;
  }

 private:
  template <class Draw>
  WFPG_HD emitted_ray emit_from(const scene_view& scene, std::uint32_t light, const Draw& draw) const {
    const std::uint32_t number = lights[light], beyond = number & ~grouped_lights::beyond_triangles;
    const vec2 u = draw(dimension::light_point), v = draw(dimension::direction);
    if ((number & grouped_lights::beyond_triangles) == 0)
      return emit_from_emitter(sample_emitter(scene, light, u), v);
    if (beyond < punctual.size()) return emit_from_punctual(punctual[beyond], u, v);
    const vec3 toward = scene.environment.sample(draw(dimension::light_texel), v);
    return emit_from_afar(scene.environment.radiance(toward), -toward, u,
                          distant_end(environment_pdf(scene.environment, toward), false));
  }

  WFPG_HD static wfpg::light_end emitter_end(float pdf, float cosine) {
    return {pdf, pdf, cosine / pi, cosine, false, false};
  }
  /// The end at a light infinitely far, by solid angle or with a probability. It shines from a disc, but not
  /// through fog without end.
  WFPG_HD wfpg::light_end distant_end(float pdf, bool is_delta) const {
    return {has_fog ? 0.0f : pdf, pdf, 1.0f / (pi * scene_radius * scene_radius), 1.0f, is_delta, true};
  }
  WFPG_HD wfpg::light_end punctual_end(const punctual_light& source) const {
    const float probability = power_of(source, scene_radius) / total_power;
    if (source.kind == punctual_kind::directional) return distant_end(probability, true);
    return {probability, probability, 1.0f / lit_angle(source), 1.0f, true, false};
  }
  /// The solid angle into which a point or a spot emits.
  WFPG_HD static float lit_angle(const punctual_light& source) {
    return source.kind == punctual_kind::point ? 4.0f * pi : 2.0f * pi * (1.0f - source.cos_outer);
  }

  WFPG_HD static emitted_ray emit_from_emitter(const emitter_point& point, vec2 u) {
    emitted_ray emitted;
    const vec3 above = cosine_hemisphere(u);
    if (!(point.pdf > 0.0f) || !(above.z > 0.0f)) return emitted;
    emitted.ray.direction = glm::normalize(frame(point.normal).to_world(above));
    emitted.ray.origin = leave_surface(point.position, point.normal, emitted.ray.direction, point.offset);
    emitted.throughput = point.radiance * (pi / point.pdf);
    emitted.source = emitter_end(point.pdf, above.z);
    return emitted;
  }

  WFPG_HD emitted_ray emit_from_punctual(const punctual_light& source, vec2 u, vec2 v) const {
    const wfpg::light_end end = punctual_end(source);
    if (source.kind == punctual_kind::directional)
      return emit_from_afar(source.intensity, source.direction, u, end);
    const float least = source.kind == punctual_kind::point ? -1.0f : source.cos_outer;
    const float cosine = 1.0f - v.x * (1.0f - least);
    const float sine = std::sqrt(glm::max(0.0f, 1.0f - cosine * cosine)), angle = 2.0f * pi * v.y;
    emitted_ray emitted;
    emitted.ray.origin = source.position;
    emitted.ray.direction = glm::normalize(
        frame(source.direction).to_world({sine * std::cos(angle), sine * std::sin(angle), cosine}));
    emitted.throughput =
        source.intensity * (dimming(source, -emitted.ray.direction) / (end.pdf_trace * end.pdf_direction));
    emitted.source = end;
    return emitted;
  }

  /// Light of a radiance or irradiance, from a disc that covers the scene.
  WFPG_HD emitted_ray emit_from_afar(vec3 light, vec3 direction, vec2 u, const wfpg::light_end& end) const {
    emitted_ray emitted;
    if (!(end.pdf_trace > 0.0f)) return emitted;
    const vec2 disk = scene_radius * uniform_disk(u);
    emitted.ray.direction = direction;
    emitted.ray.origin = scene_centre + frame(direction).to_world({disk.x, disk.y, -scene_radius});
    emitted.throughput = light / (end.pdf_trace * end.pdf_direction);
    emitted.source = end;
    return emitted;
  }

  WFPG_HD static light_sample from_emitter(const emitter_point& point, vec3 from) {
    const vec3 toward = point.position - from;
    const float distance = glm::length(toward);
    light_sample light;
    if (!(distance > 0.0f)) return light;
    light.direction = toward / distance;
    const float cosine = -glm::dot(point.normal, light.direction);
    light.pdf = solid_angle_pdf(point.pdf, distance, cosine);
    light.source = emitter_end(point.pdf, cosine);
    light.radiance = point.radiance;
    light.end = leave_surface(point.position, point.normal, -light.direction, point.offset);
    return light;
  }

  WFPG_HD light_sample from_punctual(const punctual_light& source, vec3 from) const {
    light_sample light;
    light.is_delta = true;
    light.source = punctual_end(source);
    light.pdf = light.source.pdf_connect;
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
    v.of_all = shares_.size() > 1 ? of_all_.view() : v.table;
    v.groups = groups_.view();
    v.triangle_groups = triangle_groups_.view();
    v.total_power = total_power_;
    v.scene_radius = radius_;
    v.scene_centre = centre_;
    v.has_fog = has_fog_;
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
        radius_(grouped.scene_radius),
        centre_(grouped.scene_centre),
        has_fog_(host.fog.extinction() != vec3(0.0f)) {
    std::vector<alias_column> table;
    for (const light_group& group : grouped.groups) {
      const auto begin = grouped.powers.begin() + group.first;
      const std::vector<alias_column> columns =
          make_alias_table(std::vector<double>(begin, begin + group.count));
      table.insert(table.end(), columns.begin(), columns.end());
      shares_.push_back(group.share);
    }
    table_ = wfpg::buffer<alias_column, Exec>(exec, table);
    if (shares_.size() > 1)
      of_all_ = wfpg::buffer<alias_column, Exec>(exec, make_alias_table(grouped.powers));
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
  wfpg::buffer<alias_column, Exec> of_all_;  // where there are several groups
  std::vector<float> shares_;
  float total_power_;
  float radius_;
  vec3 centre_;
  bool has_fog_;
};

}  // namespace render
