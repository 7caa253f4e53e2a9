// The kernels of camera paths in bidirectional methods: functors of an index on the data of
// bidirectional_state.hpp. A camera path is connected with the light path of its own index.
#pragma once

#include "tracer/bidirectional_state.hpp"

#include <wfpg/light/photon_map.hpp>

namespace render {

/// Starts a path through each pixel.
template <class World>
struct start_camera_paths {
  World world;
  pinhole camera;
  tiled_view<subpath> paths;

  WFPG_HD void operator()(std::size_t i) const {
    const auto pixel = static_cast<std::uint32_t>(i);
    const wfpg::ray ray = camera.through(pixel, world.random(pixel, dimension::pixel));
    paths.emplace(i, ray.origin, ray.direction, vec3(1.0f),
                  wfpg::subpath_weights::from_camera(camera.pdf(ray.direction)));
  }
};

/// Finds the next vertex of each camera path, and adds its emission with its weight.
template <class World>
struct trace_camera_paths {
  World world;
  std::uint32_t segments;  ///< of the paths, with this one
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  wfpg::array_view<vec3> radiance;
  wfpg::array_view<std::uint32_t> segment_counts;
  wfpg::array_view<std::uint32_t> light_hits;  ///< segments that ended where light is emitted toward them

  WFPG_HD void operator()(std::size_t i) const {
    const subpath path = paths[i];
    if (path.active == 0) return;
    ++segment_counts[i];
    subpath_vertex vertex;
    hit_surface found;
    if (!world.arrive(path, segments, vertex, found)) {
      gather(i, path.throughput * world.scene.environment.radiance(path.direction),
             path.weights.arrive(wfpg::path_arrival{1.0f}),
             world.lights.end_in_environment(world.scene.environment, path.direction));
      return paths.emplace(i);
    }
    gather(i, vertex.throughput * found.emission, vertex.weights,
           world.lights.end_on_emitter(found.emitted_luminance, vertex.cosine(vertex.at.outgoing)));
    if (segments == world.max_depth) return paths.emplace(i);
    vertices.emplace(i, vertex);
  }

 private:
  WFPG_HD void gather(std::size_t i, vec3 found, const wfpg::vertex_weights& arrived,
                      const wfpg::light_end& end) const {
    if (found == vec3(0.0f)) return;
    ++light_hits[i];
    // A light that the camera sees has no other technique.
    if (segments == 1)
      radiance[i] += found;
    else if (world.techniques.light_hits > 0.0f)
      radiance[i] += found * arrived.light_hit(world.techniques, end);
  }
};

/// Copies the positions of stored vertices, for a photon map.
struct copy_positions {
  wfpg::light_vertices_view<subpath_vertex> stored;
  wfpg::array_view<vec3> positions;

  WFPG_HD void operator()(std::size_t i) const {
    positions[i] = stored[static_cast<std::uint32_t>(i)].at.position;
  }
};

/// Adds what the camera paths' vertices find by light samples, by connections and by merges, and continues
/// the paths.
template <class World>
struct connect_camera_paths {
  World world;
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  wfpg::photon_map_view photons;  ///< of all stored vertices
  wfpg::light_vertices_view<subpath_vertex> stored;
  wfpg::array_view<vec3> radiance;

  WFPG_HD void operator()(std::size_t i) const {
    if (paths[i].active == 0) return;
    const auto id = static_cast<std::uint32_t>(i);
    const subpath_vertex vertex = vertices[i];
    const bsdf f = vertex.seen_from(vertex.at.outgoing);
    if (!f.is_delta()) {
      vec3 found(0.0f);
      if (world.techniques.next_event > 0.0f) found += sample_light(id, vertex, f);
      if (world.techniques.connections > 0.0f) found += connect_all(i, vertex, f);
      if (world.techniques.surface_points > 0.0f) found += merge_all(vertex, f);
      radiance[i] += vertex.throughput * found;
    }
    subpath next;
    if (world.scatter(vertex, world.draw(id, vertex.segments, dimension::direction), false, next))
      paths.emplace(i, next);
    else
      paths.emplace(i);
  }

 private:
  WFPG_HD vec3 sample_light(std::uint32_t id, const subpath_vertex& vertex, const bsdf& f) const {
    const light_sample light =
        world.lights.sample(world.scene, vertex.at.position, wfpg::light_choice{},
                            [&](std::uint32_t use) { return world.draw(id, vertex.segments, use); });
    if (!(light.pdf > 0.0f)) return vec3(0.0f);
    const vec3 value = f.eval_rgb(vertex.at.outgoing, light.direction) * light.radiance / light.pdf;
    if (!(wfpg::luminance(value) > 0.0f) || is_hidden(vertex, light)) return vec3(0.0f);
    wfpg::path_edge edge;
    if (!light.is_distant) edge.distance = glm::length(light.end - vertex.at.position);
    return value *
           vertex.weights.next_event(world.techniques, vertex.leave(f, light.direction), light.source, edge);
  }

  WFPG_HD bool is_hidden(const subpath_vertex& vertex, const light_sample& light) const {
    const vec3 way = light.is_distant ? light.direction : light.end - vertex.at.position;
    return !world.is_clear(ray_toward(vertex.leave_along(way), light));
  }

  WFPG_HD vec3 connect_all(std::size_t i, const subpath_vertex& vertex, const bsdf& f) const {
    vec3 found(0.0f);
    for (std::uint32_t k = stored.last(i); k != stored.none; k = stored.previous(k)) {
      const subpath_vertex& light = stored[k];
      if (light.segments + vertex.segments < world.max_depth) found += connect(vertex, f, light);
    }
    return found;
  }

  WFPG_HD vec3 merge_all(const subpath_vertex& vertex, const bsdf& f) const {
    vec3 found(0.0f);
    photons.for_each_point(vertex.at.position, [&](std::uint32_t k) {
      const subpath_vertex& light = stored[k];
      if (light.segments + vertex.segments <= world.max_depth) found += merge(vertex, f, light);
    });
    // Over the number of light paths and the disc of merges.
    return found / world.techniques.surface_points;
  }

  WFPG_HD vec3 merge(const subpath_vertex& camera, const bsdf& f, const subpath_vertex& light) const {
    const vec3 outgoing = camera.at.outgoing, incident = light.at.outgoing;
    // The photon's flux is that of a surface with the geometric normal.
    const vec3 value = f.eval_rgb(outgoing, incident) * light.throughput / camera.cosine(incident);
    if (!(wfpg::luminance(value) > 0.0f)) return vec3(0.0f);
    return value * light.weights.merge(world.techniques, wfpg::merge_technique::surface_points,
                                       camera.weights, camera.leave(f, incident));
  }

  WFPG_HD vec3 connect(const subpath_vertex& camera, const bsdf& f, const subpath_vertex& light) const {
    const vec3 way = light.at.position - camera.at.position;
    const float distance = glm::length(way);
    if (!(distance > 0.0f)) return vec3(0.0f);
    const vec3 toward = way / distance;
    const vec3 value = f.eval_rgb(camera.at.outgoing, toward) * light.scattered_flux(-toward) *
                       light.throughput / (distance * distance);
    if (!(wfpg::luminance(value) > 0.0f)) return vec3(0.0f);
    if (!world.sees(camera, light.leave_along(-way))) return vec3(0.0f);
    wfpg::path_edge edge;
    edge.distance = distance;
    const wfpg::path_departure to_camera = light.leave(light.seen_from(light.at.outgoing), -toward);
    return value * light.weights.connection(world.techniques, to_camera, camera.weights,
                                            camera.leave(f, toward), edge);
  }
};

}  // namespace render
