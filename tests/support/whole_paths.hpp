// Light and camera paths of the renderer, joined, and the weights of the joined paths by brute force.
#pragma once

#include "casters/embree_caster.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/policies.hpp"
#include "tracer/bidirectional.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace wfpg_test {

using render::subpath;
using render::subpath_vertex;
using render::vec3;

using caster_type = decltype(std::declval<const render::embree_scene&>().caster());
using world_type = render::bidirectional_world<caster_type>;

/// A scene, ready for kernels.
struct test_world {
  explicit test_world(const render::scene& host)
      : geometry(exec, host),
        lights(exec, host),
        accelerated(exec, host, geometry.view()),
        camera(host.view, pixels, pixels),
        view(geometry.view()),
        world{view, lights.view(), accelerated.caster()} {
    world.random = {7, 0};
    world.max_depth = 6;
    world.techniques.splats = static_cast<float>(pixels * pixels);
    world.techniques.surface_points = 2.0f;
    world.techniques.volume_points = 0.3f;
    world.techniques.beam_points = 0.7f;
    world.techniques.beams = 1.5f;
    around_camera = render::solids_around(view, world.caster, camera.position());
  }

  static constexpr int pixels = 16;
  one_policy exec;
  render::device_scene<one_policy> geometry;
  render::light_distribution<one_policy> lights;
  render::embree_scene accelerated;
  render::pinhole camera;
  render::scene_view view;
  world_type world;
  render::solid_stack around_camera;
  /// Density of the distance with which a path that leaves one point comes to another, where it scatters in a
  /// medium or not.
  std::function<double(vec3 from, vec3 to, bool ends_inside)> distance_pdf = [](vec3, vec3, bool) {
    return 1.0;
  };
};

/// A light or camera path, with all that densities need.
struct followed_path {
  vec3 end{0.0f};                        ///< point on the light, or the pinhole
  wfpg::light_end light;                 ///< of light paths
  std::vector<subpath_vertex> vertices;  ///< from that end
  /// Of each vertex: the probability of the delta lobe in which the path left it. 0 where it left by none.
  std::vector<float> delta;
};

inline void follow(const world_type& world, std::uint32_t id, std::uint32_t first_dimension, subpath path,
                   bool carries_flux, followed_path& followed) {
  for (std::uint32_t segments = 1; segments < world.max_depth; ++segments) {
    subpath_vertex vertex;
    render::passer ahead = world.passer_of(id, segments, first_dimension);
    if (!world.arrive(path, segments, vertex, ahead)) return;
    followed.vertices.push_back(vertex);
    followed.delta.push_back(0.0f);
    const wfpg::vec2 u = world.draw(id, segments, first_dimension);
    const render::scatterer f = vertex.seen_from(vertex.at.outgoing);
    const wfpg::bsdf_sample drawn = f.sample(vertex.at.outgoing, u);
    if (drawn.is_delta || f.is_delta()) followed.delta.back() = drawn.pdf;
    if (!world.scatter(vertex, u, carries_flux, path)) return;
  }
}

inline followed_path light_path(const test_world& in, std::uint32_t id) {
  followed_path followed;
  const render::emitted_ray emitted = in.world.lights.emit(in.world.scene, [&](std::uint32_t use) {
    return in.world.random(id, render::light_path_dimensions + use);
  });
  if (!(wfpg::luminance(emitted.throughput) > 0.0f)) return followed;
  followed.end = emitted.ray.origin;
  followed.light = emitted.source;
  follow(in.world, id, render::light_path_dimensions,
         subpath(emitted.ray, emitted.throughput,
                 wfpg::subpath_weights::from_light(in.world.techniques, emitted.source), {}),
         true, followed);
  return followed;
}

inline followed_path camera_path(const test_world& in, std::uint32_t id) {
  followed_path followed;
  followed.end = in.camera.position();
  const wfpg::ray ray = in.camera.through(id % (in.pixels * in.pixels), in.world.random(id, 1u << 20));
  follow(in.world, id, 0,
         subpath(ray, vec3(1.0f), wfpg::subpath_weights::from_camera(in.camera.pdf(ray.direction)),
                 in.around_camera),
         false, followed);
  return followed;
}

/// A whole path: x[0] lies on the light, x[k] is the pinhole, and vertices[i] is x[i] for 0 < i < k. Edge i
/// joins x[i] with x[i + 1]. Its direction and length are those of the ray that the renderer traced, which
/// begins a little off its surface.
struct whole_path {
  const test_world* in;
  std::vector<vec3> ways;   ///< from x[i] to x[i + 1], unit length
  std::vector<vec3> edges;  ///< two points an edge
  std::vector<double> lengths;
  std::vector<const subpath_vertex*> vertices;
  std::vector<float> delta;
  wfpg::light_end light;
  int k() const { return static_cast<int>(ways.size()); }

