// The parts of wfpg-quality: statistics, pictures, cache, references, progress, single samples.
// test_quality_options.cpp tests its options, test_quality_program.cpp whole runs.
#include "cache.hpp"
#include "flip.hpp"
#include "pictures.hpp"
#include "progress.hpp"
#include "reference.hpp"
#include "runs.hpp"
#include "scene/builtin_scenes.hpp"
#include "settings.hpp"
#include "single_samples.hpp"
#include "statistic.hpp"
#include "summary.hpp"
#include "support/catch.hpp"
#include "support/measurements.hpp"
#include "support/renderer_io.hpp"

#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using quality::json;
using render::image;

constexpr double infinite = std::numeric_limits<double>::infinity();

quality::measured_run hand_made(std::size_t method, int seed, double error, double seconds) {
  quality::measured_run run;
  run.method = method;
  run.seed = seed;
  render::image_error e;
  e.mse_reinhard = error;
  e.mae = e.smape = error;
  run.record.points = {{4, seconds, e}};
  run.record.cost.samples = 4;
  run.record.cost.seconds = seconds;
  run.record.cost.light_hits_per_path = seconds / 4.0;
  return run;
}

}  // namespace

TEST_CASE("statistics of hand-made values are right", "[quality]") {
  const quality::statistic one = quality::statistic_of({3.0});
  CHECK(one.mean == 3.0);
  CHECK_FALSE(one.deviation.has_value());
  const quality::statistic three = quality::statistic_of({1.0, 2.0, 6.0});
  CHECK(three.mean == Approx(3.0));
  CHECK(three.deviation.value() == Approx(std::sqrt(7.0)));
  CHECK(three.standard_error.value() == Approx(std::sqrt(7.0 / 3.0)));
  // 10% and 20% side by side give sqrt(5)% of ten.
  const quality::ratio gain = quality::ratio_of({8.0, 1.6, 0.8}, {2.0, 0.8, 0.4}).value();
  CHECK(gain.value == Approx(4.0));
  CHECK(gain.standard_error.value() == Approx(4.0 * std::sqrt(0.05)));
  CHECK_FALSE(quality::ratio_of(one, {1.0, {}, {}}).value().standard_error.has_value());
  CHECK_FALSE(quality::ratio_of(one, {-1.0, {}, {}}).has_value());
  CHECK_FALSE(quality::ratio_of({infinite, {}, {}}, one).has_value());
}

TEST_CASE("summaries: noise, gains and equal time match values by hand", "[quality]") {
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
  const json& mae = summary[0]["methods"][1]["errors"]["mae"];
  CHECK((mae["mean"].get<double>() == Approx(6.0) && mae["ratio"].get<double>() == Approx(41.0 / 6.0)));
  CHECK(summary[0]["methods"][1]["light_hits_per_path"].get<double>() == Approx(0.5));
  // The reference's noise hides all of the error.
  noise.error.mse_reinhard = 6.5;
  const json hidden =
      quality::summary_of(given, {hand_made(0, 1, 40.0, 1.0), hand_made(1, 1, 6.0, 2.0)}, noise);
  CHECK(hidden[0]["methods"][1]["errors"]["mse_reinhard"]["mean"].is_null());
  CHECK(hidden[0]["methods"][1]["errors"]["mse_reinhard"]["ratio"].is_null());
  CHECK(hidden[0]["methods"][1]["errors"]["mse_reinhard"]["noise_is_large"].get<bool>());
}

TEST_CASE("records survive JSON, with infinite errors too", "[quality]") {
  quality::run_record record;
  render::image_error error;
  error.mse = infinite;
  error.relmse_robust = 0.25;
  error.non_finite = 3;
  record.points = {{1, 0.5, {}}, {2, 1.5, error}};
  record.cost = {2, 1.5, 2.0, 12345678901u, 10, 8, 20, 0.75, 0.5};
  const json object = quality::to_json(record);
  const quality::run_record back = quality::record_from_json(json::parse(object.dump()));
  CHECK(quality::to_json(back) == object);
  CHECK(std::isinf(back.points[1].error.mse));
  CHECK(back.cost.segments == 12345678901u);
  CHECK(back.cost.light_hits_per_path == 0.5);
  CHECK_THROWS_AS(quality::record_from_json(json::object()), json::exception);
}

TEST_CASE("pictures: the crop is where errors are largest", "[quality]") {
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

TEST_CASE("pictures: exposure, error maps and frames are right", "[quality]") {
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

TEST_CASE("cache: stored entries are found, damaged ones are not", "[quality]") {
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
  CHECK_THROWS_AS(quality::run_cache("/proc/none", log), std::invalid_argument);
}

TEST_CASE("references: halves have chunks, and each setting changes their key", "[quality]") {
  const quality::settings given = parsed({"--scenes", "ajar", "ajar --nee off", "ajar --roulette-depth 8",
                                          "--size", "16x16", "--max-depth", "4"});
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
  CHECK(plan.hash() != quality::plan_reference(given.scenes[2], "x", 11, 4).hash());
  // A longer reference begins with the same chunks.
  CHECK(plan.halves[0][0].key.hash() ==
        quality::plan_reference(given.scenes[0], "x", 64, 4).halves[0][0].key.hash());
}

TEST_CASE("the content of a scene's files identifies it", "[quality]") {
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

TEST_CASE("progress: remaining work and time follow from finished work", "[quality]") {
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

TEST_CASE("single samples add up to the renderer's combined picture", "[quality]") {
  const render::scene box = render::make_builtin_scene("cornell-box");
  render::render_options options;
  options.width = options.height = 8;
  options.octree_resolution = 16;
  options.kept.resolution = 8;
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

TEST_CASE("HDR-FLIP: no result if not installed, and zero for equal pictures", "[quality]") {
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
  // The script and its files are deleted.
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.file(""))) ++files;
  CHECK(files == 2);
}
