// The kernels of a wave through media: functors of an index on the data of volume_state.hpp. They call an
// inline caster, since a ray may pass boundaries on its way.
#pragma once

#include "tracer/volume_state.hpp"

#include <wfpg/host/phase.hpp>

namespace render {

/// Starts paths through pixels. Those of samples from `end` on do not begin.
template <class Camera>
struct start_volume_paths {
  Camera camera;
  random_stream random;
  wfpg::array_view<const solid_stack> around_camera;
  tiled_view<volume_path> paths;
  wfpg::array_view<vec3> radiance;
  std::uint32_t end;

  WFPG_HD void operator()(std::size_t i) const {
    const auto path = static_cast<std::uint32_t>(i);
    paths.emplace(i, camera.through(random.pixel_of(path), random(path, dimension::pixel)), around_camera[0]);
    if (random.sample_of(path) >= end) paths.update(i, [](volume_path& ended) { ended.active = 0; });
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
  /// What a path meets on a segment.
  struct visitor {
    const find_volume_vertices& kernel;
    std::uint32_t id;
    const volume_path& path;

    WFPG_HD vec2 draw(std::uint32_t piece) const {
      return kernel.at.draw(id, volume_position::distance + piece);
    }
    WFPG_HD void cross(const path_segment&, const medium_piece&) const {}
    WFPG_HD void meet(const path_segment& s, const hit_surface& found) const {
      kernel.emit(id, path, s, found);
    }
    WFPG_HD void leave(const path_segment& s) const { kernel.leave(id, path, s); }
  };

  // Returns the vertex's key, or excluded where the path ends.
  WFPG_HD std::uint32_t follow(std::uint32_t id, volume_path& path) const {
    path_segment s;
    s.throughput = path.throughput;
    s.solids = path.solids;
    hit_surface found;
    visitor told{*this, id, path};
    const segment_end end = follow_segment(world.scene, caster, path.ray(), false, s, found, told);
    path.throughput = s.throughput;
    path.solids = s.solids;
    path.material = s.material;
    if (end == segment_end::nothing) return excluded;
    if (end == segment_end::medium) {
      path.origin += s.distance * path.direction;
      return medium_key;
    }
    vertices.emplace(id, found);
    return static_cast<std::uint32_t>(found.surface.bsdf.kind);
  }

  WFPG_HD void leave(std::uint32_t id, const volume_path& path, const path_segment& s) const {
    const vec3 sky = world.scene.environment.radiance(path.direction);
    float weight = 1.0f;
    if (is_rivalled(path)) {
      const float pdf = world.lights.environment_pdf(world.scene.environment, path.direction);
      if (pdf > 0.0f) weight = wfpg::power_heuristic(path.pdf, pdf);
    }
    gather(id, s, sky, weight);
  }

  // Adds what a surface emits, with the MIS weight against next-event estimation at the previous vertex.
  WFPG_HD void emit(std::uint32_t id, const volume_path& path, const path_segment& s,
                    const hit_surface& found) const {
    if (found.emission == vec3(0.0f)) return;
    float weight = 1.0f;
    if (is_rivalled(path)) {
      const float cosine = std::abs(glm::dot(found.surface.geometric_normal, path.direction));
      const float pdf = world.lights.pdf(found.emitted_luminance);
      weight = wfpg::power_heuristic(path.pdf, solid_angle_pdf(pdf, s.distance, cosine));
    }
    gather(id, s, found.emission, weight);
  }

  WFPG_HD bool is_rivalled(const volume_path& path) const { return world.next_event && path.pdf > 0.0f; }

  WFPG_HD void gather(std::uint32_t id, const path_segment& s, vec3 emitted, float weight) const {
    if (emitted == vec3(0.0f)) return;
    ++light_hits[id];
    radiance[id] += s.throughput * emitted * weight;
  }
};

/// The solids around a ray that leaves a surface.
WFPG_HD inline solid_stack beyond(const scene_view& scene, const volume_path& path, const path_vertex& vertex,
                                  vec3 direction) {
  return solids_beyond(scene, path.solids, path.material, vertex.geometric_normal, vertex.outgoing,
                       direction);
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
    return world.lights.sample(world.scene, from, [&](std::uint32_t use) { return at.draw(id, use); });
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
           clear(from, light, beyond(world.scene, path, vertex, light.direction));
  }

  // A light's radiance over its density, with the MIS weight against a direction drawn with `density`.
  WFPG_HD static vec3 weighted(const light_sample& light, float density) {
    const float weight = light.is_delta ? 1.0f : wfpg::power_heuristic(light.pdf, density);
    return light.radiance * (weight / light.pdf);
  }

  WFPG_HD vec3 clear(vec3 from, const light_sample& light, const solid_stack& solids) const {
    const wfpg::ray ray = ray_toward(from, light);
    return ray.t_max > 0.0f ? way_along(world.scene, caster, ray, solids).transmittance : vec3(1.0f);
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
    path.solids = beyond(scene, path, vertex, drawn.direction);
    path.origin = leave_surface(vertex.position, vertex.geometric_normal, drawn.direction, vertex.offset);
    path.direction = drawn.direction;
    return wfpg::luminance(path.throughput) > 0.0f;
  }

  WFPG_HD bool survives(volume_path& path, float u) const {
    return at.depth < roulette_depth || survives_by_throughput(path.throughput, 1.0f, u);
  }
};

}  // namespace render