  /// The direction from x[from] to x[to], which are neighbours.
  vec3 toward(int from, int to) const {
    return from < to ? ways[static_cast<std::size_t>(from)] : -ways[static_cast<std::size_t>(to)];
  }
  double square(int a, int b) const {
    const double length = lengths[static_cast<std::size_t>(std::min(a, b))];
    return length * length;
  }
  bool is_delta(int i) const { return delta[static_cast<std::size_t>(i)] > 0.0f; }
  /// Density, by solid angle, of going on from x[i] to x[to], after a path came to x[i] from x[from].
  double scatters(int from, int i, int to) const {
    if (is_delta(i)) return static_cast<double>(delta[static_cast<std::size_t>(i)]);
    const subpath_vertex& v = *vertices[static_cast<std::size_t>(i)];
    const vec3 back = toward(i, from);
    return static_cast<double>(v.seen_from(back).pdf(back, toward(i, to)));
  }
  /// Density by area of x[to], reached from x[from], whose direction has that density.
  double by_area(double direction, int from, int to) const {
    const auto cosine = static_cast<double>(vertices[static_cast<std::size_t>(to)]->cosine(toward(to, from)));
    return direction * cosine / square(from, to) * distance(from, to);
  }
  /// Density of the distance from x[from] to its neighbour x[to].
  double distance(int from, int to) const {
    const auto edge = 2 * static_cast<std::size_t>(std::min(from, to));
    const subpath_vertex* end = vertices[static_cast<std::size_t>(to)];
    const vec3 a = edges[edge], b = edges[edge + 1];
    return in->distance_pdf(from < to ? a : b, from < to ? b : a, end && end->in_medium());
  }
};

/// Samples of each kind of merge at x[i] times its kernel's volume, by the numbers of wfpg::merge_technique.
/// Photon beams are short.
inline std::array<double, 4> merge_volumes(const whole_path& path, const wfpg::path_techniques& t, int i) {
  const subpath_vertex& at = *path.vertices[static_cast<std::size_t>(i)];
  if (path.is_delta(i)) return {};
  if (!at.in_medium()) return {double(t.surface_points), 0.0, 0.0, 0.0};
  const double sine = double(glm::length(glm::cross(path.toward(i, i - 1), path.toward(i, i + 1))));
  const double camera = path.distance(i + 1, i);
  return {0.0, double(t.volume_points), double(t.beam_points) / camera,
          double(t.beams) * sine / (double(at.extinction) * camera)};
}

/// The balance heuristic's weights of a whole path, by brute force.
struct whole_weights {
  std::vector<double> joins;                  ///< by the number of vertices that the light path has
  std::vector<std::array<double, 4>> merges;  ///< by the number of the merged vertex, and by the technique
};

inline whole_weights weights_of(const whole_path& path, const render::pinhole& camera,
                                const wfpg::path_techniques& t) {
  const int k = path.k();
  std::vector<double> by_light(static_cast<std::size_t>(k)), by_camera(static_cast<std::size_t>(k));
  const auto at = [](std::vector<double>& values, int i) -> double& {
    return values[static_cast<std::size_t>(i)];
  };
  at(by_light, 0) = static_cast<double>(path.light.pdf_trace);
  for (int i = 1; i < k; ++i)
    at(by_light, i) = path.by_area(
        i == 1 ? static_cast<double>(path.light.pdf_direction) : path.scatters(i - 2, i - 1, i), i - 1, i);
  for (int i = k - 1; i >= 1; --i)
    at(by_camera, i) = path.by_area(
        i == k - 1 ? static_cast<double>(camera.pdf(path.toward(k, k - 1))) : path.scatters(i + 2, i + 1, i),
        i + 1, i);
  at(by_camera, 0) = path.light.is_delta ? 0.0
                                         : path.scatters(2, 1, 0) * static_cast<double>(path.light.cosine) /
                                               path.square(1, 0) * path.distance(1, 0);
  whole_weights all;
  double sum = 0.0;
  for (int s = 0; s <= k; ++s) {
    double p = s == 0 ? t.light_hits : s == 1 ? t.next_event : s == k ? t.splats : t.connections;
    for (int i = 0; i < s; ++i) p *= s == 1 ? static_cast<double>(path.light.pdf_connect) : at(by_light, i);
    for (int i = s; i < k; ++i) p *= at(by_camera, i);
    if (s > 0 && s < k && path.is_delta(s)) p = 0.0;
    if (s > 1 && path.is_delta(s - 1)) p = 0.0;
    all.joins.push_back(p);
    sum += p;
  }
  all.merges.resize(static_cast<std::size_t>(k));
  for (int merged = 1; merged < k; ++merged) {
    double p = 1.0;
    for (int i = 0; i <= merged; ++i) p *= at(by_light, i);
    for (int i = merged; i < k; ++i) p *= at(by_camera, i);
    all.merges[static_cast<std::size_t>(merged)] = merge_volumes(path, t, merged);
    for (double& term : all.merges[static_cast<std::size_t>(merged)]) sum += term *= p;
  }
  for (double& term : all.joins) term /= sum;
  for (std::array<double, 4>& terms : all.merges)
    for (double& term : terms) term /= sum;
  return all;
}

