// --method vpt: media, and solids that overlap. Pictures are compared with integrals, with Chandrasekhar's H
// functions, and with what conserves energy. Each mean is precise enough that a planted bias of 1% shows.
#include "app/option_names.hpp"
#include "app/render.hpp"
#include "scene/builtin_scenes.hpp"
#include "scene/scene_builder.hpp"
#include "support/catch.hpp"
#include "support/command_lines.hpp"
#include "support/media.hpp"
#include "support/pictures.hpp"
#include "support/policies.hpp"
#include "support/renderings.hpp"
#include "support/sample_means.hpp"
#include "support/temporary_folder.hpp"
#include "support/tiny_gltf.hpp"
#include "tracer/volume_tracer.hpp"

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace render;
using namespace render_test;
using wfpg::testing::sample_mean;
using wfpg_test::has_mean;
using wfpg_test::one_policy;

render_options volume_options(int side, int spp, int max_depth) {
  render_options options;
  options.method = sampling_method::vpt;
  options.width = options.height = side;
  options.spp = spp;
  options.max_depth = max_depth;
  return options;
}

/// An emitting wall behind two overlapping blocks of absorbing matter with the index of air. All radiance is
/// what they leave.
scene two_blocks(int first_priority, int second_priority) {
  scene_builder b("two-blocks");
  b.parallelogram({-9.0f, -9.0f, -9.0f}, {18.0f, 0.0f, 0.0f}, {0.0f, 18.0f, 0.0f},
                  {{0.0f, 0.0f, 1.0f}, b.lamp(vec3(1.0f))});
  const auto first = b.add(solid(1.0f, {0.2f, 0.0f, 0.1f}, first_priority)),
             second = b.add(solid(1.0f, {0.0f, 0.3f, 0.4f}, second_priority));
  b.box({{0.0f, 0.0f, 1.0f}, vec3(4.0f)}, first);    // z from 3 to -1
  b.box({{0.0f, 0.0f, -1.5f}, vec3(5.0f)}, second);  // z from 1 to -4, so that 2 of it are both
  scene s = b.finish(1);
  look_along(s, {0.3f, 0.2f, 8.0f}, {0.0f, 0.0f, -1.0f});
  return s;
}

void check_colour(vec3 found, vec3 expected) {
  INFO(found.x << ' ' << found.y << ' ' << found.z << ", expected " << expected.x << ' ' << expected.y << ' '
               << expected.z);
  for (int c = 0; c < 3; ++c) CHECK(found[c] == Approx(expected[c]).epsilon(2e-4));
}

/// Answers of a caster in an empty scene.
struct empty_caster {
  WFPG_HD triangle_hit intersect(const wfpg::ray&) const { return {}; }
  WFPG_HD bool occluded(const wfpg::ray&) const { return false; }
};

}  // namespace

TEST_CASE("media: light that fog scatters once is an integral", "[renderer][media]") {
  scene s = make_builtin_scene("fog-lamp");
  for (const vec3 direction : {vec3(0.2f, -0.05f, -1.0f), vec3(1.0f, 0.0f, 0.2f)}) {
    look_along(s, s.view.position, direction);
    const image picture = picture_of(s, volume_options(256, 16, 2));
    for (int c = 0; c < 3; ++c) {
      INFO("channel " << c << " along " << direction.x << ' ' << direction.y << ' ' << direction.z);
      CHECK(has_mean(channel_of(picture, c), airlight(s, c)));
    }
  }
}

TEST_CASE("media: a half-space reflects what Chandrasekhar's H functions say", "[renderer][media]") {
  scene s = make_builtin_scene("slab");
  for (const float mu : {1.0f, 0.4f}) {
    look_along(s, 10.0f * vec3(std::sqrt(1.0f - mu * mu), mu, 0.0f),
               -vec3(std::sqrt(1.0f - mu * mu), mu, 0.0f));
    const image picture = picture_of(s, volume_options(256, 6, 256));
    for (int c = 0; c < 3; ++c) {
      const auto albedo = double(s.materials.at(0).scattering[c]);
      const double expected = 1.0 - std::sqrt(1.0 - albedo) * h_function(albedo)(double(mu));
      const sample_mean found = channel_of(picture, c);
      INFO("albedo " << albedo << ", cosine " << mu);
      CHECK(has_mean(found, expected));
      CHECK(found.mean() == Approx(expected).epsilon(0.005));
    }
  }
}

