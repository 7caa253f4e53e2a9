// Paths from both ends: techniques agree with path tracing, alone and together; weights are those of the
// densities of the renderer's own paths; light leaves each kind of light as light samples find it; one seed
// gives one picture on any policy.
#include "app/render.hpp"
#include "casters/embree_caster.hpp"
#include "scene/scene_builder.hpp"
#include "support/catch.hpp"
#include "support/policies.hpp"
#include "support/renderings.hpp"
#include "tracer/bidirectional.hpp"

#include <wfpg/exec/omp.hpp>
#include <wfpg/exec/seq.hpp>
#include <wfpg/exec/tbb.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using render::sampling_method;
using render::subpath;
using render::subpath_vertex;
using render::vec3;
using wfpg_test::check_precisely;
using wfpg_test::check_rendering;
using wfpg_test::rendering;

rendering with(const std::string& scene, const std::string& techniques) {
  rendering what{scene, true, sampling_method::bpt};
  what.techniques = render::techniques_of(techniques);
  return what;
}

// Weights.

using exec_policy = wfpg::exec::seq;
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
        world{view, lights.view(), accelerated.caster(), {}, {7, 0}, 6} {
    world.techniques.splats = static_cast<float>(pixels * pixels);
  }

  static constexpr int pixels = 16;
  exec_policy exec;
  render::device_scene<exec_policy> geometry;
  render::light_distribution<exec_policy> lights;
  render::embree_scene accelerated;
  render::pinhole camera;
  render::scene_view view;
  world_type world;
};

/// A light or camera path, with all that densities need.
struct followed_path {
  vec3 end{0.0f};                        ///< point on the light, or the pinhole
  wfpg::light_end light;                 ///< of light paths
  std::vector<subpath_vertex> vertices;  ///< from that end
  /// Of each vertex: the probability of the delta lobe in which the path left it. 0 where it left by none.
  std::vector<float> delta;
};

void follow(const world_type& world, std::uint32_t id, std::uint32_t first_dimension, subpath path,
            bool carries_flux, followed_path& followed) {
  for (std::uint32_t segments = 1; segments < world.max_depth; ++segments) {
    subpath_vertex vertex;
    render::hit_surface found;
    if (!world.arrive(path, segments, vertex, found)) return;
    followed.vertices.push_back(vertex);
    followed.delta.push_back(0.0f);
    const wfpg::vec2 u = world.draw(id, segments, first_dimension);
    const render::bsdf f = vertex.seen_from(vertex.at.outgoing);
    const wfpg::bsdf_sample drawn = f.sample(vertex.at.outgoing, u);
    if (drawn.is_delta || f.is_delta()) followed.delta.back() = drawn.pdf;
    if (!world.scatter(vertex, u, carries_flux, path)) return;
  }
}

followed_path light_path(const test_world& in, std::uint32_t id) {
  followed_path followed;
  const render::emitted_ray emitted = in.world.lights.emit(in.world.scene, [&](std::uint32_t use) {
    return in.world.random(id, render::light_path_dimensions + use);
  });
  if (!(wfpg::luminance(emitted.throughput) > 0.0f)) return followed;
  followed.end = emitted.ray.origin;
  followed.light = emitted.source;
  follow(in.world, id, render::light_path_dimensions,
         subpath(emitted.ray.origin, emitted.ray.direction, emitted.throughput,
                 wfpg::subpath_weights::from_light(in.world.techniques, emitted.source)),
         true, followed);
  return followed;
}

followed_path camera_path(const test_world& in, std::uint32_t id) {
  followed_path followed;
  followed.end = in.camera.position();
  const wfpg::ray ray = in.camera.through(id % (in.pixels * in.pixels), in.world.random(id, 1u << 20));
  follow(in.world, id, 0,
         subpath(ray.origin, ray.direction, vec3(1.0f),
                 wfpg::subpath_weights::from_camera(in.camera.pdf(ray.direction))),
         false, followed);
  return followed;
}

