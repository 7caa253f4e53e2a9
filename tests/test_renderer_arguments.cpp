// Arguments that all programs share: a scene with its environment, and the warnings about it.
#include "app/image_io.hpp"
#include "app/render_arguments.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/catch.hpp"
#include "support/command_lines.hpp"
#include "support/renderer_io.hpp"
#include "support/tiny_gltf.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace render_test;

/// The warnings while a scene loads.
std::string warnings_of(const render::scene_arguments& given, bool nee = true) {
  render::render_options options;
  options.nee = nee;
  std::ostringstream log;
  render::load_scene(given, options, "it", log);
  return log.str();
}

/// The error of wfpg-render for options of a scene that does not exist. It has read no file.
std::string said_of(const std::string& options) {
  std::vector<std::string> words{"nowhere.glb", "--stats", "/nonexistent/stats"};
  std::istringstream text(options);
  for (std::string word; text >> word;) words.push_back(word == "''" ? "" : word);
  const outcome done = run_render(words);
  CHECK(done.code == 2);
  CHECK(done.out.empty());
  CHECK(std::count(done.log.begin(), done.log.end(), '\n') == 1);
  return done.log;
}

bool is_accepted(const std::string& options) {
  return contains(said_of(options), "--stats: /nonexistent/stats cannot be written");
}

render::render_options parsed_options(const std::string& options) {
  render::render_options parsed;
  CLI::App app;
  render::add_method_options(app, parsed);
  render::add_device_option(app, parsed);
  render::add_nee_option(app, parsed);
  render::add_budget_options(app, parsed);
  render::add_picture_options(app, parsed);
  render::add_guider_options(app, parsed);
  app.parse(options);
  render::check_render_options(app, parsed);
  return parsed;
}

}  // namespace

TEST_CASE("values out of range are refused by a line that names the range", "[renderer][arguments]") {
  const std::string size = "WIDTHxHEIGHT, such as 640x360, each from 1 to 32768 and 2^28 pixels at most",
                    bytes = "bytes from 0 to 1TiB, such as 24MiB",
                    count = "a whole number from 1 to 4294967295",
                    spp = "a whole number from 1 to 1073741824", fraction = "a number from 0 to 1",
                    seed = "a whole number from 0 to 18446744073709551615",
                    octree = "a power of two from 1 to 4096";
  struct refusal {
    std::string option, value, expected, method;
  };
  const std::vector<refusal> table = {
      {"--size", "100000x100000", size, "pt"},
      {"--size", "32769x1", size, "pt"},
      {"--size", "32768x32768", size, "pt"},
      {"--size", "0x8", size, "pt"},
      {"--size", "-8x8", size, "pt"},
      {"--size", "8x8x8", size, "pt"},
      {"--size", "99999999999x1", size, "pt"},
      {"--spp", "0", spp, "pt"},
      {"--spp", "-4", spp, "pt"},
      {"--spp", "4.5", spp, "pt"},
      {"--spp", "0x10", spp, "pt"},
      {"--spp", "99999999999999999999", spp, "pt"},
      {"--spp", "''", spp, "pt"},
      {"--seconds", "0", "a number above 0, up to 1e+09", "pt"},
      {"--seconds", "-1", "a number above 0, up to 1e+09", "pt"},
      {"--seconds", "nan", "a number above 0, up to 1e+09", "pt"},
      {"--seconds", "inf", "a number above 0, up to 1e+09", "pt"},
      {"--seconds", "0x1p3", "a number above 0, up to 1e+09", "pt"},
      {"--seed", "-1", seed, "pt"},
      {"--seed", "18446744073709551616", seed, "pt"},
      {"--seed", "1e3", seed, "pt"},
      {"--max-depth", "1025", "a whole number from 1 to 1024", "pt"},
      {"--roulette-depth", "0", spp, "pt"},
      {"--guide-fraction", "1.5", fraction, "wfpg"},
      {"--guide-fraction", "nan", fraction, "wfpg"},
      {"--guided-depths", "0", count, "wfpg"},
      {"--least-gain", "-1", "a number from 0 to 1e+06", "wfpg"},
      {"--octree-resolution", "100", octree, "wfpg"},
      {"--octree-resolution", "8192", octree, "wfpg"},
      {"--octree-resolution", "4294967424", octree, "wfpg"},
      {"--field-resolution", "1", "a whole number from 2 to 128", "wfpg --fields transient"},
      {"--slot-resolution", "129", "a whole number from 2 to 128", "wfpg"},
      {"--recast", "0", "a whole number from 1 to 1048576", "wfpg"},
      {"--light-groups", "256", "a whole number from 1 to 255", "wfpg"},
      {"--field-budget", "-1", bytes, "wfpg"},
      {"--field-budget", "-5M", bytes, "wfpg"},
      {"--field-budget", "5X", bytes, "wfpg"},
      {"--field-budget", "MiB", bytes, "wfpg"},
      {"--field-budget", "17592186044416M", bytes, "wfpg"},
      {"--caster-buffer", "-1", bytes, "wfpg --device optix"},
      {"--product-resolution", "-8", "a whole number from 4 to 16", "wfpg-product"},
      {"--rays-per-bin", "0", count, "wfpg"},
      {"--min-bin-level", "-1", "a whole number from 0 to 12", "wfpg"},
      {"--deposits-per-leaf", "-1", "a whole number from 0 to 4294967295", "wfpg"},
      {"--samples-per-leaf", "7", "a whole number from 8 to 1073741824", "openpgl-vmm"},
      {"--sarsa-resolution", "65", "a whole number from 1 to 64", "sarsa"},
      {"--sarsa-directions", "1", "a whole number from 2 to 64", "sarsa"},
      {"--sarsa-step", "0", count, "sarsa"},
      {"--sarsa-learning-rate", "nan", fraction, "sarsa"},
      {"--records-octree", "3", octree, "records"},
      {"--records-level", "13", "a whole number from 0 to 12", "records"},
      {"--records-rays", "0", "a whole number from 1 to 2147483648", "records"},
      {"--records-cones", "257", "a whole number from 1 to 256", "records"},
      {"--records-albedo", "2", fraction, "records"},
      {"--exposure", "0", "a number above 0, up to 1e+30", "pt --png /nonexistent/a.png"},
      {"--exposure", "nan", "a number above 0, up to 1e+30", "pt --png /nonexistent/a.png"},
      {"--reference", "''", "a path", "pt"},
      {"--resume", "''", "a path", "pt"},
      {"--output", "''", "a path", "pt"}};
  for (const refusal& one : table) {
    const std::string value = one.value == "''" ? "nothing" : one.value;
    CHECK(said_of(one.option + " " + one.value + " --method " + one.method) ==
          "wfpg-render: " + one.option + ": expected " + one.expected + ", not " + value +
              "; --help lists the options\n");
  }
  CHECK(contains(said_of("--product-resolution 5 --method wfpg-product"), "5 not in {4,8,16}"));
}

