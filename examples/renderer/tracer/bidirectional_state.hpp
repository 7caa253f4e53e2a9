// Data of light and camera paths between the kernels of bidirectional methods, and what both kinds of paths
// do alike.
#pragma once

#include "lights/lights.hpp"
#include "scene/camera.hpp"
#include "tracer/media_ways.hpp"
#include "tracer/path_observer.hpp"
#include "tracer/path_state.hpp"

#include <wfpg/host/phase.hpp>
#include <wfpg/light/light_vertices.hpp>
#include <wfpg/light/path_weights.hpp>
#include <wfpg/light/photon_estimators.hpp>
#include <wfpg/light/splats.hpp>

namespace render {

/// A light or camera path between two vertices.
struct subpath {
  vec3 origin{0.0f};              ///< of the next segment
  std::uint32_t from_medium = 0;  ///< 1: the path scattered in a medium there
  vec3 direction{0.0f, 0.0f, 1.0f};
  float begun_luminance = 1.0f;  ///< of the throughput when the path began
  vec3 throughput{1.0f};         ///< with roulette
  wfpg::subpath_weights weights;
  solid_stack solids;  ///< around the segment's begin

  subpath() = default;
  WFPG_HD subpath(const wfpg::ray& begun, vec3 carries, const wfpg::subpath_weights& begun_weights,
                  const solid_stack& around)
      : origin(begun.origin),
        direction(begun.direction),
        begun_luminance(wfpg::luminance(carries)),
        throughput(carries),
        weights(begun_weights),
        solids(around) {}

  WFPG_HD wfpg::ray ray() const { return ray_along(origin, direction); }
};

static_assert(sizeof(subpath) == 80, "tiles have pieces of 16 bytes");

/// How a vertex scatters, by a BSDF or by a phase function, as a path sees it. Directions are a BSDF's.
struct scatterer {
  bsdf surface;
  wfpg::henyey_greenstein phase;
  bool in_medium = false;

  WFPG_HD bool is_delta() const { return !in_medium && surface.is_delta(); }
  WFPG_HD vec3 eval_rgb(vec3 outgoing, vec3 incident) const {
    return in_medium ? vec3(phase.eval(outgoing, incident)) : surface.eval_rgb(outgoing, incident);
  }
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    return in_medium ? phase.pdf(outgoing, incident) : surface.pdf(outgoing, incident);
  }
  WFPG_HD wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    return in_medium ? phase.sample(outgoing, u) : surface.sample(outgoing, u);
  }
};

/// A vertex of a light or camera path. Nothing is initialised, since vertices are made from a hit or copied.
struct subpath_vertex {
  /// On surfaces. Its `normal` is the shading normal on the side of geometric_normal, whoever looks. In a
  /// medium it has a position and `outgoing` alone.
  path_vertex at;
  vec3 throughput;         ///< of the path that arrives; in a medium with scattering
  std::uint32_t segments;  ///< of its path so far, at least 1
  wfpg::vertex_weights weights;
  solid_stack solids;      ///< around it, on a surface on the side of at.outgoing
  std::uint32_t material;  ///< of the surface, or of the solid whose medium it is in
  float extinction;        ///< of that medium, mean of its channels; 0 on surfaces
  float g;                 ///< of that medium

  subpath_vertex() = default;
  WFPG_HD subpath_vertex(const hit_surface& hit, const path_segment& arrived, std::uint32_t from_end,
                         const wfpg::vertex_weights& arrived_weights)
      : at(hit),
        throughput(arrived.throughput),
        segments(from_end),
        weights(arrived_weights),
        solids(arrived.solids),
        material(arrived.material),
        extinction(0.0f),
        g(0.0f) {
    const vec3 normal = hit.shading_normal;
    at.normal = glm::dot(normal, at.geometric_normal) < 0.0f ? -normal : normal;
  }
  /// In a medium.
  WFPG_HD subpath_vertex(vec3 position, vec3 outgoing, const medium& around, std::uint32_t solid,
                         const path_segment& arrived, std::uint32_t from_end,
                         const wfpg::vertex_weights& arrived_weights)
      : at(hit_surface()),
        throughput(arrived.throughput),
        segments(from_end),
        weights(arrived_weights),
        solids(arrived.solids),
        material(solid),
        extinction(mean_extinction(around)),
        g(around.g) {
    at.position = position;
    at.outgoing = outgoing;
  }

  WFPG_HD vec3 position() const { return at.position; }
  WFPG_HD bool in_medium() const { return extinction > 0.0f; }
  /// Whether nothing can be joined with it.
  WFPG_HD bool is_delta() const { return !in_medium() && is_smooth(at.kind); }
  /// Of a medium that scatters, at least 1e-30, so that it tells a vertex in a medium.
  WFPG_HD static float mean_extinction(const medium& around) {
    const vec3 sigma = around.extinction();
    return glm::max((sigma.x + sigma.y + sigma.z) / 3.0f, 1e-30f);
  }

