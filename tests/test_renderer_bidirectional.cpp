// Paths from both ends: techniques agree with path tracing, alone and together; weights are those of the
// densities of the renderer's own paths; light leaves each kind of light as light samples find it; one seed
// gives one picture on any policy.
#include "app/render.hpp"
#include "scene/scene_builder.hpp"
#include "support/catch.hpp"
#include "support/failing_resource.hpp"
#include "support/policies.hpp"
#include "support/renderings.hpp"
#include "support/whole_paths.hpp"
#include "tracer/bidirectional.hpp"

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
using render::subpath_vertex;
using render::vec3;
using wfpg_test::backend;
using wfpg_test::check_precisely;
using wfpg_test::check_rendering;
using wfpg_test::compare_weights;
using wfpg_test::compared_weights;
using wfpg_test::rendering;
using wfpg_test::test_world;

rendering with(const std::string& scene, const std::string& techniques) {
  rendering what{scene, true, sampling_method::bpt};
  what.techniques = render::techniques_of(techniques);
  return what;
}

// A spot of 1 W/sr one unit above a grey plane, and a camera that sees a square below it. The spot lights a
// little more than what merges within `radius` reach.

constexpr double half_plane = 4.0, reflectance = 0.5, half_view = 0.1;

render::scene lamp_over_plane(double radius) {
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
  const double reach = std::sqrt(2.0) * half_view + radius;
  lamp.cos_inner = static_cast<float>(0.99 / std::hypot(1.0, reach));
  lamp.cos_outer = lamp.cos_inner - 0.01f;
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
          "[renderer][bidirectional][unbiased][thorough]") {
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
  compared_weights all;
  for (const char* name : {"cornell-box", "materials", "glossy-room", "caustic-pool"}) {
    const test_world in(render::make_builtin_scene(name));
    compare_weights(in, 2000, all);
  }
  INFO(all.connections << " connections, " << all.merges << " merges, " << all.delta_vertices
                       << " delta vertices");
  CHECK(all.connections > 10000);
  CHECK(all.delta_vertices > 1000);
  CHECK(all.merges > 5000);
  CHECK(all.worst < 1e-4);
  CHECK(all.worst_merged < 1e-4);
}

TEST_CASE("merging has the mean of path tracing where its radius is small",
          "[renderer][bidirectional][unbiased]") {
  for (const char* scene : {"cornell-box", "materials"}) check_rendering({scene, true, sampling_method::vcm});
}

