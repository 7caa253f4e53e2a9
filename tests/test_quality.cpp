// wfpg-quality: its options, its cache, its statistics and pictures; and whole runs on tiny pictures.
#include "builtin_scenes.hpp"
#include "cache.hpp"
#include "flip.hpp"
#include "pictures.hpp"
#include "program.hpp"
#include "progress.hpp"
#include "reference.hpp"
#include "runs.hpp"
#include "settings.hpp"
#include "single_samples.hpp"
#include "statistic.hpp"
#include "summary.hpp"
#include "support/catch.hpp"
#include "support/renderer_io.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using quality::json;
using render::image;
using strings = std::vector<std::string>;

constexpr double infinite = std::numeric_limits<double>::infinity();

quality::settings parsed(strings arguments) {
  arguments.insert(arguments.end(), {"--output", "out"});
  std::ostringstream out;
  return quality::parse_settings(arguments, out).value();
}

/// The message of arguments that cannot be right.
std::string refused(const strings& arguments) {
  try {
    parsed(arguments);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

/// Runs the program in a folder and says what it logged.
struct outcome {
  int code = 0;
  std::string out, log;
};

outcome run(strings arguments) {
  std::ostringstream out, log;
  const int code = quality::run_program(arguments, out, log);
  return {code, out.str(), log.str()};
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

/// A tiny measurement: a reference in two chunks a half, two methods, two seeds.
strings tiny(const temporary_folder& folder, const strings& more = {}, const std::string& size = "16x16",
             const std::string& scene = "cornell-box") {
  strings arguments{"--scenes",
                    scene,
                    "--size",
                    size,
                    "--spp",
                    "2",
                    "--seeds",
                    "2",
                    "--reference-spp",
                    "8",
                    "--reference-chunk",
                    "2",
                    "--method",
                    "small=--method wfpg --octree-resolution 16 --slot-resolution 8 --field-budget 1MiB",
                    "--cache",
                    folder.file("cache"),
                    "--output",
                    folder.file("out")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

json results_of(const temporary_folder& folder) {
  return json::parse(content_of(folder.file("out/results.json")));
}

/// Files of the cache whose names begin so.
std::vector<std::filesystem::path> cached(const temporary_folder& folder, const std::string& begin,
                                          const std::string& extension) {
  std::vector<std::filesystem::path> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file("cache")))
    if (entry.path().filename().string().rfind(begin, 0) == 0 && entry.path().extension() == extension)
      found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

TEST_CASE("options: presets hold where nothing is given", "[quality]") {
  const quality::settings quick = parsed({"--preset", "quick"});
  CHECK(quick.scenes.size() == 6);
  CHECK(quick.methods.size() == 3);
  CHECK(quick.scenes[0].options.width == 104);
  CHECK_FALSE(quick.scenes[0].options.nee);
  CHECK(quick.scenes[1].options.nee);
  const quality::settings own =
      parsed({"--preset", "quick", "--size", "32x16", "--spp", "1,4", "--seconds", "0.5", "--scenes", "ajar",
              "ajar --nee off --max-depth 3", "--seeds", "7"});
  CHECK(own.seeds == 7);
  CHECK(own.scenes[1].options.height == 16);
  CHECK(own.scenes[1].options.max_depth == 3);
  CHECK(own.scenes[1].title == "ajar --nee off --max-depth 3");
  REQUIRE(own.budgets.size() == 3);
  CHECK(quality::title_of(own.budgets[0]) == "1 sample");
  CHECK(quality::title_of(own.budgets[2]) == "0.5 s");
  const quality::settings paper = parsed({"--preset", "paper"});
  const render::render_options options = quality::options_of(paper.scenes[0], paper.methods[1]);
  CHECK(options.min_bin_level == 5);
  CHECK(options.rays_per_bin == 512);
  CHECK(options.octree_resolution == 128);
  CHECK(options.field_resolution == 128);
  CHECK(options.lifetime == render::fields::transient);
  CHECK(options.combine == wfpg::sample_combination::pt_first);
  CHECK(options.nee);
}

TEST_CASE("options: methods are known, one's own, or wfpg-render's", "[quality]") {
  const quality::settings given = parsed({"--methods", "pt,small,wfpg-transient-plain", "--method",
                                          "small=--method wfpg --slot-resolution 16 --nee off --device seq",
                                          "--method", "more=--recast 4"});
  REQUIRE(given.methods.size() == 4);
  CHECK(given.methods[1].name == "small");
  CHECK(given.methods[3].name == "more");
  const render::render_options small = quality::options_of(given.scenes[1], given.methods[1]);
  CHECK(small.slot_resolution == 16);
  CHECK_FALSE(small.nee);
  CHECK(small.where == render::device::seq);
  CHECK(quality::options_of(given.scenes[0], given.methods[2]).mode == render::guiding::plain);
  // Beside path tracing where no others are named.
  const quality::settings own = parsed({"--method", "more=--recast 4"});
  REQUIRE(own.methods.size() == 2);
  CHECK(own.methods[0].name == "pt");
}

TEST_CASE("options: what cannot be right is said", "[quality]") {
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
  CHECK(contains(refused({"--method", "a=--product-resolution 8"}), "wfpg-product"));
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

TEST_CASE("options: scenes in files", "[quality]") {
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

TEST_CASE("options: names of files", "[quality]") {
  CHECK(quality::file_name_of("ajar --nee off") == "ajar-nee-off");
  CHECK(quality::file_name_of("a/b: c*") == "a-b-c-");
  CHECK(quality::title_of_seconds(3.2) == "4 s");
  CHECK(quality::title_of_seconds(600.0) == "10 min");
  CHECK(quality::title_of_seconds(9000.0) == "2.5 h");
}

TEST_CASE("statistics of hand-made values", "[quality]") {
  const quality::statistic one = quality::statistic_of({3.0});
  CHECK(one.mean == 3.0);
  CHECK_FALSE(one.deviation.has_value());
  const quality::statistic three = quality::statistic_of({1.0, 2.0, 6.0});
  CHECK(three.mean == Approx(3.0));
  CHECK(three.deviation.value() == Approx(std::sqrt(7.0)));
  CHECK(three.standard_error.value() == Approx(std::sqrt(7.0 / 3.0)));
  // 10% and 20% beside one another are sqrt(5)% of ten.
  const quality::ratio gain = quality::ratio_of({8.0, 1.6, 0.8}, {2.0, 0.8, 0.4}).value();
  CHECK(gain.value == Approx(4.0));
  CHECK(gain.standard_error.value() == Approx(4.0 * std::sqrt(0.05)));
  CHECK_FALSE(quality::ratio_of(one, {1.0, {}, {}}).value().standard_error.has_value());
  CHECK_FALSE(quality::ratio_of(one, {-1.0, {}, {}}).has_value());
  CHECK_FALSE(quality::ratio_of({infinite, {}, {}}, one).has_value());
}

namespace {

quality::measured_run hand_made(std::size_t method, int seed, double error, double seconds) {
  quality::measured_run run;
  run.method = method;
  run.seed = seed;
  render::image_error e;
  e.mse_reinhard = error;
  e.smape = error;
  run.record.points = {{4, seconds, e}};
  run.record.cost.samples = 4;
  run.record.cost.seconds = seconds;
  return run;
}

}  // namespace

TEST_CASE("summaries: noise, gains and equal time by hand", "[quality]") {
  const quality::settings given = parsed({"--methods", "pt,wfpg", "--spp", "4", "--seeds", "2"});
  quality::reference_noise noise{{}, std::nullopt};
  noise.error.mse_reinhard = 1.0;
  noise.error.smape = 0.1;
  const json summary = quality::summary_of(given,
                                           {hand_made(0, 1, 40.0, 1.0), hand_made(0, 2, 42.0, 1.0),
                                            hand_made(1, 1, 5.0, 2.0), hand_made(1, 2, 7.0, 2.0)},
                                           noise);
  CHECK(summary[0]["budget"] == "4 samples");
  const json& pt = summary[0]["methods"][0]["errors"]["mse_reinhard"];
  const json& guided = summary[0]["methods"][1]["errors"]["mse_reinhard"];
  CHECK(pt["mean"].get<double>() == Approx(40.0));
  CHECK(pt["ratio"].get<double>() == Approx(1.0));
  CHECK_FALSE(pt["noise_is_large"].get<bool>());
  CHECK(guided["mean"].get<double>() == Approx(5.0));
  CHECK(guided["measured"].get<double>() == Approx(6.0));
  CHECK(guided["deviation"].get<double>() == Approx(std::sqrt(2.0)));
  CHECK(guided["standard_error"].get<double>() == Approx(1.0));
  CHECK(guided["ratio"].get<double>() == Approx(8.0));
  CHECK(guided["ratio_standard_error"].get<double>() == Approx(8.0 * std::hypot(1.0 / 40.0, 1.0 / 5.0)));
  CHECK(guided["equal_time_ratio"].get<double>() == Approx(4.0));
  CHECK(guided["noise_is_large"].get<bool>());
  const json& smape = summary[0]["methods"][1]["errors"]["smape"];
  CHECK(smape["mean"].get<double>() == Approx(6.0));
  CHECK_FALSE(smape.contains("equal_time_ratio"));
  // All that the reference's noise hides.
  noise.error.mse_reinhard = 6.5;
  const json hidden =
      quality::summary_of(given, {hand_made(0, 1, 40.0, 1.0), hand_made(1, 1, 6.0, 2.0)}, noise);
  CHECK(hidden[0]["methods"][1]["errors"]["mse_reinhard"]["mean"].is_null());
  CHECK(hidden[0]["methods"][1]["errors"]["mse_reinhard"]["ratio"].is_null());
  CHECK(hidden[0]["methods"][1]["errors"]["mse_reinhard"]["noise_is_large"].get<bool>());
}

TEST_CASE("records survive JSON, infinite errors too", "[quality]") {
  quality::run_record record;
  render::image_error error;
  error.mse = infinite;
  error.relmse_robust = 0.25;
  error.non_finite = 3;
  record.points = {{1, 0.5, {}}, {2, 1.5, error}};
  record.cost = {2, 1.5, 2.0, 12345678901u, 10, 8, 20, 0.75};
  const json object = quality::to_json(record);
  const quality::run_record back = quality::record_from_json(json::parse(object.dump()));
  CHECK(quality::to_json(back) == object);
  CHECK(std::isinf(back.points[1].error.mse));
  CHECK(back.cost.segments == 12345678901u);
  CHECK_THROWS_AS(quality::record_from_json(json::object()), json::exception);
}

TEST_CASE("pictures: the crop is where errors are greatest", "[quality]") {
  std::vector<double> errors(128 * 96, 0.0);
  errors[50 * 128 + 100] = infinite;
  errors[52 * 128 + 110] = 1.0;
  errors[3 * 128 + 3] = 1.5;
  const quality::window w = quality::worst_window(errors, 128, 96);
  CHECK((w.width == 32 && w.height == 24));
  CHECK((w.left <= 100 && w.left + w.width > 110 && w.top <= 50 && w.top + w.height > 52));
  const quality::window whole = quality::worst_window(std::vector<double>(12, 1.0), 4, 3);
  CHECK((whole.left == 0 && whole.top == 0 && whole.width == 4 && whole.height == 3));
}

TEST_CASE("pictures: exposure, error maps, frames", "[quality]") {
  image grey = render::make_image(10, 10);
  CHECK(quality::exposure_for(grey) == 1.0f);
  for (vec3& pixel : grey.pixels) pixel = vec3(4.0f);
  CHECK(quality::exposure_for(grey) == Approx(0.0625f));
  const image map = quality::error_map({0.0, 0.25, 1.0, infinite}, 4, 1, 1.0);
  check_close(map.pixels[0], vec3(0.0f));
  check_close(map.pixels[2], vec3(1.0f));
  check_close(map.pixels[3], vec3(1.0f));
  CHECK(map.pixels[1].x > map.pixels[1].z);
  CHECK(quality::shown_greatest({0.0, infinite}) == 1.0);
  CHECK(quality::shown_greatest({0.0, 3.0}) == 3.0);
  const image frame = quality::framed(grey, {2, 3, 4, 5}, 1.0f);
  CHECK(frame.pixels[3 * 10 + 2] != vec3(4.0f));
  CHECK(frame.pixels[7 * 10 + 5] != vec3(4.0f));
  CHECK(frame.pixels[4 * 10 + 3] == vec3(4.0f));
  CHECK(quality::enlarged_to(grey, 25).width == 30);
}

TEST_CASE("cache: what is stored is found, what is damaged is not", "[quality]") {
  temporary_folder folder;
  std::ostringstream log;
  const quality::run_cache cache(folder.file("cache"), log);
  const quality::run_key key{"a", {{"seed", 1}}}, other{"a", {{"seed", 2}}};
  const auto seconds = [](quality::cache_entry& entry) { return entry.result.at("seconds").get<double>(); };
  CHECK_FALSE(cache.find(key, seconds).has_value());
  image picture = render::make_image(2, 1);
  picture.pixels[1] = vec3(0.5f);
  cache.store(key, {{{"seconds", 2.5}}, picture});
  CHECK(cache.find(key, seconds) == std::optional<double>(2.5));
  CHECK_FALSE(cache.find(other, seconds).has_value());
  CHECK(cache.find(key, [](quality::cache_entry& e) { return e.picture->pixels; }).value() == picture.pixels);
  CHECK(log.str().empty());

  const std::string file = cached(folder, "a-", ".json").at(0).string();
  const std::string whole = content_of(file);
  for (const std::string& damaged :
       {std::string(), whole.substr(0, whole.size() / 2), std::string("{}"), std::string("[1]")}) {
    log.str("");
    folder.write("cache/" + std::filesystem::path(file).filename().string(), damaged);
    CHECK_FALSE(cache.find(key, seconds).has_value());
    CHECK(contains(log.str(), file));
  }
  cache.store(key, {{{"seconds", 3.5}}, picture});
  std::filesystem::remove(cache.picture_path(key));
  CHECK_FALSE(cache.find(key, seconds).has_value());
  CHECK(contains(log.str(), cache.picture_path(key).string()));
  CHECK_THROWS_AS(quality::run_cache("/proc/none", log), std::filesystem::filesystem_error);
}

TEST_CASE("references: halves in chunks, and all that tells them apart", "[quality]") {
  const quality::settings given =
      parsed({"--scenes", "ajar", "ajar --nee off", "--size", "16x16", "--max-depth", "4"});
  const quality::reference_plan plan = quality::plan_reference(given.scenes[0], "x", 11, 4);
  REQUIRE(plan.halves[0].size() == 2);
  CHECK(plan.halves[0][1].options.spp == 2);
  CHECK(plan.halves[0][0].options.method == render::sampling_method::pt);
  CHECK(plan.halves[1][1].options.spp == 1);
  CHECK(plan.halves[1][0].options.method == render::sampling_method::wfpg);
  CHECK(plan.halves[0][0].options.seed != plan.halves[0][1].options.seed);
  CHECK(plan.hash() == quality::plan_reference(given.scenes[0], "x", 11, 4).hash());
  CHECK(plan.hash() != quality::plan_reference(given.scenes[0], "y", 11, 4).hash());
  CHECK(plan.hash() != quality::plan_reference(given.scenes[0], "x", 12, 4).hash());
  CHECK(plan.hash() != quality::plan_reference(given.scenes[1], "x", 11, 4).hash());
  // A longer one begins with the same chunks.
  CHECK(plan.halves[0][0].key.hash() ==
        quality::plan_reference(given.scenes[0], "x", 64, 4).halves[0][0].key.hash());
}

TEST_CASE("scenes are told apart by what is in their files", "[quality]") {
  temporary_folder folder;
  const auto identity = [](const std::string& source) {
    return quality::identity_of({source, source, "", {}});
  };
  const std::string glb = folder.write("a.glb", "one");
  const std::string before = identity(glb);
  folder.write("a.glb", "two");
  CHECK(identity(glb) != before);
  CHECK(identity("ajar") == "built-in ajar");
  const std::string gltf =
      folder.write("a.gltf", R"({"buffers": [{"uri": "a%20b.bin"}, {"uri": "data:,x"}]})");
  CHECK_THROWS_AS(identity(gltf), std::runtime_error);
  folder.write("a b.bin", "one");
  const std::string one = identity(gltf);
  folder.write("a b.bin", "two");
  CHECK(identity(gltf) != one);
  CHECK_THROWS_AS(identity(folder.file("none.glb")), std::runtime_error);
}

TEST_CASE("progress: what is left, and how long from what the same took", "[quality]") {
  temporary_folder folder;
  std::ostringstream log;
  const quality::run_cache cache(folder.file("cache"), log);
  const auto planned = [](int seed, int spp, double seconds) {
    quality::planned_run run{{"a", {{"seed", seed}}}, "run " + std::to_string(seed), "rate", {}};
    run.options.width = run.options.height = 10;
    run.options.spp = spp;
    run.options.seconds = seconds;
    return run;
  };
  const std::vector<quality::planned_run> all{planned(1, 4, 0.0), planned(2, 8, 0.0), planned(3, 0, 7.0),
                                              planned(4, 1000, 0.0)};
  cache.store(all[3].key, {json::object(), std::nullopt});
  quality::run_progress progress(all, cache, log);
  progress.begin(all[0]);
  progress.done(all[0], 10.0);
  CHECK(contains(log.str(), "[1/4] run 1: 10.0 s; 3 left, about 27 s"));
  progress.begin(all[1]);
  progress.done(all[1], 20.0);
  CHECK(contains(log.str(), "2 left, about 7 s"));
  progress.begin(all[3]);
  progress.found(all[3]);
  CHECK(contains(log.str(), "run 4: in the cache"));
}

TEST_CASE("single samples add up to what the renderer combines itself", "[quality]") {
  const render::scene box = render::make_builtin_scene("cornell-box");
  render::render_options options;
  options.width = options.height = 8;
  options.octree_resolution = 16;
  options.slot_resolution = 8;
  options.spp = 6;
  render::render_options reference_options = options;
  reference_options.seed = 9;
  const image reference = render::render(box, reference_options, {}).picture;
  const quality::single_samples samples = quality::measure_single_samples(box, options, reference);
  REQUIRE(samples.alone.by_measure.at("mse_reinhard").size() == 6);
  REQUIRE(samples.combined.size() == 7);
  for (const auto& [name, combination] :
       {std::pair("quadratic", wfpg::sample_combination::quadratic),
        std::pair("pt-linear", wfpg::sample_combination::pt_linear),
        std::pair("discard-first", wfpg::sample_combination::discard_first)}) {
    INFO(name);
    options.combine = combination;
    const render::image_error error = render::compare(render::render(box, options, {}).picture, reference);
    CHECK(samples.combined.at(name).by_measure.at("mse_reinhard").back() ==
          Approx(error.mse_reinhard).epsilon(1e-3));
  }
  CHECK(std::isinf(samples.combined.at("discard-first").by_measure.at("smape").front()));
  CHECK(samples.combined.at("constant").by_measure.at("smape").front() ==
        samples.alone.by_measure.at("smape").front());
  const json object = quality::to_json(samples);
  CHECK(quality::to_json(quality::single_samples_from_json(json::parse(object.dump()))).dump() ==
        object.dump());
  options.method = render::sampling_method::pt;
  options.combine.reset();
  CHECK(quality::measure_single_samples(box, options, reference).combined.empty());

  quality::single_samples one, two;
  one.alone.by_measure["smape"] = {1.0, 2.0};
  two.alone.by_measure["smape"] = {3.0, 6.0};
  CHECK(quality::mean_of({one, two}).alone.by_measure.at("smape") == std::vector<double>{2.0, 4.0});
}

TEST_CASE("a whole run, and one after it that renders nothing", "[quality]") {
  temporary_folder folder;
  const outcome first = run(tiny(folder, {"--per-sample", "3"}));
  INFO(first.log);
  REQUIRE(first.code == 0);
  CHECK(count_of(first.log, "in the cache") == 0);
  CHECK(count_of(first.log, "] cornell-box, ") == 12);
  const json results = results_of(folder);
  const json& scene = results["scenes"][0];
  CHECK(results["command"].get<std::string>().rfind("wfpg-quality --scenes", 0) == 0);
  CHECK(scene["runs"].size() == 4);
  CHECK(scene["runs"][0]["points"].size() == 2);
  CHECK(scene["summary"][0]["methods"][1]["method"] == "small");
  CHECK(scene["summary"][0]["methods"][1]["persistent_bytes"].get<double>() > 0.0);
  CHECK(scene["summary"][0]["methods"][0]["persistent_bytes"].get<double>() == 0.0);
  CHECK(scene["single_samples"]["small"]["combined"].size() == 7);
  CHECK(scene["reference"]["noise"]["mse_reinhard"].get<double>() > 0.0);
  const std::string markdown = content_of(folder.file("out/results.md"));
  CHECK(contains(markdown, "| small | 2 |"));
  CHECK(contains(markdown, "| small | pt-linear |"));
  CHECK(scene["files"]["plots"].size() == 3);
  for (const json& row : scene["files"]["plots"])
    for (const json& file : row)
      CHECK(std::filesystem::exists(folder.file("out/" + file.get<std::string>())));
  CHECK(scene["files"]["single_samples"][0].size() == 2);
  CHECK(std::filesystem::exists(
      folder.file("out/" + scene["files"]["pictures"][0]["crops"].get<std::string>())));
  CHECK(std::filesystem::exists(
      folder.file("out/" + scene["files"]["pictures"][0]["errors"].get<std::string>())));

  const outcome second = run(tiny(folder, {"--per-sample", "3"}));
  CHECK(count_of(second.log, "in the cache") == 12);
  CHECK(results_of(folder) == results);
  CHECK(content_of(folder.file("out/results.md")) == markdown);
}

TEST_CASE("an interrupted run goes on, and damage is rendered again", "[quality]") {
  temporary_folder folder;
  REQUIRE(run(tiny(folder)).code == 0);
  const auto errors = [&folder] {
    std::vector<double> values;
    const json results = results_of(folder);
    for (const json& r : results["scenes"][0]["runs"])
      values.push_back(r["points"].back()["error"]["mse_reinhard"]);
    return values;
  };
  const std::vector<double> before = errors();
  // As if interrupted: one chunk of the reference and one rendering are not there yet.
  std::filesystem::remove(cached(folder, "reference-", ".json").at(2));
  std::filesystem::remove(cached(folder, "cornell-box-small-2-samples-2", ".json").at(0));
  outcome again = run(tiny(folder));
  CHECK(again.code == 0);
  CHECK(count_of(again.log, "in the cache") == 6);
  CHECK(errors() == before);
  // Damaged: a picture and a record.
  const std::string picture = cached(folder, "cornell-box-pt-2-samples-1", ".exr").at(0).string();
  std::filesystem::resize_file(picture, 100);
  const std::string record = cached(folder, "cornell-box-small-2-samples-1", ".json").at(0).string();
  std::filesystem::resize_file(record, 50);
  again = run(tiny(folder));
  CHECK(again.code == 0);
  CHECK(count_of(again.log, "in the cache") == 6);
  CHECK(contains(again.log, picture));
  CHECK(contains(again.log, record));
  CHECK(errors() == before);
  // Another size is another rendering.
  again = run(tiny(folder, {}, "8x8"));
  CHECK(again.code == 0);
  CHECK(count_of(again.log, "in the cache") == 0);
}

TEST_CASE("failures are one message and exit code 2", "[quality]") {
  temporary_folder folder;
  const auto message_of = [&folder](const strings& more, const std::string& scene = "cornell-box") {
    const outcome failed = run(tiny(folder, more, "16x16", scene));
    CHECK(failed.code == 2);
    return failed.log;
  };
  CHECK(contains(message_of({}, "nowhere"), "nowhere"));
  CHECK(contains(message_of({}, folder.file("none.glb")), "none.glb"));
  CHECK(contains(message_of({"--method", "odd=--octree-resolution 100"}), "method odd: "));
  CHECK(contains(message_of({"--method", "odd=--combine discard-first", "--spp", "1"}), "method odd: "));
  CHECK(contains(message_of({"--crop", "10,10,16x16"}), "--crop"));
  CHECK(run({"--help"}).code == 0);
  CHECK(run({}).code == 2);
}

TEST_CASE("seconds are a budget too", "[quality]") {
  temporary_folder folder;
  const outcome timed = run(tiny(folder, {"--seconds", "0.02"}));
  INFO(timed.log);
  REQUIRE(timed.code == 0);
  const json scene = results_of(folder)["scenes"][0];
  CHECK(scene["summary"].size() == 2);
  CHECK(scene["summary"][1]["budget"] == "0.02 s");
  for (const json& r : scene["runs"])
    if (r["budget"] == "0.02 s") CHECK(r["points"].back()["samples"] == r["samples"]);
}

TEST_CASE("HDR-FLIP: nothing where it cannot be had, zero of a picture against itself", "[quality]") {
  temporary_folder folder;
  image picture = render::make_image(16, 16);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = vec3(float(i % 7) * 0.1f);
  render::write_exr(folder.file("a.exr"), picture);
  for (vec3& pixel : picture.pixels) pixel *= 0.5f;
  render::write_exr(folder.file("b.exr"), picture);
  const auto errors = quality::flip_errors(
      {{folder.file("a.exr"), folder.file("a.exr")}, {folder.file("a.exr"), folder.file("b.exr")}},
      folder.file(""));
  const bool has_flip =
      quality::output_of("python3 -c 'import flip_evaluator, numpy' 2>/dev/null").has_value();
  REQUIRE(errors.has_value() == has_flip);
  if (has_flip) {
    REQUIRE(errors->size() == 2);
    CHECK((*errors)[0].value() == Approx(0.0).margin(1e-6));
    CHECK((*errors)[1].value() > 0.01);
    CHECK((*errors)[1].value() < 1.0);
  }
  // The script and its files are gone.
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.file(""))) ++files;
  CHECK(files == 2);
}
