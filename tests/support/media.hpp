// Scenes of media whose light is known, and what is known of it.
#pragma once

#include "app/render.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/scene_builder.hpp"
#include "support/catch.hpp"
#include "support/pictures.hpp"
#include "support/sample_means.hpp"

#include <wfpg/light/path_weights.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace render_test {

using namespace render;
using wfpg::testing::sample_mean;

inline constexpr double pi_of_doubles = 3.14159265358979323846;

/// A camera that sees one direction in all its pixels, so that they are independent samples.
inline void look_along(scene& s, vec3 from, vec3 direction) {
  s.view.position = from;
  s.view.forward = glm::normalize(direction);
  s.view.up = std::abs(direction.y) < 0.9f * glm::length(direction) ? vec3(0, 1, 0) : vec3(0, 0, -1);
  s.view.vertical_fov = 1e-4f;
}

/// The mean of a channel over pixels.
inline sample_mean channel_of(const image& picture, int channel) {
  sample_mean mean;
  for (const vec3& pixel : picture.pixels) mean.add(double(pixel[channel]));
  return mean;
}

inline image picture_of(const scene& s, const render_options& options) {
  return render::render(s, options, {}).picture;
}

/// The length of a segment inside of a box, which may be empty.
inline double length_inside(const wfpg::bounds3& box, glm::dvec3 from, glm::dvec3 to) {
  if (box.empty()) return 0.0;
  double begin = 0.0, end = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = to[axis] - from[axis];
    const double near = (double(box.lower[axis]) - from[axis]) / way,
                 far = (double(box.upper[axis]) - from[axis]) / way;
    begin = std::max(begin, std::min(near, far));
    end = std::min(end, std::max(near, far));
  }
  return std::max(end - begin, 0.0) * glm::length(to - from);
}

/// Checks that a scene's picture has the same bits on all policies of the CPU, and is not black.
inline void check_same_on_policies(const scene& s, render_options options) {
  options.where = device::seq;
  const std::vector<vec3> serial = picture_of(s, options).pixels;
  CHECK(mean_of(serial) > 0.0);
  for (const device where : {device::omp, device::cpu}) {
    options.where = where;
    CHECK(same_bits(picture_of(s, options).pixels, serial));
  }
}

/// Light of a lamp or spot that a fog scatters once toward the eye, in one channel. Simpson's rule with that
/// even number of steps. There is no fog in `clear`.
inline double airlight(const scene& s, int channel, const wfpg::bounds3& clear = {}, int steps = 20000) {
  const punctual_light& lamp = s.punctual_lights.at(0);
  const auto g = double(s.fog.g), scattering = double(s.fog.scattering[channel]),
             extinction = double(s.fog.extinction()[channel]);
  const glm::dvec3 eye(s.view.position), direction(glm::normalize(glm::dvec3(s.view.forward))),
      from(lamp.position);
  const double begin = length_inside(clear, eye, eye + 1000.0 * direction);
  const auto integrand = [&](double t) {
    const glm::dvec3 point = eye + t * direction, from_lamp = point - from;
    const double distance = glm::length(from_lamp), turn = glm::dot(from_lamp / distance, -direction);
    const double phase = (1.0 - g * g) / (4.0 * pi_of_doubles * std::pow(1.0 + g * g - 2.0 * g * turn, 1.5));
    double dimming = 1.0;  // KHR_lights_punctual
    if (lamp.kind == punctual_kind::spot) {
      const double cosine = glm::dot(from_lamp / distance, glm::dvec3(lamp.direction));
      const double outer = double(lamp.cos_outer), inner = double(lamp.cos_inner);
      dimming = std::pow(std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0), 2.0);
    }
    const double in_fog = t - begin + distance - length_inside(clear, from, point);
    return dimming * scattering * phase * std::exp(-extinction * in_fog) / (distance * distance);
  };
  const double end = begin + 30.0 / extinction;
  const double step = (end - begin) / steps;
  double sum = integrand(begin) + integrand(end);
  for (int i = 1; i < steps; ++i) sum += (i % 2 == 1 ? 4.0 : 2.0) * integrand(begin + step * i);
  return double(lamp.intensity[channel]) * sum * step / 3.0;
}

/// The light of airlight() where a technique merges within a radius, in endless fog. The mean of merges is
/// light along rays beside the camera's own: in a disc with beams, in a ball with points. Where the ray
/// passes the lamp at H, photon beams that pass the ray at h come to sqrt(H^2 - h^2) from the lamp there. The
/// radius is below H, and a spot shines across the ray.
inline double merged_airlight(const scene& s, int channel, wfpg::merge_technique by, double radius) {
  const glm::dvec3 eye(s.view.position), direction(glm::normalize(glm::dvec3(s.view.forward)));
  const glm::dvec3 from_lamp = eye - glm::dvec3(s.punctual_lights.at(0).position);
  const glm::dvec3 across = from_lamp - glm::dot(from_lamp, direction) * direction;
  const double passes = glm::length(across);
  const glm::dvec3 outward = across / passes, aside = glm::cross(direction, outward);
  scene moved = s;
  double sum = 0.0, weights = 0.0;
  const auto add = [&](const glm::dvec3& by_vector, double weight) {
    moved.view.position = vec3(eye + by_vector);
    sum += weight * airlight(moved, channel, {}, 1000);
    weights += weight;
  };
  constexpr int rings = 12, angles = 8, heights = 8;
  for (int ring = 0; ring < rings; ++ring) {
    const double part = (ring + 0.5) / rings, epanechnikov = 1.0 - part * part;
    if (by == wfpg::merge_technique::beams) {
      const double sine = part * radius / passes, square = 1.0 - sine * sine;
      add(passes * ((square - 1.0) * outward + sine * std::sqrt(square) * aside), epanechnikov);
    }
    for (int angle = 0; angle < angles && by != wfpg::merge_technique::beams; ++angle) {
      const double phi = pi_of_doubles * (angle + 0.5) / angles;  // the other half is alike
      const glm::dvec3 way = std::cos(phi) * outward + std::sin(phi) * aside;
      if (by == wfpg::merge_technique::beam_points) add(part * radius * way, part * epanechnikov);
      for (int height = 0; height < heights && by == wfpg::merge_technique::volume_points; ++height) {
        const double cosine = 2.0 * (height + 0.5) / heights - 1.0;
        add(part * radius * (std::sqrt(1.0 - cosine * cosine) * way + cosine * direction), part * part);
      }
    }
  }
  return sum / weights;
}

