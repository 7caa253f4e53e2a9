// Paths from both ends in media: each set of techniques has the light that integrals, Chandrasekhar's H
// functions, energy and path tracing through media say. Each mean is precise enough that a planted bias of 1%
// shows.
#include "app/option_names.hpp"
#include "scene/camera.hpp"
#include "support/media.hpp"
#include "support/pictures.hpp"
#include "support/whole_paths.hpp"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using wfpg_test::has_mean;

render_options with(const std::string& techniques, int side, int spp, int max_depth) {
  render_options options;
  options.method = techniques.empty() ? sampling_method::vpt : sampling_method::bpt;
  if (!techniques.empty()) options.techniques = techniques_of(techniques);
  options.width = options.height = side;
  options.spp = spp;
  options.max_depth = max_depth;
  return options;
}

/// The mean of pictures with independent seeds: light paths reach several pixels of one.
template <class Value>
sample_mean mean_over_seeds(const scene& s, render_options options, std::uint64_t first_seed, int seeds,
                            const Value& value) {
  sample_mean mean;
  for (int i = 0; i < seeds; ++i) {
    options.seed = first_seed + static_cast<std::uint64_t>(i);
    mean.add(value(picture_of(s, options)));
  }
  return mean;
}

double mean_of_channel(const image& picture, int channel) {
  return channel_of(picture, channel).mean();
}

/// Sets that find all light, and have noise without end nowhere. Light samples and splats alone have it
/// where they are near a vertex in a medium.
constexpr const char* all_techniques[] = {
    "hits",          "hits+nee",      "hits+nee+connect", "hits+splat",     "bpt",
    "hits+nee+pp3d", "hits+nee+pb2d", "hits+nee+bb1d",    "hits+pp3d+bb1d", "bpt+surf+pp3d+pb2d+bb1d"};

sample_mean radiance_of_furnace(const std::string& techniques, bool solids, int seeds) {
  return mean_over_seeds(white_furnace(solids), with(techniques, 32, solids ? 12 : 8, 400), 1, seeds,
                         [](const image& p) { return mean_of(p.pixels); });
}

}  // namespace

TEST_CASE("both ends: light that fog scatters once is an integral", "[renderer][bidirectional][media]") {
  // Light paths alone have no variance where fog is near the camera, so there is none.
  const scene fog = make_builtin_scene("fog-lamp");
  const vec3 eye(0.0f, 0.4f, 3.0f);
  const wfpg::bounds3 clear{eye - 1.0f, eye + vec3(1.0f, 1.2f, 1.1f)};
  scene_builder b("fog-lamp");
  b.box({0.5f * (clear.lower + clear.upper), clear.upper - clear.lower}, b.add(solid(1.0f, vec3(0.0f))));
  b.look(eye, eye + vec3(0.9f, -0.1f, -1.0f), 0.8f);  // the lamp is beside the picture
  scene s = b.finish(2);
  s.fog = fog.fog;
  s.punctual_lights = fog.punctual_lights;
  punctual_light& lamp = s.punctual_lights[0];  // shines where the camera looks
  lamp.kind = punctual_kind::spot;
  lamp.direction = glm::normalize(vec3(1.0f, 0.1f, 0.6f));
  lamp.cos_inner = 0.85f;
  lamp.cos_outer = 0.65f;
  constexpr int places = 16;
  const pinhole camera(s.view, places, places);
  double expected = 0.0;
  for (std::uint32_t place = 0; place < places * places; ++place) {
    scene one = s;
    one.view.forward = camera.through(place, vec2(0.5f)).direction;
    expected += airlight(one, 1, clear) / (places * places);
  }
  for (const std::string techniques : {"nee", "splat", "bpt", "pb2d", "bb1d", "bpt+pp3d+pb2d+bb1d"}) {
    INFO(techniques);
    const int spp = techniques == "splat" ? 350 : 120;
    render_options options = with(techniques, 32, spp, 2);
    options.light.volume_radius = techniques == "pb2d" ? 0.03f : 0.01f;
    const sample_mean found =
        mean_over_seeds(s, options, 1, 16, [](const image& p) { return mean_of_channel(p, 1); });
    CHECK(has_mean(found, expected));
  }
}

