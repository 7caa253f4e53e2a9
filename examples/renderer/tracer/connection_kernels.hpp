// The kernels of camera paths in bidirectional methods: functors of an index on the data of
// bidirectional_state.hpp. A camera path is connected with the light path of its own index.
#pragma once

#include "tracer/merge_kernels.hpp"

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

/// Finds the next vertex of each camera path, and adds its emission with its weight. `merges`: whether the
/// path's segments are merged with photons along them.
template <class World, bool merges>
struct trace_camera_paths {
  World world;
  std::uint32_t segments;  ///< of the paths, with this one
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  photon_gather photons;
  found_light found;
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

    WFPG_HD void cross(const path_segment& before, const medium_piece& piece) const {
      if constexpr (merges) kernel.merge(i, path, before, piece);
    }
    WFPG_HD void meet(const path_segment& s, const hit_surface& met) const {
      if (met.emission == vec3(0.0f)) return;
      const float cosine = World::arrival_cosine(path, met);
      kernel.gather(i, s.throughput * met.emission, World::weights_at(path, s, cosine),
                    kernel.world.lights.end_on_emitter(met.emitted_luminance, cosine));
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

  WFPG_HD void gather(std::size_t i, vec3 emitted, const wfpg::vertex_weights& arrived,
                      const wfpg::light_end& end) const {
    if (emitted == vec3(0.0f)) return;
    ++light_hits[i];
    technique_sum sum;
    // A light that the camera sees has no other technique.
    if (segments == 1)
      sum.add(emitted, 1.0f);
    else if (world.techniques.light_hits > 0.0f)
      sum.add(emitted, arrived.light_hit(world.techniques, end));
    found.add(i, technique::hits, sum, vec3(1.0f));
  }

  WFPG_HD void merge(std::size_t i, const subpath& path, const path_segment& before,
                     const medium_piece& piece) const {
    if (segments == world.max_depth) return;
    const merge_along_piece<World> merge(world, photons, path, segments, before, piece);
    if (world.techniques.beam_points > 0.0f) found.add(i, technique::pb2d, merge.with_points(), vec3(1.0f));
    if (world.techniques.beams > 0.0f) found.add(i, technique::bb1d, merge.with_beams(), vec3(1.0f));
  }
};

/// Adds what the vertices of camera paths find by light samples.
template <class World>
struct sample_lights {
  World world;
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  found_light found;

  WFPG_HD void operator()(std::size_t i) const {
    if (!paths[i].is_active()) return;
    const subpath_vertex vertex = vertices[i];
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    if (!f.is_delta())
      found.add(i, technique::nee, sample_light(static_cast<std::uint32_t>(i), vertex, f), vertex.throughput);
  }

 private:
  WFPG_HD technique_sum sample_light(std::uint32_t id, const subpath_vertex& vertex,
                                     const scatterer& f) const {
    technique_sum sum;
    const light_sample light =
        world.lights.sample(world.scene, vertex.at.position, wfpg::light_choice{},
                            [&](std::uint32_t use) { return world.draw(id, vertex.segments, use); });
    if (!(light.pdf > 0.0f)) return sum;
    const vec3 value = f.eval_rgb(vertex.at.outgoing, light.direction) * light.radiance / light.pdf;
    if (!(wfpg::luminance(value) > 0.0f)) return sum;
    const vec3 to_light = light.is_distant ? light.direction : light.end - vertex.at.position;
    const clear_way way = world.way_along(vertex, ray_toward(vertex.leave_along(to_light), light), false);
    if (way.transmittance == vec3(0.0f)) return sum;
    // A light path comes the other way.
    wfpg::path_edge edge{1.0f, way.pdf.back, way.pdf.there};
    if (!light.is_distant) edge.distance = glm::length(to_light);
    sum.add(
        value * way.transmittance,
        vertex.weights.next_event(world.techniques, vertex.leave(f, light.direction), light.source, edge));
    return sum;
  }
};

/// Adds what the vertices of camera paths find by connections with their light paths.
template <class World>
struct connect_paths {
  World world;
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  wfpg::light_vertices_view<subpath_vertex> stored;
  found_light found;

  WFPG_HD void operator()(std::size_t i) const {
    if (!paths[i].is_active()) return;
    const subpath_vertex vertex = vertices[i];
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    if (!f.is_delta()) found.add(i, technique::connect, connect_all(i, vertex, f), vertex.throughput);
  }

 private:
  WFPG_HD technique_sum connect_all(std::size_t i, const subpath_vertex& vertex, const scatterer& f) const {
    technique_sum sum;
    for (std::uint32_t k = stored.last(i); k != stored.none; k = stored.previous(k)) {
      const subpath_vertex& light = stored[k];
      if (light.segments + vertex.segments < world.max_depth) connect(vertex, f, light, sum);
    }
    return sum;
  }

  WFPG_HD void connect(const subpath_vertex& camera, const scatterer& f, const subpath_vertex& light,
                       technique_sum& sum) const {
    const vec3 way = light.at.position - camera.at.position;
    const float distance = glm::length(way);
    if (!(distance > 0.0f)) return;
    const vec3 toward = way / distance;
    const vec3 value = f.eval_rgb(camera.at.outgoing, toward) * light.scattered_flux(-toward) *
                       light.throughput / (distance * distance);
    if (!(wfpg::luminance(value) > 0.0f)) return;
    const clear_way clear = world.way_between(camera, light.leave_along(-way), light.in_medium());
    if (clear.transmittance == vec3(0.0f)) return;
    const wfpg::path_edge edge{distance, clear.pdf.back, clear.pdf.there};
    const wfpg::path_departure to_camera = light.leave(light.seen_from(light.at.outgoing), -toward);
    sum.add(value * clear.transmittance, light.weights.connection(world.techniques, to_camera, camera.weights,
                                                                  camera.leave(f, toward), edge));
  }
};

/// Adds what the vertices of camera paths find by merges.
template <class World>
struct merge_vertices {
  World world;
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  photon_gather photons;
  found_light found;

  WFPG_HD void operator()(std::size_t i) const {
    if (!paths[i].is_active()) return;
    const subpath_vertex vertex = vertices[i];
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    if (f.is_delta()) return;
    const merge_at_vertex<World> merge{world, photons, vertex, f};
    if (f.in_medium)
      found.add(i, technique::pp3d, merge.in_medium(), vertex.throughput);
    else
      found.add(i, technique::surf, merge.on_surface(), vertex.throughput);
  }
};

/// Continues camera paths from their vertices.
template <class World>
struct extend_camera_paths {
  World world;
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;

  WFPG_HD void operator()(std::size_t i) const {
    subpath next = paths[i];
    if (!next.is_active()) return;
    if (world.extend(vertices[i], static_cast<std::uint32_t>(i), false, 0, next))
      paths.emplace(i, next);
    else
      paths.emplace(i);
  }
};

}  // namespace render
