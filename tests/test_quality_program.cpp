// Whole runs of wfpg-quality on tiny pictures: output files, interruptions, damage, failures.
#include "program.hpp"
#include "summary.hpp"
#include "support/catch.hpp"
#include "support/measurements.hpp"
#include "support/renderer_io.hpp"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace render_test;
using quality::json;

/// Runs the program in a folder and keeps its log.
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

/// Arguments of a tiny measurement: a reference in two chunks a half, two methods, two seeds.
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

}  // namespace

TEST_CASE("a whole run works, and a second run renders nothing", "[quality]") {
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
  CHECK(contains(markdown, "| light hits a path |"));
  CHECK(contains(markdown, "depth 8, roulette from vertex 3, next-event"));
  CHECK(scene["summary"][0]["methods"][0]["light_hits_per_path"].get<double>() > 0.0);
  CHECK(contains(markdown, "| small | pt-linear |"));
  CHECK(scene["files"]["plots"].size() == 4);
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

TEST_CASE("an interrupted run continues, and damaged files are rendered again", "[quality]") {
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
  // As after an interruption: one chunk of the reference and one rendering are missing.
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

TEST_CASE("failures print one message and return exit code 2", "[quality]") {
  temporary_folder folder;
  const auto message_of = [&folder](const strings& more, const std::string& scene = "cornell-box") {
    const outcome failed = run(tiny(folder, more, "16x16", scene));
    CHECK(failed.code == 2);
    return failed.log;
  };
  CHECK(contains(message_of({}, "nowhere"), "nowhere"));
  CHECK(contains(message_of({}, folder.file("none.glb")), "none.glb"));
  CHECK(contains(message_of({"--method", "odd=--method sarsa --sarsa-directions 5"}), "method odd: "));
  CHECK(contains(message_of({"--method", "odd=--combine discard-first", "--spp", "1"}), "method odd: "));
  CHECK(contains(message_of({"--crop", "10,10,16x16"}), "--crop"));
  CHECK(run({"--help"}).code == 0);
  CHECK(run({}).code == 2);
}

TEST_CASE("unwritable folders and invalid crops are refused before the first sample", "[quality]") {
  temporary_folder folder;
  const std::string file = folder.write("file", "x");
  std::filesystem::create_directories(folder.file("taken/results.md"));
  const auto message_of = [](const strings& arguments) {
    const outcome refused = run(arguments);
    CHECK(refused.code == 2);
    CHECK(count_of(refused.log, "\n") == 1);
    return refused.log;
  };
  const auto with = [&](const std::string& option, const std::string& value) {
    strings arguments = tiny(folder);
    *(std::find(arguments.begin(), arguments.end(), option) + 1) = value;
    return message_of(arguments);
  };
  CHECK(message_of(tiny(folder, {"--crop", "10,10,16x16"})) ==
        "wfpg-quality: --crop is not within the 16 x 16 pixels of cornell-box\n");
  CHECK(contains(with("--output", file), "--output: " + file + " is no folder to write to: "));
  CHECK(contains(with("--cache", file + "/in"), "--cache: " + file + "/in is no folder to write to: "));
  CHECK(contains(with("--output", folder.file("taken")), "results.md is there and is not a file"));
}

TEST_CASE("a budget in seconds works too", "[quality]") {
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