/// A whole path: x[0] lies on the light, x[k] is the pinhole, and vertices[i] is x[i] for 0 < i < k. Edge i
/// joins x[i] with x[i + 1]. Its direction and length are those of the ray that the renderer traced, which
/// begins a little off its surface.
struct whole_path {
  std::vector<vec3> ways;  ///< from x[i] to x[i + 1], unit length
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
    return direction * cosine / square(from, to);
  }
};

/// The balance heuristic's weight of each number of vertices that the light path has, by brute force.
std::vector<double> weights_of(const whole_path& path, const render::pinhole& camera,
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
                                               path.square(1, 0);
  std::vector<double> terms;
  for (int s = 0; s <= k; ++s) {
    double p = s == 0 ? t.light_hits : s == 1 ? t.next_event : s == k ? t.splats : t.connections;
    for (int i = 0; i < s; ++i) p *= s == 1 ? static_cast<double>(path.light.pdf_connect) : at(by_light, i);
    for (int i = s; i < k; ++i) p *= at(by_camera, i);
    if (s > 0 && s < k && path.is_delta(s)) p = 0.0;
    if (s > 1 && path.is_delta(s - 1)) p = 0.0;
    terms.push_back(p);
  }
  double sum = 0.0;
  for (const double term : terms) sum += term;
  for (double& term : terms) term /= sum;
  return terms;
}