TEST_CASE("media: the mean number of collisions in endless fog is 1/(1 - albedo)", "[renderer][media]") {
  const one_policy exec;
  constexpr std::size_t count = 60000;
  for (const float albedo : {0.3f, 0.8f, 0.95f}) {
    volume_position at{{{7, 0}, 0, 1000}};
    path_lights world;
    world.next_event = false;
    world.scene.fog = {vec3(2.0f * (1.0f - albedo)), vec3(2.0f * albedo), 0.5f};
    tiled_array<volume_path, one_policy> paths(exec, count);
    tiled_array<path_vertex, one_policy> vertices(exec, count);
    wfpg::buffer<std::uint32_t, one_policy> keys(exec, count), counts(exec, count);
    wfpg::buffer<vec3, one_policy> radiance(exec, count);
    wfpg::partitioner<one_policy> partitioner(exec, count);
    for (std::size_t i = 0; i < count; ++i) paths.view().emplace(i, wfpg::ray(), solid_stack());
    // A collision counts as much as the path's light before it, so that roulette changes no mean.
    std::vector<double> collisions(count, 0.0);
    path_queue queue{{}, true};
    for (; at.depth < 200; ++at.depth) {
      exec.for_each(count, find_volume_vertices<empty_caster>{at,
                                                              world,
                                                              {},
                                                              queue,
                                                              paths.view(),
                                                              vertices.view(),
                                                              keys.view(),
                                                              radiance.view(),
                                                              counts.view(),
                                                              counts.view(),
                                                              partitioner.excluded});
      for (std::size_t i = 0; i < count; ++i)
        if (keys.view()[i] == medium_key) collisions[i] += double(paths.view()[i].throughput.y / albedo);
      queue = {partitioner.partition(exec, keys.view(), material_key_bits), false};
      exec.for_each(
          count, scatter_volume_paths{at, world.scene, queue, paths.view(), vertices.view(), keys.view(), 3});
    }
    sample_mean mean;
    for (const double of_path : collisions) mean.add(of_path);
    INFO("albedo " << albedo);
    CHECK(has_mean(mean, 1.0 / (1.0 - double(albedo))));
  }
}

TEST_CASE("media: an emitting box of matter that absorbs nothing has one radiance", "[renderer][media]") {
  for (const bool nee : {false, true})
    for (const bool solids : {false, true}) {
      const scene s = white_furnace(solids);
      render_options options = volume_options(64, solids ? 48 : 16, 1024);
      options.nee = nee;
      const image picture = picture_of(s, options);
      sample_mean mean;
      for (const vec3& pixel : picture.pixels) mean.add(double(wfpg::luminance(pixel)));
      INFO("next-event estimation " << nee << ", solids " << solids);
      CHECK(has_mean(mean, 2.0));
      CHECK(mean.mean() == Approx(2.0).epsilon(0.002));
    }
}

TEST_CASE("media: next-event estimation changes the noise, not the mean", "[renderer][media]") {
  const scene s = foggy_box();
  sample_mean means[2];
  for (const bool nee : {false, true})
    for (std::uint64_t seed = 0; seed < 16; ++seed) {
      render_options options = volume_options(32, nee ? 24 : 48, 12);
      options.nee = nee;
      options.seed = 2 * seed + (nee ? 1 : 0);
      means[nee ? 1 : 0].add(mean_of(picture_of(s, options).pixels));
    }
  const double error = std::hypot(means[0].error(), means[1].error());
  INFO(means[0].mean() << " without, " << means[1].mean() << " with it, +- " << error);
  CHECK(std::fabs(means[0].mean() - means[1].mean()) < 4.0 * error);
  CHECK(std::fabs(1.01 * means[0].mean() - means[1].mean()) > 4.0 * error);
}

