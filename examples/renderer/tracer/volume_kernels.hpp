// The kernels of a wave through media: functors of an index on the data of volume_state.hpp. They call an
// inline caster, since a ray may pass boundaries on its way.
#pragma once

#include "tracer/volume_state.hpp"

#include <wfpg/host/phase.hpp>

namespace render {

/// Finds the solids around the camera, by a ray that leaves all of them. One thread runs it.
template <class Caster, class Camera>
struct find_camera_solids {
  scene_view scene;
  Caster caster;
  Camera camera;
  wfpg::array_view<solid_stack> found;

  WFPG_HD void operator()(std::size_t) const {
    straight_ray upward(camera.through(0, vec2(0.5f)));
    upward.ray.direction = vec3(0.0f, 1.0f, 0.0f);
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
    found[0] = around;
  }
};

/// Starts a path through each pixel.
template <class Camera>
struct start_volume_paths {
  Camera camera;
  random_stream random;
  wfpg::array_view<const solid_stack> around_camera;
  tiled_view<volume_path> paths;
  wfpg::array_view<vec3> radiance;

  WFPG_HD void operator()(std::size_t i) const {
    const auto pixel = static_cast<std::uint32_t>(i);
    paths.emplace(i, camera.through(pixel, random(pixel, dimension::pixel)), around_camera[0]);
    radiance[i] = vec3(0.0f);
  }
};

/// Finds the next vertex of each path that may continue, on a surface or in a medium. Adds what is emitted on
/// the way.
template <class Caster>
struct find_volume_vertices {
  volume_position at;
  path_lights world;
  Caster caster;
  path_queue queue;  ///< of the previous vertex
  tiled_view<volume_path> paths;
  tiled_view<path_vertex> vertices;
  wfpg::array_view<std::uint32_t> keys;  ///< of the vertices, or excluded
  wfpg::array_view<vec3> radiance;
  wfpg::array_view<std::uint32_t> segments;
  wfpg::array_view<std::uint32_t> light_hits;  ///< segments that ended where light is emitted toward them
  std::uint32_t excluded;

  WFPG_HD void operator()(std::size_t slot) const {
    if (!queue.holds(slot)) return;
    const std::uint32_t id = queue[slot];
    keys[id] = excluded;
    volume_path path = paths[id];
    if (!path.active) return;
    ++segments[id];
    const std::uint32_t key = follow(id, path);
    path.active = key != excluded && !at.is_last() && wfpg::luminance(path.throughput) > 0.0f ? 1 : 0;
    if (path.active) keys[id] = key;
    paths.emplace(id, path);
  }

 private:
  // Returns the vertex's key, or excluded where the path ends.
  WFPG_HD std::uint32_t follow(std::uint32_t id, volume_path& path) const {
    straight_ray straight(path.ray());
    for (std::uint32_t piece = 0; piece <= most_passed; ++piece) {
      const triangle_hit hit = caster.intersect(straight.ray);
      if (!hit.is_hit()) {
        if (scatters_before(id, piece, straight.ray.t_max, straight, path)) return medium_key;
        leave(id, path);
        return excluded;
      }
      hit_surface found = world.scene.surface(hit, -path.direction);
      const float distance = straight.distance_to(found.surface.position);
      if (scatters_before(id, piece, distance, straight, path)) return medium_key;
      if (!passes(id, hit, distance, found, path)) {
        vertices.emplace(id, found);
        return static_cast<std::uint32_t>(found.surface.bsdf.kind);
      }
      straight.pass(distance, found.surface.geometric_normal, found.offset);
    }
    return excluded;
  }

  // Crosses the medium up to a distance. True: the path scatters in it before.
  WFPG_HD bool scatters_before(std::uint32_t id, std::uint32_t piece, float distance,
                               const straight_ray& straight, volume_path& path) const {
    const medium around = path.solids.medium_of(world.scene);
    const float length = straight.piece(distance);
    if (around.extinction() == vec3(0.0f) || !(length > 0.0f)) return false;
    const wfpg::homogeneous_medium coefficients = coefficients_of(around);
    if (around.scattering == vec3(0.0f)) {
      path.throughput *= coefficients.transmittance(length);
      return false;
    }
    const vec2 u = at.draw(id, volume_position::distance + piece);
    const wfpg::distance_sample drawn = coefficients.sample(u.x, u.y, length);
    path.throughput *= drawn.weight;
    if (drawn.scatters) path.origin += (straight.covered + drawn.distance) * path.direction;
    return drawn.scatters;
  }

  WFPG_HD void leave(std::uint32_t id, const volume_path& path) const {
    const vec3 sky = world.scene.environment.radiance(path.direction);
    float weight = 1.0f;
    if (is_rivalled(path)) {
      const float pdf = world.lights.environment_pdf(world.scene.environment, path.direction);
      if (pdf > 0.0f) weight = wfpg::power_heuristic(path.pdf, pdf);
    }
    gather(id, path, sky, weight);
  }

