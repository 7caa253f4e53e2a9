// The kernels of light paths: functors of an index on the data of bidirectional_state.hpp.
#pragma once

#include "tracer/bidirectional_state.hpp"

#include <wfpg/light/light_recorder.hpp>

namespace render {

/// Finds the solids around each light.
template <class World>
struct find_light_solids {
  World world;
  wfpg::array_view<solid_stack> found;  ///< by the light's column

  WFPG_HD void operator()(std::size_t light) const {
    vec3 place;
    found[light] = world.lights.find_place(world.scene, static_cast<std::uint32_t>(light), place)
                       ? solids_around(world.scene, world.caster, place)
                       : solid_stack();
  }
};

/// Starts a path at a light.
template <class World>
struct start_light_paths {
  World world;
  wfpg::array_view<const solid_stack> around_lights;  ///< empty: there are no solids
  tiled_view<subpath> paths;
  wfpg::array_view<std::uint32_t> active;  ///< receives 1 for a path that begins, else 0

  WFPG_HD void operator()(std::size_t i) const {
    const auto id = static_cast<std::uint32_t>(i);
    active[i] = 0;
    const emitted_ray emitted = world.lights.emit(
        world.scene, [&](std::uint32_t use) { return world.random(id, light_path_dimensions + use); });
    if (!(wfpg::luminance(emitted.throughput) > 0.0f)) return;
    active[i] = 1;
    paths.emplace(i, emitted.ray, emitted.throughput,
                  wfpg::subpath_weights::from_light(world.techniques, emitted.source),
                  around_lights.empty() ? solid_stack() : around_lights[emitted.light]);
  }
};

/// Stores a sample's light paths.
using path_recorder = wfpg::light_recorder_view<subpath_vertex, light_beam>;

/// Finds the next vertex of an active light path, and the beams on its way.
template <class World>
struct trace_light_paths {
  World world;
  std::uint32_t segments;  ///< of the paths, with this one
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  wfpg::array_view<std::uint32_t> active;  ///< receives 0 where the path ends
  wfpg::array_view<std::uint32_t> keeps;   ///< 1: the vertex can be connected; 0 before
  path_recorder recorder;
  wfpg::array_view<std::uint32_t> segment_counts;

  WFPG_HD void operator()(std::size_t i) const {
    const subpath path = paths[i];
    ++segment_counts[i];
    subpath_vertex vertex;
    visitor ahead{world.passer_of(static_cast<std::uint32_t>(i), segments, light_path_dimensions), *this, i,
                  path};
    active[i] = 0;
    if (!world.arrive(path, segments, vertex, ahead)) return;
    active[i] = 1;
    vertices.emplace(i, vertex);
    if (!vertex.is_delta()) keeps[i] = 1;
  }

 private:
  struct visitor : passer {
    const trace_light_paths& kernel;
    std::size_t i;
    const subpath& path;

    WFPG_HD visitor(const passer& way, const trace_light_paths& told, std::size_t number, const subpath& of)
        : passer(way), kernel(told), i(number), path(of) {}

    WFPG_HD void cross(const path_segment& before, const medium_piece& piece) const {
      if (!kernel.recorder.leaves_beams(i) || !(piece.end > piece.begin)) return;
      kernel.recorder.add_beam(
          i, light_beam(path, before, piece, kernel.segments, before.solids.top(kernel.world.scene)));
    }
  };
};

/// Stores the new vertex of an active light path where it has a place, and continues the path.
template <class World>
struct extend_light_paths {
  World world;
  bool is_last;  ///< paths end here
  tiled_view<subpath> paths;
  tiled_view<subpath_vertex> vertices;
  wfpg::array_view<std::uint32_t> active;  ///< 1 where there is a vertex; receives 0 where the path ends
  path_recorder recorder;

  WFPG_HD void operator()(std::size_t i) const {
    if (active[i] == 0) return;
    const subpath_vertex vertex = vertices[i];
    if (recorder.has_place(i)) recorder.write(i, vertex);
    active[i] = 0;
    if (is_last) return;
    subpath next = paths[i];
    if (!world.extend(vertex, static_cast<std::uint32_t>(i), true, light_path_dimensions, next)) return;
    paths.emplace(i, next);
    active[i] = 1;
  }
};

/// The way from a point to the camera.
struct way_to_camera {
  vec3 toward{0.0f};  ///< a unit vector
  float distance = 0.0f;
  std::uint32_t pixel = 0;
  bool in_view = false;  ///< whether the picture has the point; otherwise there is no pixel

  WFPG_HD way_to_camera(const pinhole& camera, vec3 position) {
    const vec3 way = camera.position() - position;
    distance = glm::length(way);
    if (!(distance > 0.0f)) return;
    toward = way / distance;
    in_view = camera.find_pixel(-toward, pixel);
  }
};

/// Marks the stored vertices of light paths that the camera has in view. An index counts from `first`.
struct find_in_view {
  wfpg::light_vertices_view<subpath_vertex> stored;
  std::uint32_t first;
  pinhole camera;
  wfpg::array_view<std::uint32_t> marks;  ///< receives 1 or 0

  WFPG_HD void operator()(std::size_t i) const {
    const vec3 position = stored[first + static_cast<std::uint32_t>(i)].position();
    marks[i] = way_to_camera(camera, position).in_view ? 1u : 0u;
  }
};

/// Connects stored vertices of light paths to the camera, which has them in view. An index counts from
/// `first`.
template <class World>
struct splat_vertices {
  static constexpr bool waits_for_memory = true;

  World world;
  pinhole camera;
  wfpg::light_vertices_view<subpath_vertex> stored;
  std::uint32_t first;
  wfpg::splat_view splats;        ///< by index
  wfpg::splat_view plain_splats;  ///< without weights; of no places, where nobody asks for them

  WFPG_HD void operator()(std::size_t i) const {
    const subpath_vertex& vertex = stored[first + static_cast<std::uint32_t>(i)];
    const way_to_camera to(camera, vertex.at.position);
    if (!to.in_view) return;  // compilers may round differently here
    const float pdf = camera.pdf(-to.toward);
    const vec3 value =
        vertex.throughput * vertex.scattered_flux(to.toward) * (pdf / (to.distance * to.distance));
    if (!(wfpg::luminance(value) > 0.0f)) return;
    const clear_way way = world.way_between(vertex, camera.position(), false);
    if (way.transmittance == vec3(0.0f)) return;
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    const wfpg::path_edge edge{to.distance, way.pdf.there, way.pdf.back};
    const vec3 found = value * way.transmittance;
    splats.add(i, to.pixel,
               found * vertex.weights.splat(world.techniques, vertex.leave(f, to.toward), pdf, edge));
    if (plain_splats.size() > 0) plain_splats.add(i, to.pixel, found);
  }
};

}  // namespace render