TEST_CASE("media: without them vpt has the pictures of pt", "[renderer][media]") {
  wfpg_test::check_rendering({"materials", true, sampling_method::vpt});
  wfpg_test::check_rendering({"cornell-box with a map", true, sampling_method::vpt});
  wfpg_test::check_rendering({"caustic-pool", false, sampling_method::vpt});  // its camera is in the water
}

TEST_CASE("media: pictures are the same on every policy", "[renderer][media]") {
  check_same_on_policies(foggy_box(), volume_options(40, 3, 20));
}

TEST_CASE("media: a rendering goes on from its state to the same bits", "[renderer][media]") {
  const temporary_folder folder;
  const scene s = foggy_box();
  render_options options = volume_options(24, 5, 12);
  const std::vector<vec3> whole = picture_of(s, options).pixels;
  options.spp = 2;
  options.keep_state = true;
  const render_result part = render::render(s, options, {});
  CHECK_FALSE(same_bits(part.picture.pixels, whole));
  options.resume = folder.write("state", part.state);
  options.spp = 5;
  CHECK(same_bits(picture_of(s, options).pixels, whole));
}

TEST_CASE("media: where solids overlap, the one of larger priority is there", "[renderer][media]") {
  const vec3 first(0.2f, 0.0f, 0.1f), second(0.0f, 0.3f, 0.4f);
  const render_options options = volume_options(4, 1, 1);
  check_colour(picture_of(two_blocks(1, 0), options).pixels[5], glm::exp(-4.0f * first - 3.0f * second));
  check_colour(picture_of(two_blocks(0, 1), options).pixels[5], glm::exp(-2.0f * first - 5.0f * second));
  // Of equal ones it is the one that the ray entered last. A ray the other way enters the other one last.
  scene equal = two_blocks(3, 3);
  check_colour(picture_of(equal, options).pixels[5], glm::exp(-2.0f * first - 5.0f * second));
  // The camera may be in both.
  scene inside = two_blocks(1, 0);
  look_along(inside, {0.3f, 0.2f, 0.5f}, {0.0f, 0.0f, -1.0f});
  check_colour(picture_of(inside, options).pixels[5], glm::exp(-1.5f * first - 3.0f * second));
  // Solids keep the fog out.
  inside.fog.absorption = vec3(0.1f, 0.2f, 0.3f);
  check_colour(picture_of(inside, options).pixels[5],
               glm::exp(-1.5f * first - 3.0f * second - 5.0f * inside.fog.absorption));
}

TEST_CASE("media: shadow rays pass boundaries of equal index, and no glass", "[renderer][media]") {
  // The wall that emits in two_blocks() reflects here, and a lamp shines on it through both blocks.
  const auto lit = [](float ior) {
    scene s = two_blocks(1, 0);
    s.materials[0] = material();
    s.punctual_lights.emplace_back();
    s.punctual_lights[0].position = {0.3f, 0.2f, 7.0f};
    s.materials[1].ior = ior;
    look_along(s, {0.3f, 0.2f, -6.0f}, {0.0f, 0.0f, -1.0f});
    return s;
  };
  const render_options options = volume_options(4, 1, 2);
  const vec3 first(0.2f, 0.0f, 0.1f), second(0.0f, 0.3f, 0.4f);
  const vec3 unhindered = vec3(0.8f) / (wfpg::pi * 16.0f * 16.0f);
  check_colour(picture_of(lit(1.0f), options).pixels[5],
               unhindered * glm::exp(-4.0f * first - 3.0f * second));
  CHECK(picture_of(lit(1.5f), options).pixels[5] == vec3(0.0f));
}