TEST_CASE("both ends: a half-space reflects what Chandrasekhar's H functions say",
          "[renderer][bidirectional][media]") {
  scene s = make_builtin_scene("slab");
  const float mu = 0.6f;
  const vec3 up(std::sqrt(1.0f - mu * mu), mu, 0.0f);
  look_along(s, 10.0f * up, -up);
  const image picture = picture_of(s, with("bpt", 192, 6, 200));
  const auto albedo = double(s.materials.at(0).scattering.y);
  CHECK(has_mean(channel_of(picture, 1), 1.0 - std::sqrt(1.0 - albedo) * h_function(albedo)(double(mu))));
}

TEST_CASE("both ends: an emitting box of matter that absorbs nothing has one radiance",
          "[renderer][bidirectional][media]") {
  for (const bool solids : {false, true})
    for (const std::string techniques : all_techniques) {
      INFO(techniques << ", solids " << solids);
      CHECK(has_mean(radiance_of_furnace(techniques, solids, 12), 2.0));
    }
}

// Forty minutes on one core.
TEST_CASE("both ends: radiance in an emitting box is right within 0.2%", "[.long][bidirectional][media]") {
  for (const bool solids : {false, true})
    for (const std::string techniques : all_techniques) {
      const sample_mean found = radiance_of_furnace(techniques, solids, 400);
      INFO(techniques << ", solids " << solids << ": " << found.mean() << " +- " << found.error());
      CHECK(found.error() < 0.001);
      CHECK(found.mean() == Approx(2.0).epsilon(0.002));
    }
}

TEST_CASE("both ends: each set of techniques has the light of path tracing through media",
          "[renderer][bidirectional][media]") {
  const scene s = foggy_box();
  const auto mean_with = [&](const char* techniques, int spp, std::uint64_t first_seed) {
    return mean_over_seeds(s, with(techniques, 32, spp, 12), first_seed, 16,
                           [](const image& p) { return mean_of(p.pixels); });
  };
  const sample_mean expected = mean_with("", 48, 1000);
  for (const char* techniques : all_techniques) {
    const sample_mean found = mean_with(techniques, techniques == all_techniques[0] ? 48 : 16, 1);
    const double error = std::hypot(found.error(), expected.error());
    INFO(techniques << ": " << found.mean() << ", expected " << expected.mean() << ", +- " << error);
    CHECK(std::fabs(found.mean() - expected.mean()) < 4.0 * error);
    CHECK(std::fabs(1.01 * found.mean() - expected.mean()) > 4.0 * error);
  }
}

TEST_CASE("both ends: pictures of media are the same on every policy", "[renderer][bidirectional][media]") {
  render_options options = with("bpt", 32, 2, 12);
  options.method = sampling_method::upbp;
  options.techniques.reset();
  options.light.merge_radius = options.light.volume_radius = 0.03f;
  options.where = device::seq;
  const scene s = foggy_box();
  const std::vector<vec3> serial = picture_of(s, options).pixels;
  CHECK(mean_of(serial) > 0.0);
  for (const device where : {device::omp, device::cpu}) {
    options.where = where;
    CHECK(same_bits(picture_of(s, options).pixels, serial));
  }
}