  // Meets a surface. False: the path has a vertex there.
  WFPG_HD bool passes(std::uint32_t id, const triangle_hit& hit, float distance, hit_surface& found,
                      volume_path& path) const {
    const wfpg::surface<bsdf>& surface = found.surface;
    const std::uint32_t number = world.scene.triangle_materials[hit.triangle];
    const material& m = world.scene.materials[number];
    path.material = number;
    if (!bounds_solid(m)) {
      emit(id, distance, found, path);
      return false;
    }
    const bool enters = glm::dot(surface.geometric_normal, surface.outgoing) >= 0.0f;
    const solid_boundary boundary(world.scene, path.solids, number, enters);
    if (boundary.exists) emit(id, distance, found, path);
    if (boundary.exists && !boundary.is_matched(m)) {
      found.surface.bsdf.ior = boundary.ior_of(m);
      return false;
    }
    if (boundary.exists) path.throughput *= surface.bsdf.colour;
    path.solids = boundary.beyond;
    return true;
  }

  // Adds what a surface emits, with the MIS weight against next-event estimation at the previous vertex.
  WFPG_HD void emit(std::uint32_t id, float distance, const hit_surface& found,
                    const volume_path& path) const {
    if (found.emission == vec3(0.0f)) return;
    float weight = 1.0f;
    if (is_rivalled(path)) {
      const float cosine = std::abs(glm::dot(found.surface.geometric_normal, path.direction));
      const float pdf = world.lights.pdf(found.emitted_luminance);
      weight = wfpg::power_heuristic(path.pdf, solid_angle_pdf(pdf, distance, cosine));
    }
    gather(id, path, found.emission, weight);
  }

  WFPG_HD bool is_rivalled(const volume_path& path) const { return world.next_event && path.pdf > 0.0f; }

  WFPG_HD void gather(std::uint32_t id, const volume_path& path, vec3 emitted, float weight) const {
    if (emitted == vec3(0.0f)) return;
    ++light_hits[id];
    radiance[id] += path.throughput * emitted * weight;
  }
};

/// The part of light that comes along a ray, per channel. Surfaces hide it, but for boundaries that light
/// passes unbent.
template <class Caster>
struct clear_part {
  const scene_view& scene;
  const Caster& caster;

  WFPG_HD vec3 operator()(const wfpg::ray& ray, solid_stack solids) const {
    if (!caster.occluded(ray)) return coefficients_of(solids.medium_of(scene)).transmittance(ray.t_max);
    return scene.has_solids ? through_boundaries(straight_ray(ray), solids) : vec3(0.0f);
  }

 private:
  WFPG_HD vec3 through_boundaries(straight_ray straight, solid_stack& solids) const {
    vec3 left(1.0f);
    for (std::uint32_t piece = 0; piece <= most_passed; ++piece) {
      const triangle_hit hit = caster.intersect(straight.ray);
      const surface_point at = hit.is_hit() ? scene.point(hit) : surface_point();
      const float distance = hit.is_hit() ? straight.distance_to(at.position) : straight.ray.t_max;
      left *= coefficients_of(solids.medium_of(scene)).transmittance(straight.piece(distance));
      if (!hit.is_hit()) return left;
      const material& m = scene.materials[at.material];
      if (!bounds_solid(m)) return vec3(0.0f);
      const bool enters = glm::dot(at.geometric_normal, straight.ray.direction) <= 0.0f;
      const solid_boundary boundary(scene, solids, at.material, enters);
      if (boundary.exists) {
        if (!boundary.is_matched(m)) return vec3(0.0f);
        left *= m.base_color;
        if (m.base_texture.index >= 0) left *= vec3(scene.texel(m.base_texture, at.uv));
      }
      solids = boundary.beyond;
      straight.pass(distance, at.geometric_normal, at.offset);
    }
    return vec3(0.0f);
  }
};

/// The solids around a ray that leaves a surface.
WFPG_HD inline solid_stack solids_beyond(const scene_view& scene, const volume_path& path,
                                         const path_vertex& vertex, vec3 direction) {
  const bool enters = glm::dot(vertex.geometric_normal, vertex.outgoing) >= 0.0f;
  const bool stays = enters == (glm::dot(vertex.geometric_normal, direction) >= 0.0f);
  if (stays || !bounds_solid(scene.materials[path.material])) return path.solids;
  return solid_boundary(scene, path.solids, path.material, enters).beyond;
}

/// Next-event estimation: adds the light of a point on a light, with its MIS weight.
template <class Caster>
struct add_volume_light {
  volume_position at;
  path_lights world;
  Caster caster;
  path_queue queue;
  tiled_view<volume_path> paths;
  tiled_view<path_vertex> vertices;
  wfpg::array_view<const std::uint32_t> keys;
  wfpg::array_view<vec3> radiance;

  WFPG_HD void operator()(std::size_t slot) const {
    if (!queue.holds(slot)) return;
    const std::uint32_t id = queue[slot];
    const volume_path path = paths[id];
    radiance[id] += path.throughput * (keys[id] == medium_key ? in_medium(id, path) : on_surface(id, path));
  }

