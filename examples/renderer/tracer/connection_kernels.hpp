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
  wfpg::array_view<const solid_stack> around_camera;
  tiled_view<subpath> paths;

  WFPG_HD void operator()(std::size_t i) const {
    const auto pixel = static_cast<std::uint32_t>(i);
    const wfpg::ray ray = camera.through(pixel, world.random(pixel, dimension::pixel));
    paths.emplace(i, ray, vec3(1.0f), wfpg::subpath_weights::from_camera(camera.pdf(ray.direction)),
                  around_camera[0]);
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
    if (!path.is_active()) return;
    ++segment_counts[i];
    subpath_vertex vertex;
    visitor ahead{world.passer_of(static_cast<std::uint32_t>(i), segments, 0), *this, i, path};
    if (!world.arrive(path, segments, vertex, ahead) || segments == world.max_depth) return paths.emplace(i);
    vertices.emplace(i, vertex);
  }

 private:
  /// Adds what is emitted on a segment.
  struct visitor : passer {
    const trace_camera_paths& kernel;
    std::size_t i;
    const subpath& path;

    WFPG_HD visitor(const passer& way, const trace_camera_paths& told, std::size_t number, const subpath& of)
        : passer(way), kernel(told), i(number), path(of) {}

    WFPG_HD void meet(const path_segment& s, const hit_surface& found) const {
      if (found.emission == vec3(0.0f)) return;
      const float cosine = World::arrival_cosine(path, found);
      kernel.gather(i, s.throughput * found.emission, World::weights_at(path, s, cosine),
                    kernel.world.lights.end_on_emitter(found.emitted_luminance, cosine));
    }
    WFPG_HD void leave(const path_segment& s) const {
      path_segment far = s;
      far.distance = 1.0f;
      const environment_view& environment = kernel.world.scene.environment;
      kernel.gather(i, s.throughput * environment.radiance(path.direction),
                    World::weights_at(path, far, 1.0f),
                    kernel.world.lights.end_in_environment(environment, path.direction));
    }
  };

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

/// Copies the positions of stored vertices on surfaces, for a photon map. The map skips the others.
struct copy_positions {
  wfpg::light_vertices_view<subpath_vertex> stored;
  wfpg::array_view<vec3> positions;

  WFPG_HD void operator()(std::size_t i) const {
    const subpath_vertex& vertex = stored[static_cast<std::uint32_t>(i)];
    positions[i] = vertex.in_medium() ? vec3(2.0f * wfpg::largest_coordinate) : vertex.at.position;
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
    if (!paths[i].is_active()) return;
    const auto id = static_cast<std::uint32_t>(i);
    const subpath_vertex vertex = vertices[i];
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    if (!f.is_delta()) {
      vec3 found(0.0f);
      if (world.techniques.next_event > 0.0f) found += sample_light(id, vertex, f);
      if (world.techniques.connections > 0.0f) found += connect_all(i, vertex, f);
      if (world.techniques.surface_points > 0.0f && !f.in_medium) found += merge_all(vertex, f);
      radiance[i] += vertex.throughput * found;
    }
    subpath next = paths[i];
    if (world.extend(vertex, id, false, 0, next))
      paths.emplace(i, next);
    else
      paths.emplace(i);
  }

 private:
  WFPG_HD vec3 sample_light(std::uint32_t id, const subpath_vertex& vertex, const scatterer& f) const {
    const light_sample light =
        world.lights.sample(world.scene, vertex.at.position, wfpg::light_choice{},
                            [&](std::uint32_t use) { return world.draw(id, vertex.segments, use); });
    if (!(light.pdf > 0.0f)) return vec3(0.0f);
    const vec3 value = f.eval_rgb(vertex.at.outgoing, light.direction) * light.radiance / light.pdf;
    if (!(wfpg::luminance(value) > 0.0f)) return vec3(0.0f);
    const vec3 to_light = light.is_distant ? light.direction : light.end - vertex.at.position;
    const clear_way way = world.way_along(vertex, ray_toward(vertex.leave_along(to_light), light), false);
    if (way.transmittance == vec3(0.0f)) return vec3(0.0f);
    // A light path comes the other way.
    wfpg::path_edge edge{1.0f, way.pdf.back, way.pdf.there};
    if (!light.is_distant) edge.distance = glm::length(to_light);
    return value * way.transmittance *
           vertex.weights.next_event(world.techniques, vertex.leave(f, light.direction), light.source, edge);
  }

  WFPG_HD vec3 connect_all(std::size_t i, const subpath_vertex& vertex, const scatterer& f) const {
    vec3 found(0.0f);
    for (std::uint32_t k = stored.last(i); k != stored.none; k = stored.previous(k)) {
      const subpath_vertex& light = stored[k];
      if (light.segments + vertex.segments < world.max_depth) found += connect(vertex, f, light);
    }
    return found;
  }

  WFPG_HD vec3 merge_all(const subpath_vertex& vertex, const scatterer& f) const {
    vec3 found(0.0f);
    photons.for_each_point(vertex.at.position, [&](std::uint32_t k) {
      const subpath_vertex& light = stored[k];
      if (light.segments + vertex.segments <= world.max_depth) found += merge(vertex, f, light);
    });
    // Over the number of light paths and the disc of merges.
    return found / world.techniques.surface_points;
  }

  WFPG_HD vec3 merge(const subpath_vertex& camera, const scatterer& f, const subpath_vertex& light) const {
    const vec3 outgoing = camera.at.outgoing, incident = light.at.outgoing;
    // The photon's flux is that of a surface with the geometric normal.
    const vec3 value = f.eval_rgb(outgoing, incident) * light.throughput / camera.cosine(incident);
    if (!(wfpg::luminance(value) > 0.0f)) return vec3(0.0f);
    return value * light.weights.merge(world.techniques, wfpg::merge_technique::surface_points,
                                       camera.weights, camera.leave(f, incident));
  }

  WFPG_HD vec3 connect(const subpath_vertex& camera, const scatterer& f, const subpath_vertex& light) const {
    const vec3 way = light.at.position - camera.at.position;
    const float distance = glm::length(way);
    if (!(distance > 0.0f)) return vec3(0.0f);
    const vec3 toward = way / distance;
    const vec3 value = f.eval_rgb(camera.at.outgoing, toward) * light.scattered_flux(-toward) *
                       light.throughput / (distance * distance);
    if (!(wfpg::luminance(value) > 0.0f)) return vec3(0.0f);
    const clear_way clear = world.way_between(camera, light.leave_along(-way), light.in_medium());
    if (clear.transmittance == vec3(0.0f)) return vec3(0.0f);
    const wfpg::path_edge edge{distance, clear.pdf.back, clear.pdf.there};
    const wfpg::path_departure to_camera = light.leave(light.seen_from(light.at.outgoing), -toward);
    return value * clear.transmittance *
           light.weights.connection(world.techniques, to_camera, camera.weights, camera.leave(f, toward),
                                    edge);
  }
};

}  // namespace render
