// wfpg-demo: path tracing and guided path tracing at equal samples, beside a reference, as pictures and a
// table.
#include "builtin_scenes.hpp"
#include "image_io.hpp"
#include "metrics.hpp"
#include "progress_bar.hpp"
#include "render.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace {

using render::image;
using render::image_error;
using render::render_options;
using render::render_result;
using render::sampling_method;

constexpr int size = 128;    // pixels along a side
constexpr int samples = 64;  // of the compared pictures
constexpr int shown_at = 3;  // screen pixels along a pixel of the PNGs

struct demo_scene {
  const char* name;
  bool nee;
  float exposure;    // of the PNGs
  int reference_pt;  // samples of the reference's two halves, chosen to take about as long
  int reference_wfpg;
};
constexpr demo_scene demo_scenes[] = {{"cornell-enclosed", false, 1.0f, 1024, 192},
                                      {"ajar", true, 1.0f, 1024, 128}};

struct method_result {
  const char* method;
  render_result rendering;
  image_error error;  // the reference's own noise subtracted
};

render_result render_once(const demo_scene& demo, const char* what, render_options options) {
  std::fprintf(stderr, "%s, %s, %d samples\n", demo.name, what, options.spp);
  options.nee = demo.nee;
  options.width = options.height = size;
  render::progress_bar bar;
  render_result result = render::render(render::make_builtin_scene(demo.name), options,
                                        [&bar](const render::render_progress& p) { bar.show(p); });
  bar.finish();
  return result;
}

struct reference {
  image picture;
  image_error noise;
};

// Half by path tracing and half guided, so that the reference flatters neither.
reference make_reference(const demo_scene& demo) {
  render_options options;
  options.method = sampling_method::pt;
  options.spp = demo.reference_pt;
  options.seed = 1001;
  const image half_a = render_once(demo, "reference, first half", options).picture;
  options.method = sampling_method::wfpg;
  options.spp = demo.reference_wfpg;
  options.seed = 1002;
  const image half_b = render_once(demo, "reference, second half", options).picture;
  reference result{half_a, render::noise_of_halves(half_a, half_b)};
  for (std::size_t i = 0; i < result.picture.pixels.size(); ++i)
    result.picture.pixels[i] = 0.5f * (half_a.pixels[i] + half_b.pixels[i]);
  return result;
}

image_error without_noise(image_error error, const image_error& noise) {
  error.mse = std::max(0.0, error.mse - noise.mse);
  error.relmse = std::max(0.0, error.relmse - noise.relmse);
  error.relmse_trimmed = std::max(0.0, error.relmse_trimmed - noise.relmse_trimmed);
  error.mse_reinhard = std::max(0.0, error.mse_reinhard - noise.mse_reinhard);
  return error;
}

method_result run_method(const demo_scene& demo, sampling_method method, const reference& truth) {
  render_options options;
  options.method = method;
  options.spp = samples;
  const char* name = method == sampling_method::pt ? "pt" : "wfpg";
  method_result result{name, render_once(demo, name, options), {}};
  result.error = without_noise(render::compare(result.rendering.picture, truth.picture), truth.noise);
  return result;
}

image enlarged(const image& picture) {
  image result = render::make_image(picture.width * shown_at, picture.height * shown_at);
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x)
      result.pixels[static_cast<std::size_t>(y * result.width + x)] =
          picture.pixels[static_cast<std::size_t>(y / shown_at * picture.width + x / shown_at)];
  return result;
}

double bins_of(const render::render_report& report) {
  double bins = 0.0;
  for (const render::bin_report& depth : report.bins) bins += depth.count;
  return bins;
}

