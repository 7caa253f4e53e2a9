// Straight ways through media, from one boundary to the next: where a path ends on its way, and what is left
// of light between two points. Boundaries that light passes unbent, and those that other solids cover, end no
// way.
#pragma once

#include "tracer/solid_stack.hpp"

#include <wfpg/host/geometry.hpp>

namespace render {

/// Most boundaries that a ray passes without a vertex: those of equal index, and those that other solids
/// cover. A ray that meets more finds no light.
inline constexpr std::uint32_t most_passed = 64;

/// A ray that goes straight through boundaries, and how far it has come.
struct straight_ray {
  wfpg::ray ray;
  float covered = 0.0f;  ///< distance from its origin, scene units

  WFPG_HD explicit straight_ray(const wfpg::ray& begun) : ray(begun) {}

  /// Distance from the origin to a point on the ray.
  WFPG_HD float distance_to(vec3 position) const { return glm::length(position - ray.origin); }
  /// Length of the piece that ends at a distance.
  WFPG_HD float piece(float distance) const { return glm::max(distance - covered, 0.0f); }
  /// Goes on behind a surface. `offset`: as in surface_point.
  WFPG_HD void pass(float distance, vec3 geometric_normal, float offset) {
    covered = distance;
    const float cosine = std::abs(glm::dot(geometric_normal, ray.direction));
    ray.t_min = distance + offset / glm::max(cosine, 1e-3f);
  }
};

/// The solids around a point: those that a ray from there leaves, and has not entered.
template <class Caster>
WFPG_HD solid_stack solids_around(const scene_view& scene, const Caster& caster, vec3 point) {
  straight_ray upward(ray_along(point, vec3(0.0f, 1.0f, 0.0f)));
  std::uint32_t left[solid_stack::capacity];  // solids that the ray leaves and never entered, from inside
  int count = 0;
  solid_stack entered;
  for (std::uint32_t i = 0; i <= most_passed && count < solid_stack::capacity; ++i) {
    const triangle_hit hit = caster.intersect(upward.ray);
    if (!hit.is_hit()) break;
    const surface_point at = scene.point(hit);
    if (bounds_solid(scene.materials[at.material])) {
      if (glm::dot(at.geometric_normal, upward.ray.direction) < 0.0f)
        entered.enter(scene, at.material);
      else if (!entered.leave(scene, at.material))
        left[count++] = at.material;
    }
    upward.pass(upward.distance_to(at.position), at.geometric_normal, at.offset);
  }
  solid_stack around;
  while (count > 0) around.enter(scene, left[--count]);
  return around;
}

/// Finds the solids around the camera. One thread runs it.
template <class Caster, class Camera>
struct find_camera_solids {
  scene_view scene;
  Caster caster;
  Camera camera;
  wfpg::array_view<solid_stack> found;

  WFPG_HD void operator()(std::size_t) const {
    found[0] = solids_around(scene, caster, camera.through(0, vec2(0.5f)).origin);
  }
};

/// The solids behind a surface that does not end the way, or beyond which a path goes on. `around`: those
/// before it. `material`: of the surface. `normal`: its geometric normal, `outgoing` points back.
WFPG_HD inline solid_stack solids_beyond(const scene_view& scene, const solid_stack& around,
                                         std::uint32_t material, vec3 normal, vec3 outgoing, vec3 direction) {
  const bool enters = glm::dot(normal, outgoing) >= 0.0f;
  const bool stays = enters == (glm::dot(normal, direction) >= 0.0f);
  if (stays || !bounds_solid(scene.materials[material])) return around;
  return solid_boundary(scene, around, material, enters).beyond;
}

/// With which densities paths get from one end of a way to the other. They are by distance where a path
/// scatters in a medium at its end, and probabilities where it gets to a surface. 1 without media.
struct way_densities {
  float there = 1.0f;
  float back = 1.0f;