  /// How it scatters for a path that leaves in that direction, or comes from there.
  WFPG_HD scatterer seen_from(vec3 direction) const {
    scatterer f;
    f.in_medium = in_medium();
    if (f.in_medium) {
      f.phase.g = g;
    } else {
      f.surface = at.bsdf();
      orient(f.surface, at.geometric_normal, at.normal, direction);
    }
    return f;
  }
  /// |cos| between the geometric normal and a direction, kept off 0, since densities are divided by it. 1 in
  /// media.
  WFPG_HD float cosine(vec3 direction) const {
    return in_medium() ? 1.0f : glm::max(std::abs(glm::dot(at.geometric_normal, direction)), 1e-6f);
  }
  /// Flux that arrived from at.outgoing and is scattered in a direction, per steradian. Light comes the other
  /// way than in scatterer::eval_rgb(). Source: Veach 1997, section 5.3, for the cosines of shading normals.
  WFPG_HD vec3 scattered_flux(vec3 direction) const {
    return seen_from(direction).eval_rgb(direction, at.outgoing) * (cosine(direction) / cosine(at.outgoing));
  }
  /// How a path that sees `f` leaves in a direction.
  WFPG_HD wfpg::path_departure leave(const scatterer& f, vec3 direction) const {
    wfpg::path_departure to;
    to.pdf = f.pdf(at.outgoing, direction);
    to.pdf_back = seen_from(direction).pdf(direction, at.outgoing);
    to.cosine = cosine(direction);
    if (!f.in_medium) return to;
    to.kind = wfpg::scattering_kind::medium;
    to.sine = glm::max(glm::length(glm::cross(at.outgoing, direction)), 1e-6f);
    to.extinction = extinction;
    return to;
  }
  /// Where a ray begins that leaves in a direction, which need not have unit length.
  WFPG_HD vec3 leave_along(vec3 direction) const {
    return in_medium() ? at.position : leave_surface(at.position, at.geometric_normal, direction, at.offset);
  }
  /// The ray to a point that is off its own surface.
  WFPG_HD wfpg::ray ray_to(vec3 end) const { return ray_between(leave_along(end - at.position), end); }
  /// The solids around a ray that leaves in a direction.
  WFPG_HD solid_stack solids_along(const scene_view& scene, vec3 direction) const {
    if (in_medium() || !scene.has_solids) return solids;
    return solids_beyond(scene, solids, material, at.geometric_normal, at.outgoing, direction);
  }
};

static_assert(sizeof(subpath_vertex) == 144, "tiles have pieces of 16 bytes");

/// A light path's segment in one medium. Nothing is initialised.
struct light_beam {
  wfpg::path_beam beam;           ///< from where the path leaves its vertex
  vec3 throughput;                ///< where the beam begins
  std::uint32_t segments;         ///< of the path, with this one
  wfpg::subpath_weights weights;  ///< of the path as it leaves its vertex
  way_densities before;           ///< of getting to the beam's begin
  std::uint32_t solid;            ///< whose medium it is in
  std::uint32_t begins_inside;    ///< 1: the path scattered where the beam begins

  light_beam() = default;
  WFPG_HD light_beam(const subpath& path, const path_segment& s, const medium_piece& piece,
                     std::uint32_t from_end, std::uint32_t in_solid)
      : beam{path.origin, path.direction, piece.begin, piece.end},
        throughput(s.throughput),
        segments(from_end),
        weights(path.weights),
        before(s.pdf),
        solid(in_solid),
        begins_inside(piece.begins_inside ? 1 : 0) {}
};

/// Random numbers of light paths begin at this use, and those of distances in media at another. Both are far
/// from those of camera paths' vertices.
inline constexpr std::uint32_t light_path_dimensions = 0x40000000u;
inline constexpr std::uint32_t distance_dimensions = 0x20000000u;

/// A visitor of follow_segment() that looks at nothing on the way.
struct passer {
  random_stream random;
  std::uint32_t path;
  std::uint32_t first_dimension;  ///< of the segment's distances

  WFPG_HD vec2 draw(std::uint32_t piece) const { return random(path, first_dimension + piece); }
  WFPG_HD void cross(const path_segment&, const medium_piece&) const {}
  WFPG_HD void meet(const path_segment&, const hit_surface&) const {}
  WFPG_HD void leave(const path_segment&) const {}
};

/// The scene and its lights for bidirectional kernels, with an inline caster. Observer: as no_observer.
template <class Caster, class Observer = no_observer>
struct bidirectional_world {
  scene_view scene;
  light_view lights;
  Caster caster;
  wfpg::path_techniques techniques = {};
  random_stream random = {};
  std::uint32_t max_depth = 1;       ///< most segments of a whole path
  std::uint32_t roulette_depth = 3;  ///< roulette begins at this vertex, from 0
  Observer observer = {};            ///< of camera paths