/// The path that joins vertex `s` - 1 of a light path with vertex `t` - 1 of a camera path.
inline whole_path join(const test_world& in, const followed_path& light, const followed_path& camera, int s,
                       int t) {
  whole_path path;
  path.in = &in;
  const auto add_vertex = [&](const subpath_vertex* vertex, float delta) {
    path.vertices.push_back(vertex);
    path.delta.push_back(delta);
  };
  const auto add_edge = [&](vec3 way, vec3 from, vec3 to) {
    path.ways.push_back(way);
    path.edges.insert(path.edges.end(), {from, to});
    path.lengths.push_back(static_cast<double>(glm::length(to - from)));
  };
  path.light = light.light;
  add_vertex(nullptr, 0.0f);
  vec3 last = light.end;
  for (int i = 0; i < s; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const subpath_vertex& vertex = light.vertices[n];
    const vec3 way = -vertex.at.outgoing;
    add_edge(way, i == 0 ? last : light.vertices[n - 1].leave_along(way), vertex.at.position);
    // The joined vertices are left toward each other.
    add_vertex(&vertex, i + 1 == s ? 0.0f : light.delta[n]);
    last = vertex.at.position;
  }
  for (int i = t - 1; i >= 0; --i) {
    const auto n = static_cast<std::size_t>(i);
    const subpath_vertex& vertex = camera.vertices[n];
    if (i == t - 1) add_edge(glm::normalize(vertex.at.position - last), last, vertex.at.position);
    add_vertex(&vertex, i + 1 == t ? 0.0f : camera.delta[n]);
    const vec3 way = vertex.at.outgoing;
    add_edge(way, vertex.at.position, i == 0 ? camera.end : camera.vertices[n - 1].leave_along(-way));
  }
  add_vertex(nullptr, 0.0f);
  return path;
}

inline bool joins_nothing(const subpath_vertex& vertex) {
  return vertex.seen_from(vertex.at.outgoing).is_delta();
}

/// What weights of connections and merges have been compared.
struct compared_weights {
  double worst = 0.0;         ///< difference of a connection's weight
  double worst_merged = 0.0;  ///< likewise of a merge
  std::size_t connections = 0, merges = 0, delta_vertices = 0, medium_vertices = 0;
};

/// Compares the weights of all connections of as many pairs of paths with those by brute force. Where a light
/// path would go on along a connection, it is merged with the camera path's vertex.
inline void compare_weights(const test_world& in, std::uint32_t pairs, compared_weights& all) {
  for (std::uint32_t id = 0; id < pairs; ++id) {
    const followed_path light = light_path(in, id), camera = camera_path(in, id);
    for (int s = 1; s <= static_cast<int>(light.vertices.size()); ++s)
      for (int t = 1; t <= static_cast<int>(camera.vertices.size()); ++t) {
        const subpath_vertex &y = light.vertices[static_cast<std::size_t>(s - 1)],
                             &z = camera.vertices[static_cast<std::size_t>(t - 1)];
        if (joins_nothing(y) || joins_nothing(z)) continue;
        const whole_path path = join(in, light, camera, s, t);
        if (!(path.lengths[static_cast<std::size_t>(s)] > 0.0)) continue;
        const vec3 toward = path.toward(s + 1, s);
        const wfpg::path_departure from_light = y.leave(y.seen_from(y.at.outgoing), -toward),
                                   from_camera = z.leave(z.seen_from(z.at.outgoing), toward);
        // Only what carries light has a weight.
        if (!(from_light.pdf > 0.0f && from_camera.pdf > 0.0f)) continue;
        const render::clear_way way = in.world.way_between(z, y.leave_along(-toward), y.in_medium());
        if (way.transmittance == vec3(0.0f)) continue;
        const wfpg::path_edge edge{static_cast<float>(std::sqrt(path.square(s, s + 1))), way.pdf.back,
                                   way.pdf.there};
        const float weight =
            y.weights.connection(in.world.techniques, from_light, z.weights, from_camera, edge);
        const whole_weights expected = weights_of(path, in.camera, in.world.techniques);
        const auto end = static_cast<std::size_t>(s + 1);
        all.worst = std::max(all.worst, std::abs(double(weight) - expected.joins[end]));
        ++all.connections;
        const wfpg::vertex_weights arrived =
            y.weights.depart(in.world.techniques, from_light)
                .arrive({edge.distance, z.cosine(toward), edge.pdf_light, edge.pdf_camera});
        for (std::size_t by = 0; by < 4; ++by) {
          if (!(expected.merges[end][by] > 0.0)) continue;
          const float merged = arrived.merge(in.world.techniques, static_cast<wfpg::merge_technique>(by),
                                             z.weights, from_camera);
          all.worst_merged = std::max(all.worst_merged, std::abs(double(merged) - expected.merges[end][by]));
          ++all.merges;
        }
        for (const float delta : path.delta) all.delta_vertices += delta > 0.0f ? 1 : 0;
        for (const subpath_vertex* vertex : path.vertices)
          all.medium_vertices += vertex && vertex->in_medium() ? 1 : 0;
      }
  }
}

}  // namespace wfpg_test
