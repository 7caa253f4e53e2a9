// Kernels that join camera paths' vertices with light samples and with vertices of light paths, along
// straight ways. They are functors of an index on the data of bidirectional_state.hpp. A camera path is
// connected with the light path of its own index. A join is evaluated without what is on its way, then cast,
// then weighted. Joins of both kinds share one list, so that their rays fill a GPU together.
#pragma once

#include "tracer/bidirectional_state.hpp"
#include "tracer/found_light.hpp"

namespace render {

/// Light that a join finds.
struct join {
  vec3 value{0.0f};     ///< what light it brings, without its weight
  float weight = 0.0f;  ///< 0: it finds none

  join() = default;
  WFPG_HD join(vec3 brings, float weighted) : value(brings), weight(weighted) {}
};

static_assert(sizeof(join) == 16, "kernels access it in one piece");

/// A light sample at the end of a join. Vectors are not initialised.
struct alignas(16) sampled_light {
  vec3 direction;  ///< toward the light, unit length
  vec3 end;        ///< where a ray toward it ends; without meaning where it is distant
  wfpg::light_end source;

  sampled_light() = default;
  explicit WFPG_HD sampled_light(const light_sample& light)
      : direction(light.direction), end(light.end), source(light.source) {}

  WFPG_HD wfpg::ray ray_from(const subpath_vertex& vertex) const {
    return source.is_distant ? ray_along(vertex.leave_along(direction), direction) : vertex.ray_to(end);
  }
  WFPG_HD float weight(const wfpg::path_techniques& techniques, const subpath_vertex& vertex,
                       const way_densities& pdf) const {
    // A light path comes the other way.
    wfpg::path_edge edge{1.0f, pdf.back, pdf.there};
    if (!source.is_distant) edge.distance = glm::length(end - vertex.at.position);
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    return vertex.weights.next_event(techniques, vertex.leave(f, direction), source, edge);
  }
};

static_assert(sizeof(sampled_light) == 48, "kernels access it in three pieces");

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

  /// Light that the connection brings if nothing is between its ends.
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

/// The joins of one vertex of each camera path. First come those with light samples, by path, then those with
/// the stored vertices of light paths, in their order. A stored vertex is joined with the camera path of its
/// light path's index.
struct path_joins {
  tiled_view<subpath_vertex> vertices;  ///< of camera paths
  tiled_view<sampled_light> lights;     ///< by path; empty without light samples
  wfpg::light_vertices_view<subpath_vertex> stored;
  tiled_view<join> found;                   ///< by join
  wfpg::array_view<way_densities> between;  ///< of the way between its ends, by join

  WFPG_HD bool is_with_light(std::size_t i) const { return i < lights.size(); }
  /// The stored vertex of a join. Precondition: !is_with_light(i).
  WFPG_HD std::uint32_t stored_of(std::size_t i) const {
    return static_cast<std::uint32_t>(i - lights.size());
  }
  /// The join with a stored vertex.
  WFPG_HD std::size_t with_stored(std::uint32_t k) const { return lights.size() + k; }
  /// The camera path of a join.
  WFPG_HD std::size_t path(std::size_t i) const { return is_with_light(i) ? i : stored.path(stored_of(i)); }
};

/// Draws a light sample for a camera path's vertex, and evaluates the join with it.
template <class World>
struct draw_lights {
  World world;
  path_joins joins;
  wfpg::array_view<std::uint32_t> marks;  ///< by join: 1 where light may come; 0 before

  WFPG_HD void operator()(std::size_t i) const {
    const subpath_vertex& vertex = joins.vertices[i];
    const light_sample light = world.lights.sample(world.scene, vertex.at.position, [&](std::uint32_t use) {
      return world.draw(static_cast<std::uint32_t>(i), vertex.segments, use);
    });
    joins.found.emplace(i);
    if (!(light.pdf > 0.0f)) return;
    const scatterer f = vertex.seen_from(vertex.at.outgoing);
    const vec3 value = f.eval_rgb(vertex.at.outgoing, light.direction) * light.radiance / light.pdf;
    if (!(wfpg::luminance(value) > 0.0f)) return;
    marks[i] = 1;
    joins.lights.emplace(i, light);
    joins.found.emplace(i, value, 0.0f);
  }
};

/// Evaluates joins with stored vertices. An index is a stored vertex.
struct evaluate_connections {
  static constexpr bool waits_for_memory = true;

