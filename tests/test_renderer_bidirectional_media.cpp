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
#include <utility>
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
  options.where = device::seq;          // waves are too small to share
  options.light.beam_paths = 1u << 20;  // all of them
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

/// A set of techniques, the radius of its merges in media, and how many pictures make its mean precise.
struct measured_set {
  const char* techniques;
  float volume_radius;
  int seeds;
};

/// Sets that find all light, and have noise without end nowhere. Light samples and splats alone have it
/// where they are near a vertex in a medium. Radii are so small that walls, beyond which are no photons,
/// darken merges by less than 0.2%.
constexpr measured_set all_sets[] = {{"hits", 0.01f, 100},
                                     {"hits+nee", 0.01f, 24},
                                     {"hits+nee+connect", 0.01f, 52},
                                     {"hits+splat", 0.01f, 26},
                                     {"bpt", 0.01f, 64},
                                     {"hits+nee+pp3d", 0.015f, 24},
                                     {"hits+nee+pb2d", 0.01f, 24},
                                     {"hits+nee+bb1d", 0.003f, 24},
                                     {"hits+pp3d+bb1d", 0.003f, 24},
                                     {"bpt+surf+pp3d+pb2d+bb1d", 0.003f, 48}};

sample_mean radiance_of_furnace(const measured_set& set, bool solids, int seeds) {
  // A photon merges at several pixels. Pictures of few pixels find as much with less work.
  render_options options = with(set.techniques, 8, 16, 200);
  options.light.volume_radius = set.volume_radius;
  options.light.beam_paths = 48;  // of 64
  scene s = white_furnace(solids);
  s.view.vertical_fov = 2.0f;  // sees many photons
  return mean_over_seeds(s, options, 1, seeds, [](const image& p) { return mean_of(p.pixels); });
}

/// Means of each set's pictures are those of path tracing, and would show a bias of 1%.
void check_against_path_tracing(const std::vector<measured_set>& sets) {
  scene s = foggy_box();
  s.view.vertical_fov = 2.2f;  // sees many photons
  const auto mean_with = [&](const measured_set& set, std::uint64_t first_seed) {
    render_options options = with(set.techniques, 8, 16, 12);
    options.light.volume_radius = set.volume_radius;
    return mean_over_seeds(s, options, first_seed, set.seeds,
                           [](const image& p) { return mean_of(p.pixels); });
  };
  // Path tracing costs least and serves all sets, so its mean is the most precise.
  const sample_mean expected = mean_with({"", 0.01f, 800}, 1000);
  for (const measured_set& set : sets) {
    const sample_mean found = mean_with(set, 1);
    const double error = std::hypot(found.error(), expected.error());
    INFO(set.techniques << ": " << found.mean() << ", expected " << expected.mean() << ", +- " << error);
    CHECK(std::fabs(found.mean() - expected.mean()) < 4.0 * error);
    CHECK(std::fabs(1.01 * found.mean() - expected.mean()) > 4.0 * error);
  }
}

}  // namespace

TEST_CASE("both ends: light that fog scatters once is an integral",
          "[renderer][bidirectional][media][thorough]") {
  // Light paths alone have no variance where fog is near the camera, so there is none.
  const scene fog = make_builtin_scene("fog-lamp");
  const vec3 eye(0.0f, 0.4f, 3.0f);
  const wfpg::bounds3 clear{eye - 1.0f, eye + vec3(1.0f, 1.2f, 1.1f)};
  scene_builder b("fog-lamp");
  b.box({0.5f * (clear.lower + clear.upper), clear.upper - clear.lower}, b.add(solid(1.0f, vec3(0.0f))));
  b.look(eye, eye + vec3(0.9f, -0.1f, -1.0f), 0.8f);  // the lamp is beside the picture
  scene s = b.finish(2);
  s.fog = {4.0f * fog.fog.absorption, 4.0f * fog.fog.scattering, fog.fog.g};
  s.punctual_lights = fog.punctual_lights;
  punctual_light& lamp = s.punctual_lights[0];  // shines where the camera looks
  lamp.kind = punctual_kind::spot;
  lamp.direction = glm::normalize(vec3(1.0f, 0.1f, 0.6f));
  lamp.cos_inner = 0.9f;
  lamp.cos_outer = 0.8f;
  constexpr int places = 16;
  const pinhole camera(s.view, places, places);
  double expected = 0.0;
  for (std::uint32_t place = 0; place < places * places; ++place) {
    scene one = s;
    one.view.forward = camera.through(place, vec2(0.5f)).direction;
    expected += airlight(one, 1, clear) / (places * places);
  }
  const measured_set sets[] = {{"nee", 0.01f, 32}, {"splat", 0.01f, 48}, {"bpt", 0.01f, 24},
                               {"pb2d", 0.1f, 48}, {"bb1d", 0.03f, 24},  {"bpt+pp3d+pb2d+bb1d", 0.05f, 15}};
  for (const measured_set& set : sets) {
    INFO(set.techniques);
    render_options options = with(set.techniques, 16, 160, 2);
    options.light.volume_radius = set.volume_radius;
    options.light.beam_paths = 150;  // of 256
    options.light.beam_point_paths = 224;
    const sample_mean found =
        mean_over_seeds(s, options, 1, set.seeds, [](const image& p) { return mean_of_channel(p, 1); });
    CHECK(has_mean(found, expected));
  }
}