TEST_CASE("media: light from infinitely far does not shine through fog", "[renderer][media]") {
  scene s = two_blocks(0, 0);
  s.materials[0] = material();
  s.environment = vec3(1.0f);
  s.punctual_lights.emplace_back();
  s.punctual_lights[0].kind = punctual_kind::directional;
  look_along(s, {0.3f, 0.2f, -6.0f}, {0.0f, 0.0f, -1.0f});
  const render_options options = volume_options(16, 4, 3);
  CHECK(mean_of(picture_of(s, options).pixels) > 0.1);
  s.fog.scattering = vec3(0.0f, 0.5f, 0.5f);
  for (const vec3& pixel : picture_of(s, options).pixels) {
    CHECK(pixel.y == 0.0f);
    CHECK(pixel.z == 0.0f);
  }
  // The fog lets red light pass.
  CHECK(channel_of(picture_of(s, options), 0).mean() > 0.1);
}

TEST_CASE("media: boundaries have the index of what is on both sides", "[renderer][media]") {
  scene s;
  s.materials = {solid(1.5f, vec3(0.0f), 2), solid(1.3f, vec3(0.1f), 1), solid(1.0f, vec3(0.2f), 0)};
  const std::uint32_t glass = 0, water = 1, smoke = 2;
  scene_view view;
  view.materials = {s.materials.data(), s.materials.size()};
  const solid_boundary into_water(view, {}, water, true);
  CHECK((into_water.exists && into_water.ior == 1.3f));
  const solid_boundary into_glass(view, into_water.beyond, glass, true);
  CHECK((into_glass.exists && into_glass.ior == 1.5f / 1.3f));
  CHECK(into_glass.beyond.top(view) == glass);
  const solid_boundary hidden(view, into_glass.beyond, smoke, true);
  CHECK_FALSE(hidden.exists);
  CHECK(hidden.beyond.top(view) == glass);
  const solid_boundary out_of_water(view, hidden.beyond, water, false);
  CHECK_FALSE(out_of_water.exists);
  const solid_boundary out_of_glass(view, out_of_water.beyond, glass, false);
  CHECK((out_of_glass.exists && out_of_glass.ior == 1.5f));
  CHECK(out_of_glass.beyond.top(view) == smoke);
  CHECK_FALSE(out_of_glass.is_matched(s.materials[glass]));
  CHECK(solid_boundary(view, out_of_glass.beyond, smoke, false).is_matched(s.materials[smoke]));
  // Whoever leaves what he never entered stays where he is.
  const solid_boundary odd(view, out_of_glass.beyond, water, false);
  CHECK((odd.exists && odd.beyond.top(view) == smoke));
}

TEST_CASE("media: a full stack of solids forgets the one of least priority", "[renderer][media]") {
  scene s;
  for (int i = 0; i < 6; ++i) s.materials.push_back(solid(1.0f, vec3(0.1f * float(i)), i == 0 ? 5 : i));
  scene_view view;
  view.materials = {s.materials.data(), s.materials.size()};
  solid_stack stack;
  for (std::uint32_t i = 0; i < 5; ++i) stack.enter(view, i);
  CHECK(stack.top(view) == 0);
  CHECK_FALSE(stack.leave(view, 1));
  for (const std::uint32_t kept : {0u, 4u, 2u, 3u}) CHECK(stack.leave(view, kept));
  CHECK(stack.top(view) == solid_stack::none);
}

