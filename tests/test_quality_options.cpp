// The command line of wfpg-quality: presets, scenes, methods, and refused arguments.
#include "progress.hpp"
#include "runs.hpp"
#include "settings.hpp"
#include "support/catch.hpp"
#include "support/measurements.hpp"
#include "support/renderer_io.hpp"

#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace render_test;

/// The message for invalid arguments.
std::string refused(const strings& arguments) {
  try {
    parsed(arguments);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

}  // namespace

TEST_CASE("options: presets apply where no option is given", "[quality]") {
  const quality::settings quick = parsed({"--preset", "quick"});
  CHECK(quick.scenes.size() == 6);
  CHECK(quick.methods.size() == 3);
  CHECK(quick.scenes[0].options.width == 104);
  CHECK_FALSE(quick.scenes[0].options.nee);
  CHECK(quick.scenes[1].options.nee);
  const quality::settings own =
      parsed({"--preset", "quick", "--size", "32x16", "--spp", "1,4", "--seconds", "0.5", "--scenes", "ajar",
              "ajar --nee off --max-depth 3 --roulette-depth 2", "--seeds", "7"});
  CHECK(own.seeds == 7);
  CHECK(own.scenes[1].options.height == 16);
  CHECK(own.scenes[1].options.max_depth == 3);
  CHECK((own.scenes[0].options.roulette_depth == 3 && own.scenes[1].options.roulette_depth == 2));
  CHECK(own.scenes[1].title == "ajar --nee off --max-depth 3 --roulette-depth 2");
  REQUIRE(own.budgets.size() == 3);
  CHECK(quality::title_of(own.budgets[0]) == "1 sample");
  CHECK(quality::title_of(own.budgets[2]) == "0.5 s");
  const quality::settings paper = parsed({"--preset", "paper"});
  const render::render_options options = quality::options_of(paper.scenes[0], paper.methods[1]);
  CHECK(options.binning.min_level == 5);
  CHECK(options.binning.rays_per_bin == 512);
  CHECK(options.octree_resolution == 128);
  CHECK(options.field_resolution == 128);
  CHECK(options.lifetime == render::fields::transient);
  CHECK(options.combine == wfpg::sample_combination::pt_first);
  CHECK(options.nee);
}

TEST_CASE("options: methods are known names, own names, or wfpg-render's options", "[quality]") {
  const quality::settings given = parsed({"--methods", "pt,small,wfpg-transient-plain", "--method",
                                          "small=--method wfpg --slot-resolution 16 --nee off --device seq",
                                          "--method", "more=--recast 4"});
  REQUIRE(given.methods.size() == 4);
  CHECK(given.methods[1].name == "small");
  CHECK(given.methods[3].name == "more");
  const render::render_options small = quality::options_of(given.scenes[1], given.methods[1]);
  CHECK(small.kept.resolution == 16);
  CHECK_FALSE(small.nee);
  CHECK(small.where == render::device::seq);
  CHECK(quality::options_of(given.scenes[0], given.methods[2]).mode == render::guiding::plain);
  // If no others are named, path tracing is added.
  const quality::settings own = parsed({"--method", "more=--recast 4"});
  REQUIRE(own.methods.size() == 2);
  CHECK(own.methods[0].name == "pt");
}

TEST_CASE("options: invalid arguments are named", "[quality]") {
  CHECK(contains(refused({"--preset", "best"}), "best"));
  CHECK(contains(refused({"--spp", "0"}), "0"));
  CHECK(contains(refused({"--seconds", "-1"}), "seconds"));
  CHECK(contains(refused({"--seeds", "0"}), "seeds"));
  CHECK(contains(refused({"--reference-spp", "1"}), "reference-spp"));
  CHECK(contains(refused({"--per-sample", "1"}), "per-sample"));
  CHECK(contains(refused({"--device", "abacus"}), "abacus"));
  CHECK(contains(refused({"--size", "12"}), "WIDTHxHEIGHT"));
  CHECK(contains(refused({"--crop", "1,2,3"}), "--crop"));
  CHECK(contains(refused({"--crop", "1,2,3x0"}), "--crop"));
  CHECK(contains(refused({"--exposure", "0"}), "exposure"));
  CHECK(contains(refused({"--methods", "best"}), "best"));
  CHECK(contains(refused({"--method", "without-equals"}), "NAME=OPTIONS"));
  CHECK(contains(refused({"--method", "=--method pt"}), "NAME=OPTIONS"));
  CHECK(contains(refused({"--method", "a b=--method pt"}), "NAME=OPTIONS"));
  CHECK(contains(refused({"--method", "a=--method best"}), "method a"));
  CHECK(contains(refused({"--method", "a=--spp 3"}), "--spp"));
  CHECK(contains(refused({"--method", "a=--method pt --seed 1000000"}), "--seed"));
  CHECK(contains(refused({"--method", "a=--product-resolution 8"}), "wfpg-product"));
  CHECK(contains(refused({"--method", "a=--method pt --cones trace"}), "wfpg-product"));
  CHECK(contains(refused({"--method", "a=--method wfpg --records-level 3"}), "--method records"));
  CHECK(contains(refused({"--method", "a=--method records --sarsa-step 3"}), "--method sarsa"));
  CHECK(contains(refused({"--methods", "pt", "pt"}), "two methods"));
  CHECK(contains(refused({"--scenes", "ajar --spp 3"}), "--spp"));
  CHECK(contains(refused({"--scenes", "ajar", "ajar"}), "two scenes"));
  CHECK(contains(refused({"--scene", "ajar"}), "--scene"));
  std::ostringstream out;
  CHECK_FALSE(quality::parse_settings({"--help"}, out).has_value());
  for (const char* const option :
       {"--preset", "--scenes", "--methods", "--method", "--spp", "--seconds", "--seeds", "--size",
        "--reference-spp", "--nee", "--device", "--per-sample", "--cache"})
    CHECK(contains(out.str(), option));
}

TEST_CASE("options: values out of range are refused by a line that names the range", "[quality]") {
  struct refusal {
    strings arguments;
    std::string message;
  };
  const std::string seeds = "a whole number from 1 to 1000000", spp = "a whole number from 1 to 1073741824";
  for (const refusal& one : std::vector<refusal>{
           {{"--seeds", "1000001"}, "--seeds: expected " + seeds + ", not 1000001"},
           {{"--seeds", "-1"}, "--seeds: expected " + seeds + ", not -1"},
           {{"--seeds", "2.5"}, "--seeds: expected " + seeds + ", not 2.5"},
           {{"--spp", "4,0"}, "--spp: expected " + spp + ", not 0"},
           {{"--spp", "0x10"}, "--spp: expected " + spp + ", not 0x10"},
           {{"--seconds", "1,0"}, "--seconds: expected a number above 0, up to 1e+09, not 0"},
           {{"--seconds", "nan"}, "--seconds: expected a number above 0, up to 1e+09, not nan"},
           {{"--exposure", "nan"}, "--exposure: expected a number above 0, up to 1e+30, not nan"},
           {{"--per-sample", "1"}, "--per-sample: expected a whole number from 2 to 1048576, not 1"},
           {{"--reference-spp", "1"}, "--reference-spp: expected a whole number from 2 to 1073741824, not 1"},
           {{"--reference-chunk", "0"}, "--reference-chunk: expected " + spp + ", not 0"},
           {{"--reference-chunk", "1", "--reference-spp", "4000000"},
            "--reference-chunk: expected at least 2 for --reference-spp 4000000, not 1"},
           {{"--cache", ""}, "--cache: expected a path, not nothing"},
           {{"--crop", "-1,2,3x4"},
            "--crop is -1,2,3x4, expected LEFT,TOP,WIDTHxHEIGHT within the picture, such as 16,32,64x64"},
           {{"--spp", "4,8,04"}, "two budgets are 4 samples"},
           {{"--seeds", "10", "--method", "a=--method pt --seed 999995"},
            "method a: --seed and --seeds are more than 1000000 together"},
           {{"--method", "a=--method pt --seed -1"},
            "method a \"--method pt --seed -1\": --seed: expected a whole number from 0 to 999999, not -1"},
           {{"--method", "a=--method wfpg --field-budget -5M"},
            "method a \"--method wfpg --field-budget -5M\": --field-budget: expected bytes from 0 to 1TiB, "
            "such "
            "as 24MiB, not -5M"},
           {{"--method", "a=--fields transient --recast 4"},
            "method a \"--fields transient --recast 4\": --recast requires --fields kept"}})
    CHECK(refused(one.arguments) == one.message);
  CHECK(parsed({"--seeds", "010", "--spp", "010"}).budgets[0].spp == 10);
  CHECK(parsed({"--reference-chunk", "2", "--reference-spp", "4000000"}).reference_chunk == 2);
  CHECK(parsed({"--seeds", "5", "--method", "a=--method pt --seed 999995"}).seeds == 5);
  // A method with light groups may be measured in a scene without next-event estimation too.
  CHECK(parsed({"--scenes", "ajar", "cornell-box --nee off", "--method", "a=--light-groups 4"}).seeds == 3);
}

TEST_CASE("options: a method may have its own number of seeds", "[quality]") {
  const quality::settings given =
      parsed({"--scenes", "ajar", "--method", "pt=--method pt", "--method", "other=--method pt --seed 1000"});
  const auto seed = [&](std::size_t method, int number) {
    return quality::plan_run(given.scenes[0], "ajar", given.methods[method], {4, 0.0}, number, "reference")
        .options.seed;
  };
  CHECK(seed(0, 1) == 1);
  CHECK(seed(0, 7) == 7);
  CHECK(seed(1, 1) == 1001);
  CHECK(seed(1, 7) == 1007);
}

TEST_CASE("options: scenes may be files", "[quality]") {
  temporary_folder folder;
  const std::string spaced = folder.write("a room --nee off.glb", "");
  const quality::settings given = parsed({"--scenes", "a/b/room.glb --nee off", "c/hall.gltf", spaced});
  CHECK(given.scenes[0].source == "a/b/room.glb");
  CHECK(given.scenes[0].title == "room.glb --nee off");
  CHECK_FALSE(given.scenes[0].options.nee);
  CHECK(given.scenes[1].title == "hall.gltf");
  CHECK(given.scenes[2].source == spaced);
  CHECK(given.scenes[2].title == "a room --nee off.glb");
  CHECK(given.scenes[2].options.nee);
}

TEST_CASE("options: names of files and titles of times are readable", "[quality]") {
  CHECK(quality::file_name_of("ajar --nee off") == "ajar-nee-off");
  CHECK(quality::file_name_of("a/b: c*") == "a-b-c-");
  CHECK(quality::title_of_seconds(3.2) == "4 s");
  CHECK(quality::title_of_seconds(600.0) == "10 min");
  CHECK(quality::title_of_seconds(9000.0) == "2.5 h");
}