 private:
  WFPG_HD light_sample sample(std::uint32_t id, vec3 from) const {
    return world.lights.sample(world.scene, from, {}, [&](std::uint32_t use) { return at.draw(id, use); });
  }

  WFPG_HD vec3 in_medium(std::uint32_t id, const volume_path& path) const {
    const light_sample light = sample(id, path.origin);
    if (!(light.pdf > 0.0f)) return vec3(0.0f);
    const wfpg::henyey_greenstein phase{path.solids.medium_of(world.scene).g};
    const float density = phase.pdf(-path.direction, light.direction);
    return density * weighted(light, density) * clear(path.origin, light, path.solids);
  }

  WFPG_HD vec3 on_surface(std::uint32_t id, const volume_path& path) const {
    const path_vertex& vertex = vertices[id];
    const bsdf scatters = vertex.bsdf();
    if (scatters.is_delta()) return vec3(0.0f);
    const light_sample light = sample(id, vertex.position);
    if (!(light.pdf > 0.0f)) return vec3(0.0f);
    const vec3 value = scatters.eval_rgb(vertex.outgoing, light.direction);
    if (!(wfpg::luminance(value) > 0.0f)) return vec3(0.0f);
    const vec3 from = leave_surface(vertex.position, vertex.geometric_normal, light.direction, vertex.offset);
    return value * weighted(light, scatters.pdf(vertex.outgoing, light.direction)) *
           clear(from, light, solids_beyond(world.scene, path, vertex, light.direction));
  }

  // A light's radiance over its density, with the MIS weight against a direction drawn with `density`.
  WFPG_HD static vec3 weighted(const light_sample& light, float density) {
    const float weight = light.is_delta ? 1.0f : wfpg::power_heuristic(light.pdf, density);
    return light.radiance * (weight / light.pdf);
  }

  WFPG_HD vec3 clear(vec3 from, const light_sample& light, const solid_stack& solids) const {
    const wfpg::ray ray = ray_toward(from, light);
    return ray.t_max > 0.0f ? clear_part<Caster>{world.scene, caster}(ray, solids) : vec3(1.0f);
  }
};

/// Continues each path from its vertex, by its phase function or BSDF.
struct scatter_volume_paths {
  volume_position at;
  scene_view scene;
  path_queue queue;
  tiled_view<volume_path> paths;
  tiled_view<path_vertex> vertices;
  wfpg::array_view<const std::uint32_t> keys;
  std::uint32_t roulette_depth;  ///< roulette begins at this vertex

  WFPG_HD void operator()(std::size_t slot) const {
    if (!queue.holds(slot)) return;
    const std::uint32_t id = queue[slot];
    volume_path path = paths[id];
    const vec2 u = at.draw(id, dimension::direction);
    const bool goes_on = keys[id] == medium_key ? in_medium(u, path) : on_surface(vertices[id], u, path);
    path.active = goes_on && survives(path, at.draw(id, dimension::roulette).x) ? 1 : 0;
    paths.emplace(id, path);
  }

 private:
  // Roulette spares paths with more than a tenth of the light, as that of path_kernels.hpp.
  static constexpr float spared_throughput = 0.1f;

  WFPG_HD bool in_medium(vec2 u, volume_path& path) const {
    const wfpg::henyey_greenstein phase{path.solids.medium_of(scene).g};
    const wfpg::bsdf_sample drawn = phase.sample(-path.direction, u);
    path.direction = drawn.direction;
    path.pdf = drawn.pdf;
    return true;
  }

  // False if the path ends.
  WFPG_HD bool on_surface(const path_vertex& vertex, vec2 u, volume_path& path) const {
    const bsdf scatters = vertex.bsdf();
    const wfpg::bsdf_sample drawn = scatters.sample(vertex.outgoing, u);
    if (!(drawn.pdf > 0.0f)) return false;
    const bool delta = drawn.is_delta || scatters.is_delta();
    path.throughput *= delta ? scatters.delta_weight_rgb(vertex.outgoing, drawn.direction, drawn.pdf)
                             : scatters.eval_rgb(vertex.outgoing, drawn.direction) / drawn.pdf;
    path.pdf = delta ? 0.0f : drawn.pdf;
    path.solids = solids_beyond(scene, path, vertex, drawn.direction);
    path.origin = leave_surface(vertex.position, vertex.geometric_normal, drawn.direction, vertex.offset);
    path.direction = drawn.direction;
    return wfpg::luminance(path.throughput) > 0.0f;
  }

  WFPG_HD bool survives(volume_path& path, float u) const {
    if (at.depth < roulette_depth) return true;
    const float probability = glm::min(1.0f, wfpg::luminance(path.throughput) / spared_throughput);
    if (!(u < probability)) return false;
    path.throughput /= probability;
    return true;
  }
};

}  // namespace render