TEST_CASE("numbers are decimal, and range ends are accepted", "[renderer][arguments]") {
  CHECK(parsed_options("--spp 010").spp == 10);
  CHECK(parsed_options("--seed 010").seed == 10);
  CHECK(parsed_options("--seed 18446744073709551615").seed == std::numeric_limits<std::uint64_t>::max());
  CHECK(parsed_options("--product-resolution 016 --method wfpg-product").product_resolution == 16);
  CHECK(parsed_options("--size 010x32768").width == 10);
  CHECK(parsed_options("--guided-depths 4294967295").guided_depths == 4294967295u);
  CHECK(parsed_options("--seconds 1e-3").seconds == 0.001);
  for (const auto& [text, size] :
       std::vector<std::pair<std::string, std::size_t>>{{"0", 0},
                                                        {"010", 10},
                                                        {"7b", 7},
                                                        {"3k", 3072},
                                                        {"3KB", 3072},
                                                        {"5MiB", 5u << 20},
                                                        {"2g", 2u << 30},
                                                        {"1TiB", std::size_t(1) << 40}})
    CHECK(parsed_options("--field-budget " + text).kept.budget_bytes == size);
}

TEST_CASE("options without effect are refused by a line that says what they need", "[renderer][arguments]") {
  struct refusal {
    std::string options, option, need;
  };
  const std::string fields = "--method wfpg or wfpg-product";
  std::vector<refusal> table = {
      {"--fields transient --slot-resolution 16", "--slot-resolution", "--fields kept"},
      {"--fields transient --recast 4", "--recast", "--fields kept"},
      {"--fields transient --learn off", "--learn", "--fields kept"},
      {"--fields transient --field-budget 1M", "--field-budget", "--fields kept"},
      {"--field-resolution 16", "--field-resolution", "--fields transient"},
      {"--nee off --light-groups 4", "--light-groups", "--nee on"},
      {"--caster-buffer 1M", "--caster-buffer", "--device optix"},
      {"--caster-buffer 1M --device optix --cones march", "--caster-buffer", "--cones scene"},
      {"--caster-buffer 1M --device optix --method pt", "--caster-buffer", fields},
      {"--product-resolution 8", "--product-resolution", "--method wfpg-product"},
      {"--samples-per-leaf 100", "--samples-per-leaf", "--method openpgl-vmm or openpgl-dqt"},
      {"--guide-fraction 0.5 --method pt", "--guide-fraction", "a --method that guides"},
      {"--guided-depths 1 --method pt", "--guided-depths", "--method wfpg, wfpg-product, sarsa or records"},
      {"--sarsa-step 4", "--sarsa-step", "--method sarsa"},
      {"--records-cones 4", "--records-cones", "--method records"},
      {"--fog 0.1", "--fog", "--method vpt, bpt, vcm, upbp or lt"},
      {"--guide-fraction 0.5 --method vpt", "--guide-fraction", "a --method that guides"},
      {"--method vpt --device optix", "--method vpt", "a --device other than optix"},
      {"--method bpt --device optix", "--method bpt", "a --device other than optix"},
      {"--method lt --techniques nee", "--techniques", "--method bpt, vcm or upbp"},
      {"--method pt --light-memory 1M", "--light-memory", "--method bpt, vcm, upbp or lt"},
      {"--method bpt --radius 0.1", "--radius", "--method vcm or upbp, or surf among --techniques"},
      {"--method bpt --dense-photons 8", "--dense-photons",
       "--method vcm or upbp, or surf or pp3d among --techniques"},
      {"--method bpt --beam-paths 8", "--beam-paths", "--method upbp, or bb1d among --techniques"},
      {"--method bpt --techniques bpt+bb1d --beam-point-paths 8", "--beam-point-paths",
       "--method upbp, or pb2d among --techniques"},
      {"--exposure 2", "--exposure", "--png"},
      {"--method openpgl-vmm --device seq", "--method openpgl-vmm", "--device cpu"},
      {"--method records --device optix", "--method records", "a --device other than optix"}};
  for (const std::string method : {"pt", "sarsa", "records", "openpgl-vmm"})
    for (const std::string option : {"--save-guide", "--load-guide"})
      table.push_back({"--method " + method + " " + option + " file", option, fields});
  for (const std::string method : {"sarsa", "records", "openpgl-dqt"})
    for (const std::string option : {"--save-state", "--resume"})
      table.push_back({"--method " + method + " " + option + " file", option,
                       "--method pt, vpt, bpt, vcm, upbp, lt, wfpg or wfpg-product"});
  for (const refusal& one : table)
    CHECK(said_of(one.options) ==
          "wfpg-render: " + one.option + " requires " + one.need + "; --help lists the options\n");
  CHECK(contains(said_of("--spp 4 --seconds 1"), "excludes"));
  CHECK(contains(said_of("--load-guide a --resume b"), "excludes"));
  for (const std::string options :
       {"--fields transient --field-resolution 16 --guiding plain --light-groups 4",
        "--nee on --light-groups 4", "--fields kept --recast 4 --learn off --cones trace",
        "--method sarsa --guide-fraction 0.5 --sarsa-step 4", "--method pt --combine linear"})
    CHECK(is_accepted(options));
}

