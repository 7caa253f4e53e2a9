// wfpg-room: measures how well guides fit known light, in a room of which all is known. Exit code 0, or 2
// with a message on failure.
#include "distributions.hpp"
#include "method.hpp"
#include "wfpg_method.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <fstream>
#include <iostream>
#include <stdexcept>

namespace room {
namespace {

using json = nlohmann::json;

outcome measure_wfpg(const settings& set, const wall_light& light, const std::vector<wall_point>& places) {
  wfpg_method method(light, wfpg_options(set, places.size()));
  for (std::uint32_t sample = 0; sample < set.samples; ++sample) method.train(sample);
  outcome result;
  result.at_places = method.measure_at(places, result.unguided);
  const wfpg::kept_field_statistics fields = method.fields();
  result.bytes = fields.live * fields.bytes_a_slot;
  return result;
}

std::string design_name(const std::string& source, const std::string& design, const std::string& target) {
  return source + '-' + design + '-' + target;
}

/// Names of all methods.
std::vector<std::string> method_names() {
  std::vector<std::string> names{"cosine", "wfpg"};
  names.insert(names.end(), openpgl_names.begin(), openpgl_names.end());
  for (const char* const source : source_names)
    for (const char* const design : design_names)
      for (const char* const target : target_names) names.push_back(design_name(source, design, target));
  return names;
}

outcome measure_method(const std::string& name, const settings& set, const wall_light& light,
                       const std::vector<wall_point>& places) {
  if (name == "wfpg") return measure_wfpg(set, light, places);
  for (const char* const source : source_names)
    for (const char* const design : design_names)
      for (const char* const target : target_names)
        if (name == design_name(source, design, target))
          return measure_design(design, target == std::string("rms"), set, {source, set, light, places},
                                light, places);
  if (name != "cosine") return measure_openpgl(name, set, light, places);
  return {measure_cosine(light, places)};
}

double median(std::vector<double> values) {
  return mean_and_median(std::move(values)).median;
}

/// Means and medians over places of each arrangement, and their medians over arrangements.
json summary(const std::vector<outcome>& outcomes) {
  json result;
  double unguided = 0.0, bytes = 0.0;
  for (const char* const kind : {"alone", "half"}) {
    std::vector<double> means, medians;
    for (const outcome& o : outcomes) {
      const mean_and_median of(std::string(kind) == "alone" ? o.at_places.alone : o.at_places.half);
      means.push_back(of.mean);
      medians.push_back(of.median);
    }
    result[kind] = {
        {"mean", median(means)}, {"median", median(medians)}, {"means", means}, {"medians", medians}};
  }
  for (const outcome& o : outcomes) {
    unguided += static_cast<double>(o.unguided) / static_cast<double>(outcomes.size());
    bytes += static_cast<double>(o.bytes) / static_cast<double>(outcomes.size());
  }
  result["unguided"] = unguided;
  if (bytes > 0.0) result["bytes"] = bytes;
  return result;
}

std::string command_line(int argc, char** argv) {
  std::string line = "wfpg-room";
  for (int i = 1; i < argc; ++i) line += std::string(" ") + argv[i];
  return line;
}

/// Writes what is measured so far, so that a run that ends early keeps it.
void write(const std::string& path, const json& all) {
  std::ofstream file(path);
  file << all.dump(1) << '\n';
  if (!file.flush()) throw std::runtime_error("--json: cannot write " + path);
}

void print_row(const std::string& name, const json& row) {
  std::printf("| %s | %.3g / %.3g | %.3g / %.3g | %.3g |\n", name.c_str(), row["half"]["mean"].get<double>(),
              row["half"]["median"].get<double>(), row["alone"]["mean"].get<double>(),
              row["alone"]["median"].get<double>(), row["unguided"].get<double>());
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  CLI::App app{
      "Measures how well guides fit known light. The table has the relative variance of one sample "
      "of irradiance, mean / median over places on the walls, as medians over arrangements."};
  settings set;
  std::vector<std::string> methods{"cosine", "wfpg", "exact-grid-mean", "exact-grid-rms"};
  std::uint32_t arrangements = 10;
  std::size_t place_count = 256;
  std::string json_file;
  app.add_option("--methods", methods, "methods to measure")
      ->check(CLI::IsMember(method_names()))
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--arrangements", arrangements, "arrangements of lights, from seeds 1 to this")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--places", place_count, "places on the walls")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--samples", set.samples, "samples that train a guide")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--paths", set.paths, "paths of a sample")
      ->check(CLI::Range(1, 1 << 28))
      ->capture_default_str();
  app.add_option("--resolution", set.resolution,
                 "cells along the side of a grid; other designs have as many numbers, but for wfpg's fields")
      ->check(CLI::Range(3, 128))
      ->capture_default_str();
  app.add_option("--slot-resolution", set.slot_resolution, "F: cells along the side of wfpg's fields")
      ->check(CLI::Range(2, 128))
      ->capture_default_str();
  app.add_option("--budget", set.budget_mib, "MiB of wfpg's kept fields")
      ->check(CLI::Range(0.01, 4096.0))
      ->capture_default_str();
  app.add_option("--filter-alpha", set.filter_alpha, "width of wfpg's filter, in cells")
      ->check(CLI::Range(0.0f, 4.0f))
      ->capture_default_str();
  app.add_option("--floor", set.floor, "floor of cells, of their mean; above 0")
      ->check(CLI::Range(1.0e-6f, 10.0f))
      ->capture_default_str();
  app.add_option("--samples-per-leaf", set.samples_a_leaf, "of Open PGL")
      ->check(CLI::Range(1, 1 << 30))
      ->capture_default_str();
  app.add_option("--json", json_file, "file that gets all numbers, after each method");
  CLI11_PARSE(app, argc, argv);

  json all{{"command", command_line(argc, argv)}, {"methods", json::object()}};
  if (!json_file.empty()) write(json_file, all);  // before minutes of work
  const std::vector<wall_point> places = make_places(place_count);
  std::vector<arrangement> lights;
  for (std::uint32_t seed = 1; seed <= arrangements; ++seed) {
    lights.push_back(make_arrangement(seed));
    set_share(lights.back(), places);
  }
  std::printf("| method | half and half | alone | unguided places |\n| --- | --- | --- | --- |\n");
  for (const std::string& name : methods) {
    std::vector<outcome> outcomes;
    for (const arrangement& a : lights) {
      outcomes.push_back(measure_method(name, set, a.light, places));
      std::fprintf(stderr, "\r%s: %zu of %zu arrangements ", name.c_str(), outcomes.size(), lights.size());
    }
    std::fprintf(stderr, "\r%60s\r", "");
    all["methods"][name] = summary(outcomes);
    print_row(name, all["methods"][name]);
    if (!json_file.empty()) write(json_file, all);
  }
  return 0;
}

}  // namespace
}  // namespace room

int main(int argc, char** argv) {
  try {
    return room::run(argc, argv) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::cerr << "wfpg-room: " << error.what() << '\n';
    return 2;
  }
}