TEST_CASE("both ends: light paths begin in the solids around their lights",
          "[renderer][bidirectional][media]") {
  // A lamp in two solids that overlap, and whose boundaries bend nothing. What light paths splat is what
  // light samples find.
  scene_builder b("lamp in solids");
  material outer = solid(1.0f, {0.5f, 0.2f, 0.1f}), inner = solid(1.0f, {0.1f, 0.4f, 0.8f}, 1);
  b.box({vec3(0.0f), vec3(1.6f)}, b.add(outer));
  b.box({{0.2f, 0.1f, 0.0f}, vec3(0.8f)}, b.add(inner));
  const auto white = b.diffuse(vec3(0.5f));
  b.parallelogram({-3.0f, -3.0f, -1.5f}, {6.0f, 0.0f, 0.0f}, {0.0f, 6.0f, 0.0f}, {{0.0f, 0.0f, 1.0f}, white});
  b.parallelogram({0.1f, 0.1f, 0.1f}, {0.0f, 0.2f, 0.0f}, {0.2f, 0.0f, 0.0f},
                  {{0.0f, 0.0f, -1.0f}, b.lamp(vec3(20.0f))});
  b.look({0.0f, 0.0f, 3.0f}, {0.0f, 0.0f, -1.5f}, 0.8f);
  scene s = b.finish(2);
  s.punctual_lights.emplace_back();
  s.punctual_lights[0].position = {-0.1f, 0.1f, 0.2f};
  s.punctual_lights[0].intensity = vec3(4.0f);
  s.punctual_lights[0].kind = punctual_kind::spot;
  s.punctual_lights[0].direction = {0.0f, 0.0f, -1.0f};
  s.punctual_lights[0].cos_inner = 0.9f;
  s.punctual_lights[0].cos_outer = 0.7f;
  const auto mean_with = [&](const char* techniques, std::uint64_t first_seed) {
    return mean_over_seeds(s, with(techniques, 32, 80, 2), first_seed, 12,
                           [](const image& p) { return mean_of(p.pixels); });
  };
  const sample_mean by_splats = mean_with("splat", 1), by_samples = mean_with("nee", 100);
  const double error = std::hypot(by_splats.error(), by_samples.error());
  INFO(by_splats.mean() << " by splats, " << by_samples.mean() << " by light samples, +- " << error);
  CHECK(std::fabs(by_splats.mean() - by_samples.mean()) < 4.0 * error);
  CHECK(std::fabs(1.01 * by_splats.mean() - by_samples.mean()) > 4.0 * error);
}

TEST_CASE("both ends: weights in media are those of the densities of the renderer's own paths",
          "[renderer][bidirectional][media]") {
  // A block of another medium, through which rays go straight, in a fog.
  const wfpg::bounds3 block{{-0.5f, -0.6f, -0.4f}, {0.4f, 0.3f, 0.5f}};
  scene_builder b = emitting_box("block in fog");
  material cloudy = solid(1.0f, {0.4f, 0.2f, 0.1f});
  cloudy.scattering = {2.0f, 1.0f, 0.5f};
  cloudy.g = 0.3f;
  b.box({0.5f * (block.lower + block.upper), block.upper - block.lower}, b.add(cloudy));
  b.sphere({0.6f, 0.6f, -0.5f}, 0.3f, 12, b.add(solid(1.5f, vec3(0.0f), 1)));
  scene s = b.finish(6);
  s.fog = {{0.1f, 0.2f, 0.4f}, {0.4f, 0.7f, 1.0f}, -0.4f};
  wfpg_test::test_world in(s);

  using glm::dvec3;
  const dvec3 in_block(cloudy.absorption + cloudy.scattering), in_fog(s.fog.extinction());
  const auto density = [](const dvec3& extinction, double length, bool ends_inside) {
    const dvec3 left = glm::exp(-extinction * length), all = ends_inside ? left * extinction : left;
    return (all.x + all.y + all.z) / 3.0;
  };
  in.distance_pdf = [&](vec3 from, vec3 to, bool ends_inside) {
    const auto length = double(glm::length(to - from)), inside = length_inside(block, from, to);
    if (inside == 0.0) return density(in_fog, length, ends_inside);
    const dvec3 way = dvec3(to - from) / length;
    const auto is_inside = [&](const dvec3& p) {
      return length_inside(block, p - 1e-6 * way, p + 1e-6 * way) > 1e-6;
    };
    const bool begins = is_inside(dvec3(from)), ends = is_inside(dvec3(to));
    // Up to the block, by bisection.
    double first = 0.0;
    if (!begins)
      for (double step = 0.5 * length; step > 1e-12; step *= 0.5)
        if (length_inside(block, from, dvec3(from) + (first + step) * way) == 0.0) first += step;
    const double last = length - first - inside;
    double pdf = begins ? 1.0 : density(in_fog, first, false);
    pdf *= density(in_block, inside, ends && ends_inside);
    return ends ? pdf : pdf * density(in_fog, last, ends_inside);
  };
  wfpg_test::compared_weights all;
  compare_weights(in, 2000, all);
  INFO(all.connections << " connections, " << all.delta_vertices << " delta vertices, " << all.medium_vertices
                       << " in media");
  CHECK(all.connections > 5000);
  CHECK(all.delta_vertices > 100);
  CHECK(all.medium_vertices > 5000);
  CHECK(all.worst < 1e-4);
}