/// The path that joins vertex `s` - 1 of a light path with vertex `t` - 1 of a camera path.
whole_path join(const followed_path& light, const followed_path& camera, int s, int t) {
  whole_path path;
  const auto add_vertex = [&](const subpath_vertex* vertex, float delta) {
    path.vertices.push_back(vertex);
    path.delta.push_back(delta);
  };
  const auto add_edge = [&](vec3 way, vec3 from, vec3 to) {
    path.ways.push_back(way);
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

bool joins_nothing(const subpath_vertex& vertex) {
  return vertex.seen_from(vertex.at.outgoing).is_delta();
}

// A spot of 1 W/sr one unit above a grey plane, and a camera that sees a square below it. The spot's cone is
// wider than all that merges reach.

constexpr double half_plane = 4.0, reflectance = 0.5, half_view = 0.3;

render::scene lamp_over_plane() {
  render::scene_builder b("lamp over plane");
  const auto grey = b.diffuse(vec3(static_cast<float>(reflectance)));
  const auto half = static_cast<float>(half_plane);
  b.parallelogram({-half, 0.0f, -half}, {2.0f * half, 0.0f, 0.0f}, {0.0f, 0.0f, 2.0f * half},
                  {{0.0f, 1.0f, 0.0f}, grey});
  render::scene s = b.finish(2);
  render::punctual_light lamp;
  lamp.kind = render::punctual_kind::spot;
  lamp.position = {0.0f, 1.0f, 0.0f};
  lamp.direction = {0.0f, -1.0f, 0.0f};
  lamp.cos_inner = 0.75f;
  lamp.cos_outer = 0.7f;
  s.punctual_lights = {lamp};
  s.view.position = {0.0f, 3.0f, 0.0f};
  s.view.forward = {0.0f, -1.0f, 0.0f};
  s.view.up = {0.0f, 0.0f, -1.0f};
  s.view.vertical_fov = 2.0f * std::atan(static_cast<float>(half_view / 3.0));
  return s;
}

/// The mean radiance of the camera's picture where irradiance is averaged over discs of that radius, by
/// quadrature.
double radiance_around_lamp(double radius) {
  constexpr int places = 40, rings = 60, angles = 32;
  const double pi = 3.14159265358979;
  const auto irradiance = [](double x, double z) { return std::pow(1.0 + x * x + z * z, -1.5); };
  double sum = 0.0;
  for (int i = 0; i < places; ++i)
    for (int j = 0; j < places; ++j) {
      const double x = half_view * (2.0 * (i + 0.5) / places - 1.0),
                   z = half_view * (2.0 * (j + 0.5) / places - 1.0);
      for (int ring = 0; ring < rings; ++ring)
        for (int angle = 0; angle < angles; ++angle) {
          const double r = radius * std::sqrt((ring + 0.5) / rings), phi = 2.0 * pi * angle / angles;
          sum += irradiance(x + r * std::cos(phi), z + r * std::sin(phi));
        }
    }
  return reflectance / pi * sum / (places * places * rings * angles);
}

}  // namespace

TEST_CASE("paths from both ends have the mean of path tracing", "[renderer][bidirectional][unbiased]") {
  for (const char* scene : {"glossy-room", "materials", "outdoor", "furnace"})
    check_rendering(with(scene, "bpt"));
  check_rendering(with("cornell-box with a map", "bpt"));
  check_precisely(with("", "bpt"));
}

TEST_CASE("each technique that can find all light has the mean of path tracing",
          "[renderer][bidirectional][unbiased]") {
  check_precisely(with("", "hits"));
  check_precisely(with("", "splat+hits"));
  check_precisely(with("", "hits+nee+connect"));
  check_rendering(with("cornell-box", "nee"));
  check_rendering(with("cornell-box", "splat"));
  check_rendering(with("cornell-box", "nee+connect"));
  check_rendering(with("cornell-box", "connect+splat"));
  check_rendering(with("glossy-room", "splat"));
  check_rendering(with("caustic-pool", "hits+splat"));  // its camera is in the water
  check_rendering({"cornell-box", true, sampling_method::lt});
}

TEST_CASE("light leaves lights without extent as light samples find it",
          "[renderer][bidirectional][unbiased]") {
  check_rendering(with("lamps without extent", "splat"));
  check_rendering(with("lamps without extent", "connect+nee+splat"));
}

TEST_CASE("weights are those of the densities of the renderer's own paths", "[renderer][bidirectional]") {
  double worst = 0.0;
  std::size_t compared = 0, with_delta = 0;
  for (const char* name : {"cornell-box", "materials", "glossy-room", "caustic-pool"}) {
    const test_world in(render::make_builtin_scene(name));
    for (std::uint32_t id = 0; id < 2000; ++id) {
      const followed_path light = light_path(in, id), camera = camera_path(in, id);
      for (int s = 1; s <= static_cast<int>(light.vertices.size()); ++s)
        for (int t = 1; t <= static_cast<int>(camera.vertices.size()); ++t) {
          const subpath_vertex &y = light.vertices[static_cast<std::size_t>(s - 1)],
                               &z = camera.vertices[static_cast<std::size_t>(t - 1)];
          if (joins_nothing(y) || joins_nothing(z)) continue;
          const whole_path path = join(light, camera, s, t);
          if (!(path.lengths[static_cast<std::size_t>(s)] > 0.0)) continue;
          const vec3 toward = path.toward(s + 1, s);
          const wfpg::path_departure from_light = y.leave(y.seen_from(y.at.outgoing), -toward),
                                     from_camera = z.leave(z.seen_from(z.at.outgoing), toward);
          // Only what carries light has a weight.
          if (!(from_light.pdf > 0.0f && from_camera.pdf > 0.0f)) continue;
          wfpg::path_edge edge;
          edge.distance = static_cast<float>(std::sqrt(path.square(s, s + 1)));
          const float weight =
              y.weights.connection(in.world.techniques, from_light, z.weights, from_camera, edge);
          const std::vector<double> expected = weights_of(path, in.camera, in.world.techniques);
          worst = std::max(worst, std::abs(double(weight) - expected[static_cast<std::size_t>(s + 1)]));
          ++compared;
          for (const float delta : path.delta) with_delta += delta > 0.0f ? 1 : 0;
        }
    }
  }
  INFO(compared << " connections, " << with_delta << " delta vertices");
  CHECK(compared > 10000);
  CHECK(with_delta > 1000);
  CHECK(worst < 1e-4);
}

TEST_CASE("merging has the mean of path tracing where its radius is small",
          "[renderer][bidirectional][unbiased]") {
  for (const char* scene : {"cornell-box", "materials"}) check_rendering({scene, true, sampling_method::vcm});
}

TEST_CASE("merging blurs by its disc, with a bias that falls as the square of its radius",
          "[renderer][bidirectional]") {
  const render::scene scene = lamp_over_plane();
  const double scene_radius = half_plane * std::sqrt(2.0);
  std::vector<double> over_square;
  for (const double radius : {0.4, 0.2}) {
    // Means of independent seeds.
    std::vector<double> means;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      render::render_options options;
      options.method = sampling_method::vcm;
      options.techniques = render::techniques_of("surf");
      options.light.merge_radius = static_cast<float>(radius / scene_radius);
      options.light.radius_alpha = 1.0f;
      options.width = options.height = 24;
      options.max_depth = 2;
      options.spp = radius > 0.3 ? 100 : 500;
      options.where = render::device::seq;  // waves are too small to share
      options.seed = seed;
      const render::image picture = render::render(scene, options, {}).picture;
      double sum = 0.0;
      for (const vec3& pixel : picture.pixels) sum += static_cast<double>(pixel.x);
      means.push_back(sum / static_cast<double>(picture.pixels.size()));
    }
    double mean = 0.0, variance = 0.0;
    for (const double m : means) mean += m / 10.0;
    for (const double m : means) variance += (m - mean) * (m - mean) / (9.0 * 10.0);
    const double exact = radiance_around_lamp(0.0), expected = radiance_around_lamp(radius);
    INFO("radius " << radius << ": " << mean << " +- " << std::sqrt(variance) << ", expected " << expected
                   << ", without bias " << exact);
    CHECK(std::abs(mean - expected) < 4.0 * std::sqrt(variance));
    CHECK(std::sqrt(variance) < 0.05 * (exact - expected));
    over_square.push_back((exact - mean) / (radius * radius));
  }
  // A bias that fell as the radius would have a ratio of 1/2, one that fell as its cube 2.
  CHECK(over_square[0] / over_square[1] == Approx(1.0).margin(0.2));
}