TEST_CASE("both ends: merges in media blur by their radius, with a bias that falls as its square",
          "[renderer][bidirectional][media][thorough]") {
  scene s = make_builtin_scene("fog-lamp");
  look_along(s, {1.0f, 0.0f, 1.5f}, {0.0f, 0.0f, -1.0f});
  s.fog = {vec3(0.2f), vec3(0.8f), -0.4f};
  const double exact = airlight(s, 1), scene_radius = double(glm::length(s.view.position));
  const std::pair<const char*, wfpg::merge_technique> techniques[] = {
      {"pp3d", wfpg::merge_technique::volume_points},
      {"pb2d", wfpg::merge_technique::beam_points},
      {"bb1d", wfpg::merge_technique::beams}};
  for (const auto& [name, merges] : techniques) {
    // Without noise, where the bias is small.
    const double at_tenth = merged_airlight(s, 1, merges, 0.1) - exact;
    CHECK((merged_airlight(s, 1, merges, 0.05) - exact) / at_tenth == Approx(0.25).epsilon(0.05));

    std::vector<double> over_square;
    for (const double radius : {0.8, 0.4, 0.1}) {
      const bool is_precise = merges == wfpg::merge_technique::volume_points && radius == 0.8;
      render_options options = with(name, 4, is_precise ? 6000 : radius == 0.4 ? 3000 : 1000, 2);
      options.light.radius_alpha = 1.0f;
      options.light.volume_radius = static_cast<float>(radius / scene_radius);
      const sample_mean found =
          mean_over_seeds(s, options, 1, 24, [](const image& p) { return mean_of_channel(p, 1); });
      const double expected = merged_airlight(s, 1, merges, radius), error = found.error();
      INFO(name << " at " << radius << ": " << found.mean() << " +- " << error << ", expected " << expected
                << ", without bias " << exact);
      if (is_precise)  // the others find a mean above
        CHECK(has_mean(found, expected));
      else
        CHECK(std::fabs(found.mean() - expected) < 4.0 * error);
      if (radius > 0.1)
        CHECK(found.mean() - exact > 5.0 * error);
      else
        CHECK(std::fabs(found.mean() - exact) < 4.0 * error);
      over_square.push_back((found.mean() - exact) / (radius * radius));
    }
    // Light is so curved there that the square alone would not do. A bias that fell as the radius would have
    // half that ratio, one that fell as its cube twice.
    CHECK(over_square[0] / over_square[1] == Approx(1.3).margin(0.4));
  }
}

TEST_CASE("both ends: photons of another medium do not merge", "[renderer][bidirectional][media]") {
  // A view in thin fog, just above a dense block. Half the disc of merges is in the block.
  scene_builder b("fog above a block");
  material dense = solid(1.0f, vec3(0.0f));
  dense.scattering = vec3(10.0f);
  b.box({{0.0f, -1.02f, 0.0f}, vec3(2.0f)}, b.add(dense));
  scene s = b.finish(2);
  s.fog = {vec3(0.02f), vec3(0.3f), 0.0f};
  s.punctual_lights.emplace_back();
  s.punctual_lights[0].position = {0.0f, 1.0f, 0.0f};
  s.punctual_lights[0].intensity = vec3(10.0f);
  look_along(s, {0.0f, 0.0f, 3.0f}, {0.0f, 0.0f, -1.0f});
  const double all = airlight(s, 1);
  for (const char* techniques : {"pp3d", "pb2d"}) {
    render_options options = with(techniques, 8, 1000, 2);
    options.light.volume_radius = 0.1f;
    options.light.radius_alpha = 1.0f;
    const double found = channel_of(picture_of(s, options), 1).mean();
    INFO(techniques << ": " << found << " of " << all);
    CHECK(found > 0.6 * all);
    CHECK(found < 0.9 * all);
  }
}