TEST_CASE("media: methods of surfaces alone refuse them and name others", "[renderer][media]") {
  const auto refusal = [](const scene& s, sampling_method method) -> std::string {
    render_options options = volume_options(8, 1, 2);
    options.method = method;
    try {
      render::render(s, options, {});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing";
  };
  scene absorbing = foggy_box();
  absorbing.fog = {};
  for (material& m : absorbing.materials) m.scattering = vec3(0.0f);
  for (const method_properties& row : all_methods) {
    INFO(row.name);
    for (const char* name : {"fog-lamp", "slab", "fog-spot"}) {
      const std::string said = refusal(make_builtin_scene(name), row.method);
      if (row.has_media)
        CHECK(said == "nothing");
      else
        CHECK(contains(said, "expected vpt, bpt, vcm, upbp or lt for a scene with fog or scattering solids"));
    }
    if (!is_openpgl(row.method)) CHECK(refusal(absorbing, row.method) == "nothing");
  }
  scene broken = foggy_box();
  broken.fog.g = 1.0f;
  CHECK(contains(refusal(broken, sampling_method::vpt), "g of scene.fog is 1"));
  broken = foggy_box();
  broken.materials.back().scattering.y = -1.0f;
  CHECK(contains(refusal(broken, sampling_method::vpt), "a coefficient of scene.materials, element"));
}

TEST_CASE("media: a command line has fog, and a warning of lights that it hides", "[renderer][media]") {
  const temporary_folder folder;
  const auto log_of = [&](const std::string& name) {
    const std::string png = folder.file("a.png");
    const outcome done =
        run_render({name, "--method", "vpt", "--fog", "0.5", "--size", "8x8", "--spp", "1", "--png", png});
    CHECK(done.code == 0);
    return done.log;
  };
  CHECK(log_of("cornell-box").empty());
  CHECK(contains(log_of("outdoor"), "warning: the environment and directional lights do not shine through"));
}

TEST_CASE("media: glTF materials and scenes have them in extras", "[renderer][media][gltf]") {
  const std::string wax =
      R"([{"name": "wax", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
      "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                     "KHR_materials_volume": {"thicknessFactor": 1}}, "extras": {"medium": )";
  const auto materials = [&](const std::string& medium) {
    tiny_gltf tiny;
    return tiny.with("materials", wax + medium + "}}]");
  };
  const scene s = materials(R"({"scattering": [1, 2, 3], "g": -0.5, "priority": 3})").load();
  CHECK(s.materials[0].scattering == vec3(1.0f, 2.0f, 3.0f));
  CHECK(s.materials[0].g == -0.5f);
  CHECK(s.materials[0].priority == 3);
  CHECK(materials(R"({"scattering": 4})").load().materials[0].scattering == vec3(4.0f));
  const std::string place = "material 0 ('wax'), extras.medium";
  CHECK(materials("4").error() == place + " is no object");
  CHECK(materials(R"({"scatter": 4})").error() == place + " has the unknown member scatter");
  CHECK(materials(R"({"g": 1})").error() == place + ".g is 1, expected a number in [-0.999, 0.999]");
  CHECK(materials(R"({"priority": 0.5})").error() == place + ".priority is 0.5, expected a whole number");
  const std::string coefficients = "expected a number, or three, in [0, 1e+06]";
  CHECK(materials(R"({"scattering": [1, 2]})").error() ==
        place + ".scattering is a list of another length, " + coefficients);
  CHECK(materials(R"({"scattering": [1, 2, -3]})").error() == place + ".scattering is -3, " + coefficients);
  CHECK(materials(R"({"scattering": "x"})").error() == place + ".scattering is no number, " + coefficients);

  tiny_gltf foggy;
  const auto with_fog = [&](const std::string& fog) {
    return foggy.with("scenes", R"([{"nodes": [0], "extras": {"fog": )" + fog + "}}]");
  };
  const scene f = with_fog(R"({"absorption": 0.5, "scattering": [1, 0, 2], "g": 0.25})").load();
  CHECK(f.fog.absorption == vec3(0.5f));
  CHECK(f.fog.scattering == vec3(1.0f, 0.0f, 2.0f));
  CHECK(f.fog.g == 0.25f);
  CHECK(with_fog(R"({"absorption": -1})").error() == "extras.fog.absorption is -1, " + coefficients);
  CHECK(with_fog(R"({"priority": 1})").error() == "extras.fog has the unknown member priority");

  tiny_gltf opaque;
  const scene o = opaque.with("materials", R"([{"extras": {"medium": {"scattering": 1}}}])").load();
  CHECK(o.materials[0].scattering == vec3(0.0f));
  CHECK(o.warnings.at(0) == "extras.medium of materials that are no transmitting solids has no effect");
}