/// Chandrasekhar's H function for isotropic scattering of an albedo. Source: Chandrasekhar 1960, "Radiative
/// Transfer", section 38. 1/H(mu) = sqrt(1 - w) + w/2 int_0^1 x H(x) / (mu + x) dx. Its integral is known.
class h_function {
 public:
  explicit h_function(double albedo) : albedo_(albedo), values_(nodes, 1.0) {
    for (int round = 0; round < 400; ++round) {
      std::vector<double> next;
      for (int i = 0; i < nodes; ++i) next.push_back((*this)(at(i)));
      values_ = next;
    }
    double integral = 0.0;
    for (const double value : values_) integral += value / nodes;
    REQUIRE(integral == Approx(2.0 / albedo * (1.0 - std::sqrt(1.0 - albedo))).epsilon(1e-4));
  }
  double operator()(double mu) const {
    double sum = 0.0;
    for (int i = 0; i < nodes; ++i) sum += at(i) * values_[std::size_t(i)] / (mu + at(i));
    return 1.0 / (std::sqrt(1.0 - albedo_) + 0.5 * albedo_ * sum / nodes);
  }

 private:
  static constexpr int nodes = 400;
  static double at(int i) { return (i + 0.5) / nodes; }

  double albedo_;
  std::vector<double> values_;
};

/// A closed box whose walls emit radiance 1 and reflect half: all radiance in it is 2, whatever scatters.
inline scene_builder emitting_box(const std::string& name) {
  scene_builder b(name);
  material wall;
  wall.base_color = vec3(0.5f);
  wall.emission = vec3(1.0f);
  const auto m = b.add(wall);
  b.room({vec3(-1.0f), vec3(1.0f)}, {m, m, m, m, m, m});
  b.look({0.1f, 0.2f, 0.9f}, {0.0f, 0.0f, -1.0f}, 0.9f);
  return b;
}

inline material solid(float ior, vec3 absorption, int priority = 0) {
  material m;
  m.kind = material_kind::dielectric;
  m.base_color = vec3(1.0f);
  m.ior = ior;
  m.absorption = absorption;
  m.priority = priority;
  return m;
}

/// The same with fog and, where asked for, solids. Nothing in it absorbs.
inline scene white_furnace(bool solids) {
  scene_builder b = emitting_box("white-furnace");
  if (solids) {  // flat ones: where smooth normals refract, some light is lost
    b.box({{0.3f, -0.3f, 0.0f}, vec3(0.6f), 0.7f}, b.add(solid(1.5f, vec3(0.0f), 2)));
    material cloudy = solid(1.3f, vec3(0.0f), 1);
    cloudy.scattering = {2.0f, 1.5f, 2.5f};
    b.box({{0.0f, -0.4f, -0.2f}, vec3(0.9f), 0.3f}, b.add(cloudy));
    material unbent = solid(1.0f, vec3(0.0f), 3);
    unbent.scattering = {1.0f, 1.4f, 1.2f};
    unbent.g = -0.5f;
    b.box({{-0.3f, 0.2f, 0.1f}, vec3(0.55f), 1.1f}, b.add(unbent));
  }
  scene s = b.finish(8);
  s.fog = {vec3(0.0f), {0.8f, 1.0f, 1.2f}, 0.7f};
  return s;
}

/// A fog of several colours in a box with a lamp, a ball of glass and a scattering block that overlap.
inline scene foggy_box() {
  scene_builder b("foggy-box");
  const auto white = b.diffuse(vec3(0.7f)), lamp = b.lamp(vec3(2.0f, 1.8f, 1.2f));
  b.room({vec3(-1.0f), vec3(1.0f)}, {white, white, white, white, white, white});
  b.ceiling_lamp({0.0f, 0.98f, 0.0f}, {1.9f, 1.9f}, lamp);
  b.sphere({0.4f, -0.5f, 0.0f}, 0.4f, 12, b.add(solid(1.5f, {0.1f, 0.5f, 0.9f}, 1)));
  material wax = solid(1.0f, {0.1f, 0.2f, 0.4f});
  wax.scattering = vec3(3.0f);
  wax.g = 0.2f;
  b.box({{-0.2f, -0.5f, 0.0f}, {0.6f, 0.6f, 0.6f}, 0.3f}, b.add(wax));
  b.look({0.1f, 0.2f, 0.9f}, {0.0f, -0.2f, -1.0f}, 1.2f);
  scene s = b.finish(8);
  s.fog = {{0.05f, 0.1f, 0.2f}, {0.4f, 0.3f, 0.2f}, 0.6f};
  return s;
}

}  // namespace render_test