  path_joins joins;
  wfpg::array_view<const std::uint32_t> joined;  ///< by path: 1 where the camera path's vertex can be joined
  wfpg::array_view<std::uint32_t> marks;         ///< by join: receives 1 where light may come, else 0

  WFPG_HD void operator()(std::size_t k) const {
    const std::size_t i = joins.with_stored(static_cast<std::uint32_t>(k)), path = joins.path(i);
    marks[i] = 0;
    if (joined[path] == 0) return;
    const subpath_vertex& camera = joins.vertices[path];
    const subpath_vertex& light = joins.stored[static_cast<std::uint32_t>(k)];
    const vec3 value = connection_ends(camera, light).value();
    if (!(wfpg::luminance(value) > 0.0f)) return joins.found.emplace(i);
    marks[i] = 1;
    joins.found.emplace(i, value, 0.0f);
  }
};

/// Looks what is between the ends of joins.
template <class World>
struct cast_joins {
  static constexpr bool waits_for_memory = true;

  World world;
  path_joins joins;
  wfpg::array_view<std::uint32_t> marks;  ///< by join: receives 0 where nothing is left of the light

  WFPG_HD void operator()(std::size_t i) const {
    const subpath_vertex& camera = joins.vertices[joins.path(i)];
    wfpg::ray ray;
    bool ends_inside = false;
    if (joins.is_with_light(i)) {
      ray = joins.lights[i].ray_from(camera);
    } else {
      const subpath_vertex& light = joins.stored[joins.stored_of(i)];
      ray = camera.ray_to(light.leave_along(camera.at.position - light.at.position));
      ends_inside = light.in_medium();
    }
    const clear_way clear = world.way_along(camera, ray, ends_inside);
    if (clear.transmittance == vec3(0.0f)) {
      marks[i] = 0;
      return joins.found.emplace(i);
    }
    joins.between[i] = clear.pdf;
    joins.found.emplace(i, joins.found[i].value * clear.transmittance, 0.0f);
  }
};

/// Weights joins.
struct weight_joins {
  wfpg::path_techniques techniques;
  path_joins joins;

  WFPG_HD void operator()(std::size_t i) const {
    const subpath_vertex& camera = joins.vertices[joins.path(i)];
    const float weight =
        joins.is_with_light(i)
            ? joins.lights[i].weight(techniques, camera, joins.between[i])
            : connection_ends(camera, joins.stored[joins.stored_of(i)]).weight(techniques, joins.between[i]);
    joins.found.emplace(i, joins.found[i].value, weight);
  }
};

/// Adds what the joins of a camera path's vertex have found. The light sample is first, then stored vertices
/// from the last one of its light path on.
struct add_joins {
  path_joins joins;
  std::uint32_t size;  ///< stored vertices that are joined: those with a smaller index
  found_light found;

  WFPG_HD void operator()(std::size_t path) const {
    const vec3 throughput = joins.vertices[path].throughput;
    if (joins.is_with_light(path)) {
      technique_sum sum;
      add(path, sum);
      found.add(path, technique::nee, sum, throughput);
    }
    if (size == 0) return;
    const auto& stored = joins.stored;
    technique_sum sum;
    for (std::uint32_t k = stored.last(path); k != stored.none; k = stored.previous(k))
      if (k < size) add(joins.with_stored(k), sum);
    found.add(path, technique::connect, sum, throughput);
  }

 private:
  WFPG_HD void add(std::size_t i, technique_sum& sum) const {
    const join one = joins.found[i];
    sum.add(one.value, one.weight);
  }
};

}  // namespace render
