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
  wfpg::array_view<std::uint32_t> active;  ///< receives 1

  WFPG_HD void operator()(std::size_t i) const {
    const auto pixel = static_cast<std::uint32_t>(i);
    const wfpg::ray ray = camera.through(pixel, world.random(pixel, dimension::pixel));
    paths.emplace(i, ray, vec3(1.0f), wfpg::subpath_weights::from_camera(camera.pdf(ray.direction)),
                  around_camera[0]);
    active[i] = 1;
  }
};

/// Finds the next vertex of an active camera path, and adds its emission with its weight. `merges`: whether
/// the path's segments are merged with photons along them.
template <class World, bool merges>
struct trace_camera_paths {
  static constexpr bool waits_for_memory = true;

  World world;
  std::uint32_t segments;  ///< of the paths, with this one
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  wfpg::array_view<std::uint32_t> active;  ///< receives 0 where the path ends
  wfpg::array_view<std::uint32_t> joins;   ///< 1: the vertex can be joined with others; 0 before
  photon_gather photons;
  found_light found;
  wfpg::array_view<std::uint32_t> segment_counts;
  wfpg::array_view<std::uint32_t> light_hits;  ///< segments that ended where light is emitted toward them

  WFPG_HD void operator()(std::size_t i) const {
    const subpath path = paths[i];
    ++segment_counts[i];
    subpath_vertex vertex;
    visitor ahead{world.passer_of(static_cast<std::uint32_t>(i), segments, 0), *this, i, path};
    const bool arrives = world.arrive(path, segments, vertex, ahead);
    world.observer.follow(i, path, segments, arrives ? &vertex : nullptr);
    active[i] = 0;
    if (!arrives || segments == world.max_depth) return;
    active[i] = 1;
    vertices.emplace(i, vertex);
    joins[i] = vertex.is_delta() ? 0 : 1;
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
    const merge_along_piece<World> merge(world, photons, i, path, segments, before, piece);
    world.observer.cross(i, segments, merge.along());
    if (world.techniques.beam_points > 0.0f) found.add(i, technique::pb2d, merge.with_points(), vec3(1.0f));
    if (world.techniques.beams > 0.0f) found.add(i, technique::bb1d, merge.with_beams(), vec3(1.0f));
  }
};

/// Adds what the vertex of a camera path finds by light samples.
template <class World>
struct sample_lights {
  World world;
  tiled_view<subpath_vertex> vertices;
  found_light found;

  WFPG_HD void operator()(std::size_t i) const {
    const subpath_vertex vertex = vertices[i];
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    found.add(i, technique::nee, sample_light(static_cast<std::uint32_t>(i), vertex, f), vertex.throughput);
  }