  /// The weights of a path that has come as far as `s`, on a surface with that cosine or in a medium.
  WFPG_HD static wfpg::vertex_weights weights_at(const subpath& path, const path_segment& s, float cosine) {
    wfpg::path_arrival arrival;
    arrival.distance = glm::max(s.distance, 1e-12f);
    arrival.cosine = cosine;
    arrival.pdf_distance = s.pdf.there;
    arrival.pdf_distance_back = s.pdf.back;
    return path.weights.arrive(arrival);
  }
  /// Of a path and a surface that it meets.
  WFPG_HD static float arrival_cosine(const subpath& path, const hit_surface& met) {
    return glm::max(std::abs(glm::dot(met.surface.geometric_normal, path.direction)), 1e-6f);
  }

  /// What a path with this number meets on its segment: `passer` for those who look at nothing.
  /// `first_dimension`: of its kind of paths.
  WFPG_HD passer passer_of(std::uint32_t path, std::uint32_t segments, std::uint32_t first_dimension) const {
    return {random, path, first_dimension + distance_dimensions + segments * (most_passed + 1)};
  }

  /// Moves a path along its ray. Writes the vertex where it arrives. False where there is none. A Visitor is
  /// one of follow_segment().
  template <class Visitor>
  WFPG_HD bool arrive(const subpath& path, std::uint32_t segments, subpath_vertex& vertex,
                      Visitor& visitor) const {
    path_segment s;
    s.throughput = path.throughput;
    s.solids = path.solids;
    hit_surface found;
    const bool from_medium = path.from_medium != 0;
    const segment_end end = follow_segment(scene, caster, path.ray(), from_medium, s, found, visitor);
    if (end == segment_end::surface)
      vertex = subpath_vertex(found, s, segments, weights_at(path, s, arrival_cosine(path, found)));
    else if (end == segment_end::medium)
      vertex = subpath_vertex(path.origin + s.distance * path.direction, -path.direction,
                              s.solids.medium_of(scene), s.solids.top(scene), s, segments,
                              weights_at(path, s, 1.0f));
    return end != segment_end::nothing;
  }

  /// The way from a vertex to a point that is `end` off its own surface. `ends_inside`: whether paths scatter
  /// in a medium there.
  WFPG_HD clear_way way_between(const subpath_vertex& from, vec3 end, bool ends_inside) const {
    return way_along(from, from.ray_to(end), ends_inside);
  }
  /// The way along a ray that leaves a vertex. Its t_max may be 0. Ways on which less is left than floats can
  /// weight are hidden.
  WFPG_HD clear_way way_along(const subpath_vertex& from, const wfpg::ray& ray, bool ends_inside) const {
    clear_way clear;
    clear.transmittance = vec3(1.0f);
    if (ray.t_max > 0.0f)
      clear = render::way_along(scene, caster, ray, from.solids_along(scene, ray.direction), from.in_medium(),
                                ends_inside);
    constexpr float least = 1.4e-11f;  // exp(-25)
    const vec3 left = clear.transmittance;
    if (!(glm::max(left.x, glm::max(left.y, left.z)) > least)) clear.transmittance = vec3(0.0f);
    return clear;
  }

  WFPG_HD vec2 draw(std::uint32_t path, std::uint32_t segments, std::uint32_t use) const {
    return random(path, segments * dimension::per_vertex + use);
  }

  /// Continues a path from its vertex in a direction that is sampled there, with roulette, which weights
  /// leave out. `carries_flux`: it is a light path. `dimensions`: the first of its kind of paths. False where
  /// it ends.
  WFPG_HD bool extend(const subpath_vertex& vertex, std::uint32_t id, bool carries_flux,
                      std::uint32_t dimensions, subpath& path) const {
    const float begun = path.begun_luminance;
    if (!scatter(vertex, draw(id, vertex.segments, dimensions + dimension::direction), carries_flux, path))
      return false;
    path.begun_luminance = begun;
    return vertex.segments <= roulette_depth ||
           survives_by_throughput(path.throughput, begun,
                                  draw(id, vertex.segments, dimensions + dimension::roulette).x);
  }

  /// Continues a path from its vertex in the direction that `u` samples. False where there is none.
  WFPG_HD bool scatter(const subpath_vertex& vertex, vec2 u, bool carries_flux, subpath& path) const {
    const vec3 outgoing = vertex.at.outgoing;
    const scatterer f = vertex.seen_from(outgoing);
    const wfpg::bsdf_sample drawn = f.sample(outgoing, u);
    if (!(drawn.pdf > 0.0f)) return false;
    const vec3 direction = drawn.direction;
    vec3 weight;
    wfpg::path_departure to;
    if (drawn.is_delta || f.is_delta()) {
      weight = f.surface.delta_weight_rgb(outgoing, direction, drawn.pdf);
      // Refraction changes radiance, but not flux.
      if (carries_flux) {
        const float eta = f.surface.ior_beyond(outgoing, direction);
        const vec3 normal = f.surface.normal;
        const float shading = std::abs(glm::dot(outgoing, normal) / glm::dot(direction, normal));
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
    path = subpath(ray_along(vertex.leave_along(direction), direction), vertex.throughput * weight,
                   vertex.weights.depart(techniques, to), vertex.solids_along(scene, direction));
    path.from_medium = f.in_medium ? 1 : 0;
    return true;
  }
};

}  // namespace render
