// What command lines share: a scene with its environment, and what is warned of.
#include "builtin_scenes.hpp"
#include "image_io.hpp"
#include "render_arguments.hpp"
#include "support/catch.hpp"
#include "support/renderer_io.hpp"
#include "support/tiny_gltf.hpp"

#include <CLI/CLI.hpp>

#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace render_test;

/// What loading a scene logs.
std::string warnings_of(const render::scene_arguments& given, bool nee = true) {
  render::render_options options;
  options.nee = nee;
  std::ostringstream log;
  render::load_scene(given, options, "it", log);
  return log.str();
}

}  // namespace

TEST_CASE("a scene without light, or whose lights are lost, is warned of", "[renderer][arguments]") {
  CHECK(warnings_of({"ajar", ""}) == "");
  CHECK(warnings_of({"ajar", ""}, false) == "");

  const temporary_folder folder;
  tiny_gltf tiny;
  const std::string dark = warnings_of({folder.write("dark.gltf", tiny.json()), ""});
  CHECK(contains(dark, "it: warning: the file has no perspective camera"));
  CHECK(contains(dark, "it: warning: the scene has no light: the picture is black\n"));

  tiny.with("extensions", R"({"KHR_lights_punctual": {"lights": [{"type": "point"}]}})");
  tiny.with("nodes", R"([{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}])");
  const std::string lit = folder.write("lit.gltf", tiny.json());
  CHECK_FALSE(contains(warnings_of({lit, ""}), "light"));
  CHECK(contains(warnings_of({lit, ""}, false),
                 "it: warning: point, spot and directional lights are lost with --nee off\n"));
}

TEST_CASE("an environment that is named takes the place of the scene's", "[renderer][arguments]") {
  const temporary_folder folder;
  render::image sky = render::make_image(4, 2);
  for (vec3& texel : sky.pixels) texel = vec3(2.0f);
  render::write_exr(folder.file("sky.exr"), sky);
  const render::scene_arguments given{folder.write("dark.gltf", tiny_gltf().json()), folder.file("sky.exr")};
  std::ostringstream log;
  CHECK(render::load_scene(given, {}, "it", log).sky.width == 4);
  CHECK_FALSE(contains(log.str(), "no light"));
}

TEST_CASE("the vertex that roulette begins at is an option", "[renderer][arguments]") {
  const auto depth_of = [](const std::string& arguments) {
    render::render_options options;
    CLI::App app;
    render::add_picture_options(app, options);
    app.parse(arguments);
    return options.roulette_depth;
  };
  CHECK(depth_of("") == 3);
  CHECK(depth_of("--roulette-depth 8") == 8);
  CHECK_THROWS_AS(depth_of("--roulette-depth 0"), CLI::ValidationError);
}

TEST_CASE("the first vertices alone are guided where that is asked for", "[renderer][arguments]") {
  const auto parsed = [](const std::string& arguments) {
    render::render_options options;
    options.width = options.height = 16;
    options.spp = 4;
    CLI::App app;
    render::add_method_options(app, options);
    render::add_guider_options(app, options);
    app.parse(arguments);
    render::check_render_options(app, options);
    return options;
  };
  const auto fields_made = [&](const std::string& arguments, int max_depth = 8, bool nee = true) {
    const render::scene world = render::make_builtin_scene("cornell-box");
    render::render_options options = parsed(arguments);
    options.max_depth = max_depth;
    options.nee = nee;
    std::vector<bool> made;
    for (const render::bin_report& depth : render::render(world, options, {}).report.bins)
      made.push_back(depth.count > 0.0);
    made.resize(3);
    return made;
  };
  const std::string transient = "--method wfpg --fields transient";
  CHECK(fields_made(transient) == std::vector<bool>{true, true, true});
  CHECK(fields_made(transient, 4) == std::vector<bool>{true, true, false});  // the last finds emitters alone
  CHECK(fields_made(transient, 4, false) == std::vector<bool>{true, true, true});
  CHECK(fields_made(transient, 2) == std::vector<bool>{true, false, false});
  CHECK(fields_made(transient + " --guided-depths 1") == std::vector<bool>{true, false, false});
  CHECK(fields_made(transient + " --guided-depths 2") == std::vector<bool>{true, true, false});
  CHECK_THROWS_AS(parsed("--guided-depths 0"), CLI::ValidationError);
  for (const char* const method : {"pt", "openpgl-vmm"})
    CHECK_THROWS_AS(parsed(std::string("--guided-depths 1 --method ") + method), CLI::RequiresError);
}

TEST_CASE("options of fields are refused where there are none", "[renderer][arguments]") {
  const auto parse = [](const std::string& arguments) {
    render::render_options options;
    CLI::App app;
    render::add_method_options(app, options);
    render::add_guider_options(app, options);
    app.parse(arguments);
    render::check_render_options(app, options);
  };
  for (const char* const option :
       {"--guiding plain", "--fields kept", "--octree-resolution 64", "--field-resolution 16",
        "--slot-resolution 16", "--recast 4", "--learn off", "--light-groups 4", "--field-budget 1MiB",
        "--rays-per-bin 32", "--min-bin-level 2", "--deposits-per-leaf 0", "--cones march"})
    for (const char* const method : {"pt", "sarsa", "records", "openpgl-vmm"}) {
      INFO(option << ", " << method);
      CHECK_THROWS_AS(parse(option + std::string(" --method ") + method), CLI::RequiresError);
      CHECK_NOTHROW(parse(option + std::string(" --method wfpg")));
    }
}
