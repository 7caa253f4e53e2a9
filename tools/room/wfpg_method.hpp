// wfpg's kept fields in the analytic room: a path has one direction from a random point of the walls.
// It finds the radiance of the wall that it hits.
#pragma once

#include "method.hpp"

#include <wfpg/exec/omp.hpp>
#include <wfpg/path_guider.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace room {

/// A white diffuse BSDF. `normal`: on the side of both directions.
struct lambert {
  vec3 normal{0.0f, 0.0f, 1.0f};
  float eval(vec3, vec3 incident) const { return wfpg::max(glm::dot(incident, normal), 0.0f) / wfpg::pi; }
  float pdf(vec3 outgoing, vec3 incident) const { return eval(outgoing, incident); }
  wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    const float r = std::sqrt(u.x), phi = 2.0f * wfpg::pi * u.y;
    const vec3 direction =
        wfpg::frame(normal).to_world({r * std::cos(phi), r * std::sin(phi), std::sqrt(1.0f - u.x)});
    return {direction, pdf(outgoing, direction)};
  }
  bool is_delta() const { return false; }
  bool transmits() const { return false; }
};

inline wfpg::surface<lambert> surface_at(const wall_point& p) {
  const vec3 n = normal_of(p.wall);
  return {p.position, n, n, n, {n}};
}

/// Numbers that all methods share: where a path begins, and what it draws its direction from.
struct path_numbers {
  std::uint64_t seed = 0;
  vec2 operator()(std::uint32_t path, std::uint32_t dimension) const {
    return wfpg::unit_vec2(wfpg::hash(wfpg::hash(seed, dimension), path));
  }
  /// Where a path begins: uniform over the walls.
  wall_point origin(std::uint32_t path) const {
    return point_on(static_cast<int>((*this)(path, 2).x * walls), (*this)(path, 3));
  }
};

/// Surfaces of a wave: those of stored places, or where paths begin.
struct wave_surfaces {
  wfpg::array_view<const wall_point> places;
  path_numbers numbers;
  wfpg::surface<lambert> operator()(std::uint32_t ray) const {
    return surface_at(places.size() > 0 ? places[ray] : numbers.origin(ray));
  }
};

/// Casts the cones of fields.
struct wall_caster {
  wfpg::ray_hit operator()(const wfpg::ray& r) const {
    float nearest = 3.0e38f;
    for (int axis = 0; axis < 3; ++axis)
      if (r.direction[axis] != 0.0f) {
        const float wall = r.direction[axis] > 0.0f ? 1.0f : 0.0f;
        nearest = wfpg::min(nearest, wfpg::max((wall - r.origin[axis]) / r.direction[axis], 0.0f));
      }
    return {nearest, 0.0f};
  }
};

/// The cube as triangles.
struct cube {
  std::vector<vec3> positions;
  std::vector<wfpg::uvec3> triangles;
  cube() {
    for (int wall = 0; wall < walls; ++wall) {
      const auto first = static_cast<std::uint32_t>(positions.size());
      for (const vec2 corner : {vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 1)})
        positions.push_back(point_on(wall, corner).position);
      triangles.push_back({first, first + 1, first + 2});
      triangles.push_back({first, first + 2, first + 3});
    }
  }
  wfpg::triangle_mesh_view view() const {
    return {{positions.data(), positions.size()}, {triangles.data(), triangles.size()}};
  }
};

/// Options of the guider of a method.
inline wfpg::kept_guide_options wfpg_options(const settings& set, std::size_t places) {
  wfpg::kept_guide_options options;
  options.kept.resolution = set.slot_resolution;
  options.kept.budget_bytes = static_cast<std::size_t>(set.budget_mib * 0x1p20);
  options.field.filter_alpha = set.filter_alpha;
  options.field.floor = set.floor;
  options.max_rays = std::max(set.paths, places);
  options.deposit_capacity = set.paths;  // deposits without the recorder
  options.least_gain = 0.0f;             // never rests
  return options;
}

/// A guider of the room, which learns from paths of its own.
class wfpg_method {
 public:
  wfpg_method(const wall_light& light, const wfpg::kept_guide_options& options)
      : light_(light), guider_(exec_, cube().view(), options), drawn_(options.deposit_capacity.value()) {}

  /// Makes and learns the paths of one sample.
  void train(std::uint64_t seed) {
    const auto paths = static_cast<std::uint32_t>(drawn_.size());
    const path_numbers numbers{seed};
    guider_.begin_sample();
    guider_.sample_directions(wfpg::wave{0u, drawn_.size(), wave_surfaces{{}, numbers}, numbers},
                              wall_caster(), {drawn_.data(), drawn_.size()});
    // The recorder would take walls for surfaces that reflect what paths find, and deposit that, too.
    const wfpg::learnt_radiance_view learnt = guider_.guide().learnt();
    for (std::uint32_t path = 0; path < paths; ++path) {
      const wall_point from = numbers.origin(path);
      const vec3 normal = normal_of(from.wall);
      const wfpg::sampled_direction& next = drawn_[path];
      if (!(next.pdf > 0.0f) || !(glm::dot(next.direction, normal) > 0.0f)) continue;
      const wall_point at = hit_from(from, next.direction);
      const float radiance = light_.radiance(at);
      cache().deposit(at.position, -next.direction, radiance);
      if (next.field == wfpg::no_field) continue;
      learnt.deposit(next.field, next.direction, radiance);
      learnt.weigh(next.field, radiance * lambert{normal}.eval(normal, next.direction) / next.pdf,
                   next.share);
    }
    guider_.end_sample();
  }
  /// Variances at places. `unguided` becomes the number of places without a field.
  variances measure_at(const std::vector<wall_point>& places, std::size_t& unguided) {
    guider_.begin_sample();
    const wfpg::guide_view view = guider_.prepare(
        wfpg::wave{0u, places.size(), wave_surfaces{{places.data(), places.size()}, {}}, wfpg::no_random{}},
        wall_caster());
    unguided = 0;
    for (std::uint32_t i = 0; i < places.size(); ++i) unguided += view.guides(i) ? 0 : 1;
    return measure(light_, places, [&](std::size_t i, vec3 direction) {
      const auto ray = static_cast<std::uint32_t>(i);
      const vec3 normal = normal_of(places[i].wall);
      return view.guides(ray) ? view.pdf(ray, direction) : lambert{normal}.pdf(normal, direction);
    });
  }
  /// The directions of the last sample's paths.
  const std::vector<wfpg::sampled_direction>& drawn() const { return drawn_; }
  /// The light that the paths found, by voxel.
  wfpg::exitance_cache_view cache() const { return guider_.guide().cache(); }
  /// The fields after training.
  wfpg::kept_field_statistics fields() const { return guider_.statistics().kept; }

 private:
  wfpg::exec::omp exec_;
  wall_light light_;
  wfpg::path_guider<wfpg::exec::omp> guider_;
  std::vector<wfpg::sampled_direction> drawn_;
};

}  // namespace room