nlohmann::ordered_json row(const method_result& result, const image_error& pt) {
  const render::render_report& report = result.rendering.report;
  return {{"method", result.method},
          {"spp", report.spp},
          {"mse_reinhard", result.error.mse_reinhard},
          {"ratio_to_pt", pt.mse_reinhard / result.error.mse_reinhard},
          {"relmse_trimmed", result.error.relmse_trimmed},
          {"relmse_trimmed_ratio_to_pt", pt.relmse_trimmed / result.error.relmse_trimmed},
          {"persistent_bytes", report.persistent_bytes},
          {"transient_bytes", report.transient_bytes},
          {"seconds", report.total_seconds},
          {"bins_a_sample", bins_of(report)},
          {"cones_per_segment", report.cones_per_segment}};
}

void print_row(const char* scene, const nlohmann::ordered_json& row) {
  std::printf("%-17s %-6s %4d  %10.3e %6.2f  %10.3e %6.2f  %8.2f %8.2f  %7.1f  %6.0f  %6.2f\n", scene,
              row["method"].get<std::string>().c_str(), row["spp"].get<int>(),
              row["mse_reinhard"].get<double>(), row["ratio_to_pt"].get<double>(),
              row["relmse_trimmed"].get<double>(), row["relmse_trimmed_ratio_to_pt"].get<double>(),
              row["persistent_bytes"].get<double>() / 1048576.0,
              row["transient_bytes"].get<double>() / 1048576.0, row["seconds"].get<double>(),
              row["bins_a_sample"].get<double>(), row["cones_per_segment"].get<double>());
}

nlohmann::ordered_json run_scene(const demo_scene& demo, const std::filesystem::path& directory) {
  const reference truth = make_reference(demo);
  const method_result pt = run_method(demo, sampling_method::pt, truth);
  const method_result guided = run_method(demo, sampling_method::wfpg, truth);
  const image strip = render::side_by_side(
      {enlarged(pt.rendering.picture), enlarged(guided.rendering.picture), enlarged(truth.picture)}, 4);
  render::write_png((directory / (std::string(demo.name) + ".png")).string(), strip, demo.exposure);
  render::write_exr((directory / (std::string(demo.name) + "-pt.exr")).string(), pt.rendering.picture);
  render::write_exr((directory / (std::string(demo.name) + "-wfpg.exr")).string(), guided.rendering.picture);
  render::write_exr((directory / (std::string(demo.name) + "-reference.exr")).string(), truth.picture);
  return {{"scene", demo.name},
          {"nee", demo.nee},
          {"size", size},
          {"reference_noise_mse_reinhard", truth.noise.mse_reinhard},
          {"methods", {row(pt, pt.error), row(guided, pt.error)}}};
}

void run(const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  nlohmann::ordered_json summary = nlohmann::ordered_json::array();
  for (const demo_scene& demo : demo_scenes) summary.push_back(run_scene(demo, directory));

  std::printf("\n%-17s %-6s %4s  %10s %6s  %10s %6s  %8s %8s  %7s  %6s  %6s\n", "scene", "method", "spp",
              "error", "ratio", "relmse", "ratio", "kept MiB", "temp MiB", "seconds", "bins", "cones");
  for (const auto& scene : summary)
    for (const auto& method : scene["methods"]) print_row(scene["scene"].get<std::string>().c_str(), method);
  std::printf(
      "\nerror: MSE after c / (1 + c); relmse: relative MSE without the worst 0.1%% of pixels; both less "
      "the\n"
      "reference's own noise. ratio: error of pt / error. kept, temp: memory for guiding, across samples "
      "and\n"
      "while one is in flight. bins: a sample, all depths. cones: a path segment.\n"
      "Pictures, left to right pt, wfpg, reference: %s\n",
      directory.string().c_str());
  std::ofstream file(directory / "summary.json");
  file << summary.dump(2) << '\n';
  if (!file) throw std::runtime_error((directory / "summary.json").string() + ": cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: wfpg-demo DIRECTORY\n");
    return 2;
  }
  try {
    run(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "wfpg-demo: %s\n", error.what());
    return 2;
  }
  return 0;
}