TEST_CASE("a scene without usable lights causes a warning", "[renderer][arguments]") {
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

TEST_CASE("a named environment replaces the scene's", "[renderer][arguments]") {
  const temporary_folder folder;
  render::image sky = render::make_image(4, 2);
  for (vec3& texel : sky.pixels) texel = vec3(2.0f);
  render::write_exr(folder.file("sky.exr"), sky);
  const render::scene_arguments given{folder.write("dark.gltf", tiny_gltf().json()), folder.file("sky.exr")};
  std::ostringstream log;
  CHECK(render::load_scene(given, {}, "it", log).sky.width == 4);
  CHECK_FALSE(contains(log.str(), "no light"));
}

TEST_CASE("--roulette-depth sets the vertex at which roulette begins", "[renderer][arguments]") {
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

TEST_CASE("--guided-depths limits guiding to the first vertices", "[renderer][arguments]") {
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
  CHECK(fields_made(transient, 4) ==
        std::vector<bool>{true, true, false});  // the last direction only finds emitters
  CHECK(fields_made(transient, 4, false) == std::vector<bool>{true, true, true});
  CHECK(fields_made(transient, 2) == std::vector<bool>{true, false, false});
  CHECK(fields_made(transient + " --guided-depths 1") == std::vector<bool>{true, false, false});
  CHECK(fields_made(transient + " --guided-depths 2") == std::vector<bool>{true, true, false});
  CHECK_THROWS_AS(parsed("--guided-depths 0"), CLI::ValidationError);
  for (const char* const method : {"pt", "openpgl-vmm"})
    CHECK_THROWS_AS(parsed(std::string("--guided-depths 1 --method ") + method), CLI::RequiresError);
}

TEST_CASE("options of fields are refused for methods without fields", "[renderer][arguments]") {
  const auto parse = [](const std::string& arguments) {
    render::render_options options;
    CLI::App app;
    render::add_method_options(app, options);
    render::add_guider_options(app, options);
    app.parse(arguments);
    render::check_render_options(app, options);
  };
  for (const char* const option :
       {"--guiding plain", "--fields kept", "--octree-resolution 64",
        "--fields transient --field-resolution 16", "--slot-resolution 16", "--recast 4", "--learn off",
        "--light-groups 4", "--field-budget 1MiB", "--rays-per-bin 32", "--min-bin-level 2",
        "--deposits-per-leaf 0", "--least-gain 0", "--cones march"})
    for (const char* const method : {"pt", "sarsa", "records", "openpgl-vmm"}) {
      INFO(option << ", " << method);
      CHECK_THROWS_AS(parse(option + std::string(" --method ") + method), CLI::RequiresError);
      CHECK_NOTHROW(parse(option + std::string(" --method wfpg")));
    }
}