TEST_CASE("merging blurs by its disc, with a bias that falls as the square of its radius",
          "[renderer][bidirectional]") {
  const double scene_radius = half_plane * std::sqrt(2.0);
  std::vector<double> over_square;
  for (const double radius : {0.4, 0.2}) {
    const render::scene scene = lamp_over_plane(radius);
    // Means of independent seeds.
    std::vector<double> means;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      render::render_options options;
      options.method = sampling_method::vcm;
      options.techniques = render::techniques_of("surf");
      options.light.surface_radius = static_cast<float>(radius / scene_radius);
      options.light.radius_alpha = 1.0f;
      options.light.dense_photons = 12;  // of 16 paths
      // Noise falls with the number of photons. Each merges at most of the pixels, so few of these cost
      // least.
      options.width = options.height = 4;
      options.max_depth = 2;
      options.spp = radius > 0.3 ? 2500 : 10000;
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
  options.light.surface_radius = 0.02f;
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

TEST_CASE("the pictures of all techniques add up to the picture", "[renderer][bidirectional]") {
  const render::scene scene = render::make_builtin_scene("fog-spot");
  render::render_options options;
  options.method = sampling_method::upbp;
  options.light.volume_radius = options.light.surface_radius = 0.03f;
  options.width = 16;
  options.height = 12;
  options.spp = 4;
  options.technique_pictures = true;
  const render::render_result result = render::render(scene, options, {});
  CHECK(result.by_technique.size() == std::size_t(render::technique_count));
  std::vector<vec3> sum(result.picture.pixels.size(), vec3(0.0f));
  std::vector<int> found_by(std::size_t(render::technique_count), 0);
  for (const render::technique_images& one : result.by_technique)
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += one.weighted.pixels[i];
      // A weight is at most 1.
      CHECK(one.weighted.pixels[i].x <= 1.0001f * one.plain.pixels[i].x);
      found_by[std::size_t(one.by)] += one.weighted.pixels[i].x > 0.0f ? 1 : 0;
    }
  for (std::size_t i = 0; i < sum.size(); ++i)
    CHECK(glm::length(sum[i] - result.picture.pixels[i]) <= 1e-4f * glm::length(sum[i]));
  CHECK(found_by[std::size_t(render::technique::hits)] == 0);  // its lamp has no extent
  for (const render::technique by :
       {render::technique::nee, render::technique::connect, render::technique::splat, render::technique::surf,
        render::technique::pb2d, render::technique::bb1d})
    CHECK(found_by[std::size_t(by)] > 0);
  options.technique_pictures = false;
  const render::render_result without = render::render(scene, options, {});
  CHECK(without.by_technique.empty());
  CHECK(without.picture.pixels == result.picture.pixels);
}

TEST_CASE("vertices of light paths beyond their memory are counted", "[renderer][bidirectional]") {
  const render::scene scene = render::make_builtin_scene("cornell-box");
  render::render_options options;
  options.width = options.height = 16;
  options.spp = 2;
  for (const sampling_method method : {sampling_method::bpt, sampling_method::lt}) {
    options.method = method;
    options.light.budget_bytes = wfpg::bidirectional_options().budget_bytes;
    const render::render_report enough = render::render(scene, options, {}).report;
    CHECK(enough.dropped_light_vertices == 0);
    options.light.budget_bytes = 100 * (sizeof(subpath_vertex) + sizeof(std::uint32_t));
    const render::render_report little = render::render(scene, options, {}).report;
    CHECK(little.dropped_light_vertices > 100);
    CHECK(little.light_vertex_bytes < enough.light_vertex_bytes);
  }
}

/// The picture of two samples of fog-spot, and those of techniques, with so many splats at a time at least.
template <class Exec>
std::pair<std::vector<vec3>, std::vector<render::technique_picture>> with_splats_at_a_time(
    std::size_t splats, render::technique_set techniques, std::uint32_t max_depth) {
  const Exec exec;
  const render::scene host = render::make_builtin_scene("fog-spot");
  const render::device_scene<Exec> geometry(exec, host);
  const render::light_distribution<Exec> lights(exec, host);
  const render::embree_scene accelerated(exec, host, geometry.view());
  render::tracer_settings settings;
  settings.width = 24;
  settings.height = 16;
  settings.max_depth = max_depth;
  settings.techniques = techniques;
  settings.technique_pictures = true;
  settings.least_splats = splats;
  const render::pinhole camera(host.view, settings.width, settings.height);
  render::bidirectional_tracer<Exec, decltype(accelerated.caster())> tracer(
      exec, settings, {geometry.view(), lights.view(), true}, accelerated.caster());
  for (std::uint32_t sample = 0; sample < 2; ++sample)
    tracer.render_sample(render::no_guide(), camera, sample, 1.0f);
  CHECK(tracer.dropped() == 0);
  return {tracer.film().picture(), tracer.technique_pictures()};
}

TEST_CASE("pictures do not depend on how many splats are added at a time", "[renderer][bidirectional]") {
  for (const render::technique_set& techniques : {render::technique_set(), render::light_tracing()}) {
    const auto rendered = [&](backend chosen, std::size_t splats) {
      const wfpg_test::backend_choice choice(chosen);
      return with_splats_at_a_time<wfpg_test::one_policy>(splats, techniques, 12);
    };
    const auto many = rendered(backend::seq, 100000), few = rendered(backend::seq, 1);
    CHECK(few.first == rendered(backend::omp, 1).first);
    CHECK(few.first == rendered(backend::tbb, 1).first);
    double light = 0.0;
    for (std::size_t i = 0; i < few.first.size(); ++i) {
      CHECK(glm::length(few.first[i] - many.first[i]) <= 1e-5f * glm::length(many.first[i]));
      light += wfpg::luminance(few.first[i]);
    }
    CHECK(light > 0.0);
    REQUIRE(few.second.size() == many.second.size());
    for (std::size_t k = 0; k < few.second.size(); ++k)
      for (std::size_t i = 0; i < few.first.size(); ++i)
        CHECK(glm::length(few.second[k].plain[i] - many.second[k].plain[i]) <=
              1e-5f * glm::length(many.second[k].plain[i]));
  }
}

TEST_CASE("paths of one segment see lights alone", "[renderer][bidirectional]") {
  const render::scene scene = render::make_builtin_scene("cornell-box");
  render::render_options options;
  options.width = options.height = 16;
  options.spp = 1;
  options.max_depth = 1;
  options.method = sampling_method::pt;
  const std::vector<vec3> expected = render::render(scene, options, {}).picture.pixels;
  for (const sampling_method method : {sampling_method::bpt, sampling_method::vcm, sampling_method::lt}) {
    options.method = method;
    CHECK(render::render(scene, options, {}).picture.pixels == expected);
  }
}

TEST_CASE("each allocation of points, beams and paths may fail", "[renderer][bidirectional]") {
  using policy = wfpg_test::one_policy;
  wfpg_test::failing_resource resource;
  const policy exec = policy().with_resource(&resource);
  const render::scene host = render::make_builtin_scene("fog-spot");
  const render::device_scene<policy> geometry(policy(), host);
  const render::light_distribution<policy> lights(policy(), host);
  const render::embree_scene accelerated(policy(), host, geometry.view());
  render::tracer_settings settings;
  settings.width = settings.height = 8;
  settings.techniques = render::points_beams_and_paths();
  settings.light.volume_radius = settings.light.surface_radius = 0.05f;
  settings.technique_pictures = true;
  const render::pinhole camera(host.view, settings.width, settings.height);
  const std::size_t failures = wfpg_test::fail_at_each(resource, [&] {
    render::bidirectional_tracer<policy, decltype(accelerated.caster())> tracer(
        exec, settings, {geometry.view(), lights.view(), true}, accelerated.caster());
    for (std::uint32_t sample = 0; sample < 2; ++sample)
      tracer.render_sample(render::no_guide(), camera, sample, 1.0f);
  });
  CHECK(failures > 60);
  CHECK(resource.live() == 0);
}

TEST_CASE("names of techniques are read and written", "[renderer][bidirectional]") {
  CHECK(render::names_of(render::technique_set()) == "hits+nee+connect+splat");
  CHECK(render::names_of(render::connection_and_merging()) == "hits+nee+connect+splat+surf");
  CHECK(render::names_of(render::techniques_of("splat+nee")) == "nee+splat");
  CHECK(render::names_of(render::points_beams_and_paths()) == "hits+nee+connect+splat+surf+pp3d+pb2d+bb1d");
  CHECK(render::names_of(render::light_tracing()) == "splat");
  CHECK(render::names_of(render::techniques_of("bpt")) == "hits+nee+connect+splat");
  for (const char* wrong : {"", "hit", "nee,splat", "nee+", "+nee"})
    CHECK_THROWS_AS(render::techniques_of(wrong), std::invalid_argument);
}