TEST_CASE("both ends: beams have least noise at small radii and points at large ones",
          "[renderer][bidirectional][media]") {
  // A dense block, ten mean free paths from its middle to its sides. Source: Krivanek et al. 2014.
  // Measured over bb1d at 0.1, 0.5 and 2.5 mean free paths: pb2d 4.7, 1.3 and 0.35, pp3d 26, 2.0 and 0.13.
  constexpr float per_length = 10.0f;
  scene_builder b("dense block");
  material dense = solid(1.0f, vec3(0.1f * per_length));
  dense.scattering = vec3(0.9f * per_length);
  b.box({vec3(0.0f), vec3(2.0f)}, b.add(dense));
  b.look({0.0f, 0.0f, 3.0f}, vec3(0.0f), 0.7f);
  scene s = b.finish(6);
  s.punctual_lights.emplace_back();
  punctual_light& lamp = s.punctual_lights[0];
  lamp.kind = punctual_kind::spot;
  lamp.position = {0.0f, 2.0f, 2.0f};
  lamp.direction = glm::normalize(-lamp.position);
  lamp.intensity = vec3(10.0f);
  lamp.cos_inner = 0.9f;
  lamp.cos_outer = 0.8f;
  const auto variance = [&](const char* techniques, float radius_over_path) {
    render_options options = with(techniques, 12, 1, 6);
    options.light.radius_alpha = 1.0f;
    options.light.volume_radius = radius_over_path / per_length / std::sqrt(3.0f);
    std::vector<sample_mean> pixels(12 * 12);
    for (options.seed = 1; options.seed <= 200; ++options.seed) {
      const image picture = picture_of(s, options);
      for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].add(double(picture.pixels[i].y));
    }
    double sum = 0.0;
    for (const sample_mean& pixel : pixels) sum += pixel.error() * pixel.error();
    return sum;
  };
  // Over the variance of beams alone.
  struct noise {
    double pb2d, pp3d;
  };
  const auto noise_at = [&](float radius_over_path) {
    const double bb1d = variance("bb1d", radius_over_path);
    return noise{variance("pb2d", radius_over_path) / bb1d, variance("pp3d", radius_over_path) / bb1d};
  };
  const noise at_small = noise_at(0.1f), at_middle = noise_at(0.5f), at_large = noise_at(2.5f);
  CHECK(at_small.pb2d > 2.0);
  CHECK(at_small.pp3d > 2.0 * at_small.pb2d);
  for (const double ratio : {at_middle.pb2d, at_middle.pp3d}) {
    CHECK(ratio > 1.0 / 3.0);
    CHECK(ratio < 3.0);
  }
  CHECK(at_large.pb2d < 0.5);
  CHECK(at_large.pp3d < 0.5 * at_large.pb2d);
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
          "[renderer][bidirectional][media][thorough]") {
  for (const measured_set& set : all_sets) {
    // Sets that are dear among solids have another case there.
    const std::string name = set.techniques;
    const bool solids =
        name != "hits" && name != "hits+nee+connect" && name.find("pp3d+") == std::string::npos;
    INFO(name << ", solids " << solids);
    CHECK(has_mean(radiance_of_furnace(set, solids, set.seeds), 2.0));
  }
}

// Takes long.
TEST_CASE("both ends: radiance in an emitting box is right within 0.2%", "[.long][bidirectional][media]") {
  for (const bool solids : {false, true})
    for (const measured_set& set : all_sets)
      DYNAMIC_SECTION(set.techniques << (solids ? " with" : " without") << " solids") {
        const sample_mean found = radiance_of_furnace(set, solids, 40 * set.seeds);
        INFO(found.mean() << " +- " << found.error());
        CHECK(found.error() < 0.001);
        CHECK(found.mean() == Approx(2.0).epsilon(0.002));
      }
}

TEST_CASE("both ends: all techniques together have the light of path tracing through media",
          "[renderer][bidirectional][media]") {
  check_against_path_tracing({{"bpt+surf+pp3d+pb2d+bb1d", 0.01f, 150}});
}

TEST_CASE("both ends: each set of techniques has the light of path tracing through media",
          "[renderer][bidirectional][media][thorough]") {
  check_against_path_tracing({{"hits+nee", 0.01f, 130}, {"bpt", 0.01f, 150}, {"hits+nee+pb2d", 0.02f, 140}});
}

TEST_CASE("both ends: pictures of media are the same on every policy", "[renderer][bidirectional][media]") {
  render_options options = with("bpt", 32, 2, 12);
  options.method = sampling_method::upbp;
  options.techniques.reset();
  options.light.surface_radius = options.light.volume_radius = 0.03f;
  check_same_on_policies(foggy_box(), options);
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
    return mean_over_seeds(s, with(techniques, 32, 30, 2), first_seed, 12,
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
  INFO(all.connections << " connections, " << all.merges << " merges, " << all.delta_vertices
                       << " delta vertices, " << all.medium_vertices << " in media");
  CHECK(all.connections > 5000);
  CHECK(all.delta_vertices > 100);
  CHECK(all.medium_vertices > 5000);
  CHECK(all.merges > 5000);
  CHECK(all.worst < 1e-4);
  CHECK(all.worst_merged < 1e-4);
}
