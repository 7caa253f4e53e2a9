// Data of light and camera paths between the kernels of bidirectional methods, and what both kinds of paths
// do alike.
#pragma once

#include "lights/lights.hpp"
#include "scene/camera.hpp"
#include "tracer/path_state.hpp"

#include <wfpg/light/light_vertices.hpp>
#include <wfpg/light/path_weights.hpp>
#include <wfpg/light/splats.hpp>

namespace render {

/// A light or camera path between two vertices.
struct subpath {
  vec3 origin{0.0f};         ///< of the next segment
  std::uint32_t active = 0;  ///< 0: it has ended
  vec3 direction{0.0f, 0.0f, 1.0f};
  float unused = 0.0f;
  vec3 throughput{1.0f};
  wfpg::subpath_weights weights;

  subpath() = default;
  WFPG_HD subpath(vec3 from, vec3 toward, vec3 carries, const wfpg::subpath_weights& begun)
      : origin(from), active(1), direction(toward), throughput(carries), weights(begun) {}

  WFPG_HD wfpg::ray ray() const { return ray_along(origin, direction); }
};

static_assert(sizeof(subpath) == 64, "tiles have pieces of 16 bytes");

/// A vertex of a light or camera path. Nothing is initialised, since vertices are made from a hit or copied.
struct subpath_vertex {
  path_vertex at;  ///< its `normal` is the shading normal on the side of geometric_normal, whoever looks
  vec3 throughput;
  std::uint32_t segments;  ///< of its path so far, at least 1
  wfpg::vertex_weights weights;
  std::uint32_t unused[3];

  subpath_vertex() = default;
  WFPG_HD subpath_vertex(const hit_surface& hit, vec3 carries, std::uint32_t from_end,
                         const wfpg::vertex_weights& arrived)
      : at(hit), throughput(carries), segments(from_end), weights(arrived), unused{} {
    const vec3 normal = hit.shading_normal;
    at.normal = glm::dot(normal, at.geometric_normal) < 0.0f ? -normal : normal;
  }

  /// The BSDF as a path sees it that leaves in that direction, or comes from there.
  WFPG_HD bsdf seen_from(vec3 direction) const {
    bsdf f = at.bsdf();
    orient(f, at.geometric_normal, at.normal, direction);
    return f;
  }
  /// |cos| between the geometric normal and a direction, kept off 0, since densities are divided by it.
  WFPG_HD float cosine(vec3 direction) const {
    return glm::max(std::abs(glm::dot(at.geometric_normal, direction)), 1e-6f);
  }
  /// Flux that arrived from at.outgoing and is scattered in a direction, per steradian. Light comes the other
  /// way than in bsdf::eval_rgb(). Source: Veach 1997, section 5.3, for the cosines of shading normals.
  WFPG_HD vec3 scattered_flux(vec3 direction) const {
    return seen_from(direction).eval_rgb(direction, at.outgoing) * (cosine(direction) / cosine(at.outgoing));
  }
  /// How a path that sees `f` leaves in a direction.
  WFPG_HD wfpg::path_departure leave(const bsdf& f, vec3 direction) const {
    wfpg::path_departure to;
    to.pdf = f.pdf(at.outgoing, direction);
    to.pdf_back = seen_from(direction).pdf(direction, at.outgoing);
    to.cosine = cosine(direction);
    return to;
  }
  /// Where a ray begins that leaves in a direction, which need not have unit length.
  WFPG_HD vec3 leave_along(vec3 direction) const {
    return leave_surface(at.position, at.geometric_normal, direction, at.offset);
  }
};

static_assert(sizeof(subpath_vertex) == 128, "tiles have pieces of 16 bytes");

/// The scene and its lights for bidirectional kernels, with an inline caster.
template <class Caster>
struct bidirectional_world {
  scene_view scene;
  light_view lights;
  Caster caster;
  wfpg::path_techniques techniques;
  random_stream random;
  std::uint32_t max_depth = 1;  ///< most segments of a whole path

  /// Moves a path along its ray. Writes the vertex where it arrives. False where it leaves the scene.
  WFPG_HD bool arrive(const subpath& path, std::uint32_t segments, subpath_vertex& vertex,
                      hit_surface& found) const {
    const triangle_hit hit = caster.intersect(path.ray());
    if (!hit.is_hit()) return false;
    found = scene.surface(hit, -path.direction);
    const float distance = glm::max(glm::length(found.surface.position - path.origin), 1e-12f);
    vec3 throughput = path.throughput;
    if (found.absorption != vec3(0.0f)) throughput *= glm::exp(-found.absorption * distance);
    wfpg::path_arrival arrival;
    arrival.distance = distance;
    arrival.cosine = glm::max(std::abs(glm::dot(found.surface.geometric_normal, path.direction)), 1e-6f);
    vertex = subpath_vertex(found, throughput, segments, path.weights.arrive(arrival));
    return true;
  }

  /// Whether nothing lies between a vertex and a point that is `end` off its own surface.
  WFPG_HD bool sees(const subpath_vertex& from, vec3 end) const {
    return is_clear(ray_between(from.leave_along(end - from.at.position), end));
  }
  /// Whether nothing lies on a ray. Its t_max may be 0.
  WFPG_HD bool is_clear(const wfpg::ray& ray) const { return !(ray.t_max > 0.0f) || !caster.occluded(ray); }

  WFPG_HD vec2 draw(std::uint32_t path, std::uint32_t segments, std::uint32_t use) const {
    return random(path, segments * dimension::per_vertex + use);
  }

  /// Continues a path from its vertex in a direction that the BSDF samples. `carries_flux`: it is a light
  /// path. False where it ends.
  WFPG_HD bool scatter(const subpath_vertex& vertex, vec2 u, bool carries_flux, subpath& path) const {
    const vec3 outgoing = vertex.at.outgoing;
    const bsdf f = vertex.seen_from(outgoing);
    const wfpg::bsdf_sample drawn = f.sample(outgoing, u);
    if (!(drawn.pdf > 0.0f)) return false;
    const vec3 direction = drawn.direction;
    const bool is_delta = drawn.is_delta || f.is_delta();
    vec3 weight;
    wfpg::path_departure to;
    if (is_delta) {
      weight = f.delta_weight_rgb(outgoing, direction, drawn.pdf);
      // Refraction changes radiance, but not flux.
      if (carries_flux) {
        const float eta = f.ior_beyond(outgoing, direction);
        const float shading = std::abs(glm::dot(outgoing, f.normal) / glm::dot(direction, f.normal));
        weight *= eta * eta * shading * vertex.cosine(direction) / vertex.cosine(outgoing);
      }
      to.kind = wfpg::scattering_kind::delta;
      to.pdf = drawn.pdf;
      to.cosine = vertex.cosine(direction);
    } else {
      const vec3 value = carries_flux ? vertex.scattered_flux(direction) : f.eval_rgb(outgoing, direction);
      weight = value / drawn.pdf;
      to = vertex.leave(f, direction);
      to.pdf = drawn.pdf;
    }
    if (!(wfpg::luminance(weight) > 0.0f)) return false;
    path = subpath(vertex.leave_along(direction), direction, vertex.throughput * weight,
                   vertex.weights.depart(techniques, to));
    return true;
  }
};

}  // namespace render
