// The kernels of camera paths in bidirectional methods: functors of an index on the data of
// bidirectional_state.hpp.
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
  bool is_last;            ///< paths end with it
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
    if (!arrives || is_last) return;
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
    if (is_last) return;
    const merge_along_piece<World> merge(world, photons, i, path, segments, before, piece);
    world.observer.cross(i, segments, merge.along());
    if (world.techniques.beam_points > 0.0f) found.add(i, technique::pb2d, merge.with_points(), vec3(1.0f));
    if (world.techniques.beams > 0.0f) found.add(i, technique::bb1d, merge.with_beams(), vec3(1.0f));
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