TEST_CASE("one seed gives one picture of paths from both ends on any policy", "[renderer][bidirectional]") {
  const render::scene scene = render::make_builtin_scene("materials");
  render::render_options options;
  options.method = sampling_method::vcm;
  options.light.merge_radius = 0.02f;
  options.width = 24;
  options.height = 16;
  options.spp = 3;
  std::vector<std::vector<vec3>> pictures;
  for (const render::device where : {render::device::seq, render::device::omp, render::device::cpu}) {
    options.where = where;
    pictures.push_back(render::render(scene, options, {}).picture.pixels);
  }
  CHECK(pictures[1] == pictures[0]);
  CHECK(pictures[2] == pictures[0]);
}

TEST_CASE("vertices of light paths beyond their memory are counted", "[renderer][bidirectional]") {
  const render::scene scene = render::make_builtin_scene("cornell-box");
  render::render_options options;
  options.method = sampling_method::bpt;
  options.width = options.height = 16;
  options.spp = 2;
  const render::render_report enough = render::render(scene, options, {}).report;
  CHECK(enough.dropped_light_vertices == 0);
  options.light.memory = 100 * (sizeof(subpath_vertex) + sizeof(std::uint32_t));
  const render::render_report little = render::render(scene, options, {}).report;
  CHECK(little.dropped_light_vertices > 100);
  CHECK(little.light_vertex_bytes < enough.light_vertex_bytes);
}

TEST_CASE("names of techniques are read and written", "[renderer][bidirectional]") {
  CHECK(render::names_of(render::technique_set()) == "hits+nee+connect+splat");
  CHECK(render::names_of(render::connection_and_merging()) == "hits+nee+connect+splat+surf");
  CHECK(render::names_of(render::techniques_of("splat+nee")) == "nee+splat");
  CHECK(render::names_of(render::techniques_of("bpt")) == "hits+nee+connect+splat");
  for (const char* wrong : {"", "hit", "nee,splat", "nee+", "+nee"})
    CHECK_THROWS_AS(render::techniques_of(wrong), std::invalid_argument);
}