  /// Adds a piece of the way. `begins_inside`, `ends_inside`: whether paths scatter where it begins and ends.
  /// Nothing is drawn in a medium that does not scatter.
  WFPG_HD void add(const medium& m, float length, bool begins_inside, bool ends_inside) {
    if (m.scattering == vec3(0.0f)) return;
    const wfpg::homogeneous_medium coefficients = coefficients_of(m);
    there *= coefficients.pdf(length, ends_inside);
    back *= coefficients.pdf(length, begins_inside);
  }
};

/// What is left of light on a way, per channel, and the way's densities.
struct clear_way {
  vec3 transmittance{0.0f};
  way_densities pdf;
};

/// The way along a ray to its end, which may be infinitely far. Surfaces hide it, but for boundaries that
/// light passes unbent. `solids`: around the ray's origin. `begins_inside`, `ends_inside`: as in
/// way_densities.
template <class Caster>
WFPG_HD clear_way way_along(const scene_view& scene, const Caster& caster, const wfpg::ray& ray,
                            solid_stack solids, bool begins_inside = false, bool ends_inside = false) {
  clear_way hidden, way;
  way.transmittance = vec3(1.0f);
  const auto add_piece = [&](float length, bool is_first, bool is_last) {
    const medium m = solids.medium_of(scene);
    if (m.extinction() == vec3(0.0f)) return;
    way.transmittance *= coefficients_of(m).transmittance(length);
    way.pdf.add(m, length, is_first && begins_inside, is_last && ends_inside);
  };
  if (!caster.occluded(ray)) {
    add_piece(ray.t_max, true, true);
    return way;
  }
  if (!scene.has_unbent) return hidden;
  straight_ray straight(ray);
  for (std::uint32_t piece = 0; piece <= most_passed; ++piece) {
    const triangle_hit hit = caster.intersect(straight.ray);
    const surface_point at = hit.is_hit() ? scene.point(hit) : surface_point();
    const float distance = hit.is_hit() ? straight.distance_to(at.position) : straight.ray.t_max;
    add_piece(straight.piece(distance), piece == 0, !hit.is_hit());
    if (!hit.is_hit()) return way;
    const material& m = scene.materials[at.material];
    if (!bounds_solid(m)) return hidden;
    const bool enters = glm::dot(at.geometric_normal, straight.ray.direction) <= 0.0f;
    const solid_boundary boundary(scene, solids, at.material, enters);
    if (boundary.exists) {
      if (!boundary.is_matched(m)) return hidden;
      way.transmittance *= m.base_color;
      if (m.base_texture.index >= 0) way.transmittance *= vec3(scene.texel(m.base_texture, at.uv));
    }
    solids = boundary.beyond;
    straight.pass(distance, at.geometric_normal, at.offset);
  }
  return hidden;
}

/// A path's segment, as far as it has come.
struct path_segment {
  vec3 throughput{1.0f};       ///< of the path, with this segment
  solid_stack solids;          ///< around where it is; on a surface, around the side that it came from
  float distance = 0.0f;       ///< from its origin, scene units
  std::uint32_t material = 0;  ///< of the surface that it has met
  way_densities pdf;           ///< of getting there, and back
};

/// A piece of a segment, in one medium. Distances are from the segment's begin, scene units.
struct medium_piece {
  medium around;
  bool begins_inside;  ///< the path scattered where it begins
  float begin;
  float end;    ///< where the path scatters, or `limit`
  float limit;  ///< where the next surface is
};

/// What ends a segment: a surface, scattering in a medium, or nothing at all.
enum class segment_end { surface, medium, nothing };

/// A part of follow_segment(): crosses the medium up to a distance. True: the path scatters in it before.
template <class Visitor>
WFPG_HD bool scatters_before(const scene_view& scene, float limit, bool begins_inside, std::uint32_t piece,
                             const straight_ray& straight, path_segment& s, Visitor& visitor) {
  const medium around = s.solids.medium_of(scene);
  const float length = straight.piece(limit);
  if (around.extinction() == vec3(0.0f) || !(length > 0.0f)) return false;
  const wfpg::homogeneous_medium coefficients = coefficients_of(around);
  if (around.scattering == vec3(0.0f)) {
    s.throughput *= coefficients.transmittance(length);
    return false;
  }
  const vec2 u = visitor.draw(piece);
  const wfpg::distance_sample drawn = coefficients.sample(u.x, u.y, length);
  const float end = straight.covered + drawn.distance;
  visitor.cross(s, {around, begins_inside, straight.covered, drawn.scatters ? end : limit, limit});
  s.throughput *= drawn.weight;
  s.pdf.there *= drawn.pdf;
  s.pdf.back *= begins_inside == drawn.scatters ? drawn.pdf : coefficients.pdf(drawn.distance, begins_inside);
  if (drawn.scatters) s.distance = end;
  return drawn.scatters;
}

/// A part of follow_segment(): meets a surface. False: the path has a vertex there.
template <class Visitor>
WFPG_HD bool passes(const scene_view& scene, path_segment& s, hit_surface& found, Visitor& visitor) {
  const wfpg::surface<bsdf>& surface = found.surface;
  const material& m = scene.materials[s.material];
  if (!bounds_solid(m)) {
    visitor.meet(s, found);
    return false;
  }
  const bool enters = glm::dot(surface.geometric_normal, surface.outgoing) >= 0.0f;
  const solid_boundary boundary(scene, s.solids, s.material, enters);
  if (boundary.exists) visitor.meet(s, found);
  if (boundary.exists && !boundary.is_matched(m)) {
    found.surface.bsdf.ior = boundary.ior_of(m);
    return false;
  }
  if (boundary.exists) s.throughput *= surface.bsdf.colour;
  s.solids = boundary.beyond;
  return true;
}

/// Follows a path along a ray to where it scatters, and draws distances in media. `begins_inside`: whether
/// the path scattered in a medium at the ray's origin. `s`: the segment, with the throughput and the solids
/// at its begin. `found`: the last surface met.
///
/// A Visitor is told what is on the way:
///   vec2 draw(std::uint32_t piece) const;   // random numbers in [0,1)² for a piece
///   void cross(const path_segment& before, const medium_piece&);   // a piece in a medium that scatters
///   void meet(const path_segment&, const hit_surface&);   // a surface that is there
///   void leave(const path_segment&);                      // nothing more is on the way
template <class Caster, class Visitor>
WFPG_HD segment_end follow_segment(const scene_view& scene, const Caster& caster, const wfpg::ray& ray,
                                   bool begins_inside, path_segment& s, hit_surface& found,
                                   Visitor& visitor) {
  straight_ray straight(ray);
  for (std::uint32_t piece = 0; piece <= most_passed; ++piece) {
    const triangle_hit hit = caster.intersect(straight.ray);
    if (hit.is_hit()) found = scene.surface(hit, -ray.direction);
    const float limit = hit.is_hit() ? straight.distance_to(found.surface.position) : straight.ray.t_max;
    if (scatters_before(scene, limit, piece == 0 && begins_inside, piece, straight, s, visitor))
      return segment_end::medium;
    s.distance = limit;
    if (!hit.is_hit()) {
      visitor.leave(s);
      return segment_end::nothing;
    }
    s.material = scene.triangle_materials[hit.triangle];
    if (!passes(scene, s, found, visitor)) return segment_end::surface;
    straight.pass(limit, found.surface.geometric_normal, found.offset);
  }
  return segment_end::nothing;
}

}  // namespace render
