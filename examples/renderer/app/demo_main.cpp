// wfpg-demo: compares path tracing with guiding by transient fields, by kept fields and by their products
// with BSDFs. All have equal samples and a reference. The output is pictures, a table, and plots of error
// over time. Open PGL takes part on CPUs if it is installed.
#include "app/image_io.hpp"
#include "app/metrics.hpp"
#include "app/output_files.hpp"
#include "app/plot.hpp"
#include "app/progress_bar.hpp"
#include "app/render.hpp"
#include "scene/builtin_scenes.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

namespace {

using render::image;
using render::image_error;
using render::render_options;
using render::render_result;
using render::sampling_method;

constexpr int samples = 64;  // of the compared pictures

/// Size and zoom of pictures on a device.
struct demo_device {
  const char* name;
  render::device where;
  int size;      // pixels along a side
  int shown_at;  // screen pixels for a pixel of the PNGs
};
constexpr demo_device demo_devices[] = {{"cpu", render::device::cpu, 128, 3},
                                        {"cuda", render::device::cuda, 512, 1}};

struct demo_scene {
  const char* name;
  bool nee;
  float exposure;    // of the PNGs
  int reference_pt;  // samples of the reference's two halves, chosen to take about equal time
  int reference_wfpg;
};
constexpr demo_scene demo_scenes[] = {{"cornell-enclosed", false, 1.0f, 1024, 384},
                                      {"ajar", true, 1.0f, 1024, 384},
                                      {"glossy-room", false, 1.0f, 1024, 384}};

struct demo_method {
  const char* name;
  sampling_method method;
  render::fields lifetime = render::fields::kept;
  std::uint32_t samples_per_leaf = 32000;  // Open PGL's own default
};
constexpr demo_method demo_methods[] = {{"pt", sampling_method::pt},
                                        {"transient", sampling_method::wfpg, render::fields::transient},
                                        {"wfpg", sampling_method::wfpg},
                                        {"wfpg-product", sampling_method::wfpg_product}};
// Pictures of few samples need leaves smaller than the default: 1000 for equal time, 250 for equal samples.
constexpr demo_method openpgl_methods[] = {
    {"openpgl-vmm-1000", sampling_method::openpgl_vmm, render::fields::kept, 1000},
    {"openpgl-vmm-250", sampling_method::openpgl_vmm, render::fields::kept, 250},
    {"openpgl-dqt-250", sampling_method::openpgl_dqt, render::fields::kept, 250}};

std::vector<demo_method> methods_on(const demo_device& on) {
  std::vector<demo_method> methods(std::begin(demo_methods), std::end(demo_methods));
  if (render::has_openpgl() && on.where == render::device::cpu)
    methods.insert(methods.end(), std::begin(openpgl_methods), std::end(openpgl_methods));
  return methods;
}

struct method_result {
  const char* method;
  render_result rendering;
  image_error error;  // with the reference's own noise subtracted
};

render_result render_once(const demo_scene& demo, const demo_device& on, const char* what,
                          render_options options) {
  std::fprintf(stderr, "%s, %s, %d samples\n", demo.name, what, options.spp);
  options.nee = demo.nee;
  options.width = options.height = on.size;
  options.where = on.where;
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

// Half by path tracing and half guided, so that neither method is favoured.
reference make_reference(const demo_scene& demo, const demo_device& on) {
  render_options options;
  options.method = sampling_method::pt;
  options.spp = demo.reference_pt;
  options.seed = 1001;
  const image half_a = render_once(demo, on, "reference, first half", options).picture;
  options.method = sampling_method::wfpg;
  options.spp = demo.reference_wfpg;
  options.seed = 1002;
  const image half_b = render_once(demo, on, "reference, second half", options).picture;
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

method_result run_method(const demo_scene& demo, const demo_device& on, const demo_method& method,
                         const reference& truth) {
  render_options options;
  options.method = method.method;
  options.lifetime = method.lifetime;
  options.samples_per_leaf = method.samples_per_leaf;
  options.spp = samples;
  options.checkpoints = render::checkpoint_times::powers_of_two;
  method_result result{method.name, render_once(demo, on, method.name, options), {}};
  result.error = without_noise(render::compare(result.rendering.picture, truth.picture), truth.noise);
  return result;
}

/// Error after 4, 8, 16, ... samples, over their time in seconds.
render::curve error_over_time(const method_result& result, const reference& truth) {
  render::curve curve{result.method, {}};
  for (const render::checkpoint& at : result.rendering.checkpoints) {
    if (at.samples < 4) continue;
    const image_error error = without_noise(render::compare(at.picture, truth.picture), truth.noise);
    curve.points.emplace_back(at.seconds, error.mse_reinhard);
  }
  return curve;
}

double bins_of(const render::render_report& report) {
  double bins = 0.0;
  for (const render::bin_report& depth : report.bins) bins += depth.count;
  return bins;
}

double seconds_of(const method_result& result) {
  return result.rendering.checkpoints.back().seconds;
}

nlohmann::ordered_json row(const method_result& result, const image_error& pt, double pt_seconds) {
  const render::render_report& report = result.rendering.report;
  return {{"method", result.method},
          {"spp", report.spp},
          {"mse_reinhard", result.error.mse_reinhard},
          {"ratio_to_pt", pt.mse_reinhard / result.error.mse_reinhard},
          {"relmse_trimmed", result.error.relmse_trimmed},
          {"relmse_trimmed_ratio_to_pt", pt.relmse_trimmed / result.error.relmse_trimmed},
          {"equal_time_ratio_to_pt",
           pt_seconds * pt.mse_reinhard / (seconds_of(result) * result.error.mse_reinhard)},
          {"persistent_bytes", report.persistent_bytes},
          {"transient_bytes", report.transient_bytes},
          {"seconds", seconds_of(result)},
          {"bins_a_sample", bins_of(report)},
          {"cones_per_segment", report.cones_per_segment}};
}

void print_row(const char* scene, const nlohmann::ordered_json& row) {
  std::printf("%-17s %-16s %4d  %10.3e %6.2f  %10.3e %6.2f  %8.2f %8.2f  %7.1f %6.2f  %6.0f  %6.2f\n", scene,
              row["method"].get<std::string>().c_str(), row["spp"].get<int>(),
              row["mse_reinhard"].get<double>(), row["ratio_to_pt"].get<double>(),
              row["relmse_trimmed"].get<double>(), row["relmse_trimmed_ratio_to_pt"].get<double>(),
              row["persistent_bytes"].get<double>() / 1048576.0,
              row["transient_bytes"].get<double>() / 1048576.0, row["seconds"].get<double>(),
              row["equal_time_ratio_to_pt"].get<double>(), row["bins_a_sample"].get<double>(),
              row["cones_per_segment"].get<double>());
}

nlohmann::ordered_json run_scene(const demo_scene& demo, const demo_device& on,
                                 const std::filesystem::path& directory) {
  const auto path = [&](const std::string& what) { return (directory / (demo.name + what)).string(); };
  const reference truth = make_reference(demo, on);
  render::write_exr(path("-reference.exr"), truth.picture);
  std::vector<image> strip;
  image_error pt;
  double pt_seconds = 0.0;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  render::plot plot{demo.name, "seconds", "mean squared error after c / (1 + c)", {}};
  for (const demo_method& method : methods_on(on)) {
    const method_result result = run_method(demo, on, method, truth);
    if (method.method == sampling_method::pt) {
      pt = result.error;
      pt_seconds = seconds_of(result);
    }
    render::write_exr(path(std::string("-") + method.name + ".exr"), result.rendering.picture);
    strip.push_back(render::enlarged(result.rendering.picture, on.shown_at));
    rows.push_back(row(result, pt, pt_seconds));
    plot.curves.push_back(error_over_time(result, truth));
  }
  strip.push_back(render::enlarged(truth.picture, on.shown_at));
  render::write_png(path(".png"), render::side_by_side(strip, 4), demo.exposure);
  render::write_svg(path("-error.svg"), plot);
  return {{"scene", demo.name},
          {"nee", demo.nee},
          {"device", on.name},
          {"size", on.size},
          {"reference_noise_mse_reinhard", truth.noise.mse_reinhard},
          {"methods", rows}};
}

void run(const std::filesystem::path& directory, const demo_device& on) {
  render::prepare_folder("DIRECTORY", directory);
  nlohmann::ordered_json summary = nlohmann::ordered_json::array();
  for (const demo_scene& demo : demo_scenes) summary.push_back(run_scene(demo, on, directory));

  std::printf("\n%-17s %-16s %4s  %10s %6s  %10s %6s  %8s %8s  %7s %6s  %6s  %6s\n", "scene", "method", "spp",
              "error", "ratio", "relmse", "ratio", "held MiB", "temp MiB", "seconds", "equal", "bins",
              "cones");
  for (const auto& scene : summary)
    for (const auto& method : scene["methods"]) print_row(scene["scene"].get<std::string>().c_str(), method);
  std::string shown;
  for (const demo_method& method : methods_on(on)) shown += std::string(method.name) + ", ";
  std::printf(
      "\nerror: MSE after c / (1 + c); relmse: relative MSE without the worst 0.1%% of pixels; both less "
      "the\n"
      "reference's own noise. ratio: error of pt / error; equal: the same at equal time. held, temp: memory\n"
      "for guiding, across samples and while one is in flight. bins: a sample, all depths, whose fields\n"
      "were made. cones: a path segment. Pictures, left to right %sreference,\n"
      "and plots of error over time: %s\n",
      shown.c_str(), directory.string().c_str());
  render::write_file((directory / "summary.json").string(), summary.dump(2) + '\n');
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = argc == 3 ? argv[2] : "cpu";
  const auto* const on = std::find_if(std::begin(demo_devices), std::end(demo_devices),
                                      [&](const demo_device& device) { return name == device.name; });
  if (argc < 2 || argc > 3 || on == std::end(demo_devices)) {
    std::fprintf(stderr, "usage: wfpg-demo DIRECTORY [cpu|cuda]\n");
    return 2;
  }
  try {
    run(argv[1], *on);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "wfpg-demo: %s\n", error.what());
    return 2;
  }
  return 0;
}