 private:
  WFPG_HD technique_sum sample_light(std::uint32_t id, const subpath_vertex& vertex,
                                     const scatterer& f) const {
    technique_sum sum;
    const light_sample light = world.lights.sample(world.scene, vertex.at.position, [&](std::uint32_t use) {
      return world.draw(id, vertex.segments, use);
    });
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

/// What a connection finds.
struct connection {
  vec3 value{0.0f};     ///< what light it brings, without its weight
  float weight = 0.0f;  ///< 0: it finds none

  connection() = default;
  WFPG_HD connection(vec3 brings, float weighted) : value(brings), weight(weighted) {}
};

static_assert(sizeof(connection) == 16, "kernels access it in one piece");

/// The two ends of a connection, and the way between them.
struct connection_ends {
  const subpath_vertex& camera;
  const subpath_vertex& light;
  scatterer f;  ///< at the camera path's vertex
  vec3 way;     ///< from there to the light path's vertex
  float distance;

  WFPG_HD connection_ends(const subpath_vertex& of_camera, const subpath_vertex& of_light)
      : camera(of_camera),
        light(of_light),
        f(of_camera.seen_from(of_camera.at.outgoing)),
        way(of_light.at.position - of_camera.at.position),
        distance(glm::length(way)) {}

  /// What the connection brings if nothing is between its ends.
  WFPG_HD vec3 value() const {
    if (!(distance > 0.0f)) return vec3(0.0f);
    const vec3 toward = way / distance;
    return f.eval_rgb(camera.at.outgoing, toward) * light.scattered_flux(-toward) * light.throughput /
           (distance * distance);
  }
  WFPG_HD float weight(const wfpg::path_techniques& techniques, const way_densities& pdf) const {
    const vec3 toward = way / distance;
    const wfpg::path_edge edge{distance, pdf.back, pdf.there};
    const wfpg::path_departure to_camera = light.leave(light.seen_from(light.at.outgoing), -toward);
    return light.weights.connection(techniques, to_camera, camera.weights, camera.leave(f, toward), edge);
  }
};

/// The connections of camera paths' vertices with all vertices of their light paths. An element a stored
/// vertex of light paths: that with the camera path of the same index.
struct path_connections {
  tiled_view<subpath_vertex> vertices;  ///< of camera paths
  wfpg::light_vertices_view<subpath_vertex> stored;
  tiled_view<connection> found;             ///< by stored vertex
  wfpg::array_view<way_densities> between;  ///< of the way between its ends, by stored vertex
};

/// Evaluates connections without what is between their ends. An index is a stored vertex.
struct evaluate_connections {
  static constexpr bool waits_for_memory = true;

  path_connections connections;
  wfpg::array_view<const std::uint32_t> joins;  ///< by path: 1 where the camera path's vertex can be joined
  wfpg::array_view<std::uint32_t> marks;        ///< receives 1 where light may come, else 0

  WFPG_HD void operator()(std::size_t i) const {
    const auto k = static_cast<std::uint32_t>(i);
    const std::uint32_t path = connections.stored.path(k);
    marks[i] = 0;
    if (joins[path] == 0) return;
    const subpath_vertex& camera = connections.vertices[path];
    const subpath_vertex& light = connections.stored[k];
    const vec3 value = connection_ends(camera, light).value();
    if (!(wfpg::luminance(value) > 0.0f)) return connections.found.emplace(i);
    marks[i] = 1;
    connections.found.emplace(i, value, 0.0f);
  }
};

/// Looks what is between the ends of connections. An index is a stored vertex.
template <class World>
struct cast_connections {
  static constexpr bool waits_for_memory = true;

  World world;
  path_connections connections;
  wfpg::array_view<std::uint32_t> marks;  ///< receives 0 where nothing is left of the light

  WFPG_HD void operator()(std::size_t i) const {
    const auto k = static_cast<std::uint32_t>(i);
    const subpath_vertex& camera = connections.vertices[connections.stored.path(k)];
    const subpath_vertex& light = connections.stored[k];
    const vec3 way = light.at.position - camera.at.position;
    const clear_way clear = world.way_between(camera, light.leave_along(-way), light.in_medium());
    if (clear.transmittance == vec3(0.0f)) {
      marks[i] = 0;
      return connections.found.emplace(i);
    }
    connections.between[i] = clear.pdf;
    connections.found.emplace(i, connections.found[i].value * clear.transmittance, 0.0f);
  }
};

/// Weights connections. An index is a stored vertex.
struct weight_connections {
  wfpg::path_techniques techniques;
  path_connections connections;

  WFPG_HD void operator()(std::size_t i) const {
    const auto k = static_cast<std::uint32_t>(i);
    const subpath_vertex& camera = connections.vertices[connections.stored.path(k)];
    const subpath_vertex& light = connections.stored[k];
    const float weight = connection_ends(camera, light).weight(techniques, connections.between[i]);
    connections.found.emplace(i, connections.found[i].value, weight);
  }
};

/// Adds what the connections of a camera path's vertex have found, in the order of its light path.
struct add_connections {
  path_connections connections;
  std::uint32_t size;  ///< stored vertices that are connected: those with a smaller index
  found_light found;

  WFPG_HD void operator()(std::size_t i) const {
    const auto& stored = connections.stored;
    technique_sum sum;
    for (std::uint32_t k = stored.last(i); k != stored.none; k = stored.previous(k)) {
      if (k >= size) continue;
      const connection one = connections.found[k];
      sum.add(one.value, one.weight);
    }
    found.add(i, technique::connect, sum, connections.vertices[i].throughput);
  }
};

/// Adds what the vertex of a camera path finds by merges.
template <class World>
struct merge_vertices {
  static constexpr bool waits_for_memory = true;

  World world;
  tiled_view<subpath_vertex> vertices;
  photon_gather photons;
  found_light found;

  WFPG_HD void operator()(std::size_t i) const {
    const subpath_vertex vertex = vertices[i];
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    const merge_at_vertex<World> merge{world, photons, i, vertex, f};
    if (f.in_medium)
      found.add(i, technique::pp3d, merge.in_medium(), vertex.throughput);
    else
      found.add(i, technique::surf, merge.on_surface(), vertex.throughput);
  }
};

/// Continues an active camera path from its vertex.
template <class World>
struct extend_camera_paths {
  World world;
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  wfpg::array_view<std::uint32_t> active;  ///< 1 where there is a vertex; receives 0 where the path ends

  WFPG_HD void operator()(std::size_t i) const {
    if (active[i] == 0) return;
    subpath next = paths[i];
    if (world.extend(vertices[i], static_cast<std::uint32_t>(i), false, 0, next))
      paths.emplace(i, next);
    else
      active[i] = 0;
  }
};

}  // namespace render
