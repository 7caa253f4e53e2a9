// wfpg-demo: shows what guiding gains behind a door, products with glossy BSDFs, vcm in caustics, and paths
// from both ends in fog. Each is beside path tracing, with equal samples. The output is pictures, a table,
// plots of error over time, and a page with a slider. Open PGL takes part on CPUs if it is installed.
#include "app/comparison_page.hpp"
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
#include <utility>
#include <vector>

namespace {

using render::image;
using render::image_error;
using render::render_options;
using render::render_result;
using render::sampling_method;

constexpr int samples = 64;             // of the compared pictures
constexpr int reference_samples = 128;  // of both halves

/// Size and zoom of pictures on a device.
struct demo_device {
  const char* name;
  render::device where;
  int size;      // pixels along a side
  int shown_at;  // screen pixels for a pixel of the PNGs
};
constexpr demo_device demo_devices[] = {{"cpu", render::device::cpu, 112, 3},
                                        {"cuda", render::device::cuda, 512, 1}};

struct demo_method {
  const char* name;
  sampling_method method;
  std::uint32_t samples_per_leaf = 32000;  // Open PGL's own default
  float radius = wfpg::bidirectional_options().surface_radius;
};

/// A scene, and the methods that it compares with its first one.
struct demo_scene {
  const char* name;
  const char* shows;
  bool nee;  // next-event estimation
  demo_method reference;
  std::vector<demo_method> methods;
  bool has_openpgl;  // whether Open PGL's methods can render it
};

const std::vector<demo_scene>& demo_scenes() {
  static const demo_method pt{"pt", sampling_method::pt}, vpt{"vpt", sampling_method::vpt},
      wfpg{"wfpg", sampling_method::wfpg}, product{"wfpg-product", sampling_method::wfpg_product},
      bpt{"bpt", sampling_method::bpt}, vcm{"vcm", sampling_method::vcm}, upbp{"upbp", sampling_method::upbp};
  // Its bias is a tenth of vcm's: it falls as the square of the radius.
  static const demo_method small_vcm{"vcm", sampling_method::vcm, 32000, 0.001f};
  static const std::vector<demo_scene> all{
      {"cornell-enclosed", "guiding", false, wfpg, {pt, wfpg}, true},
      {"ajar", "guiding", true, wfpg, {pt, wfpg}, true},
      {"glossy-room", "products", false, wfpg, {pt, wfpg, product}, true},
      {"caustic-pool", "vcm", true, small_vcm, {pt, wfpg, vcm}, false},
      {"fog-spot", "fog", true, bpt, {vpt, bpt, upbp}, false}};
  return all;
}

// Pictures of few samples need leaves smaller than the default. docs/quality.md compares sizes of leaves.
constexpr demo_method openpgl_methods[] = {{"openpgl-vmm-1000", sampling_method::openpgl_vmm, 1000},
                                           {"openpgl-vmm-250", sampling_method::openpgl_vmm, 250},
                                           {"openpgl-dqt-250", sampling_method::openpgl_dqt, 250}};

std::vector<demo_method> methods_on(const demo_device& on, const demo_scene& demo) {
  std::vector<demo_method> methods = demo.methods;
  if (demo.has_openpgl && render::has_openpgl() && on.where == render::device::cpu)
    methods.insert(methods.end(), std::begin(openpgl_methods), std::end(openpgl_methods));
  return methods;
}

/// Counts pictures, so that each is announced with its number.
class announcer {
 public:
  explicit announcer(const demo_device& on) {
    for (const demo_scene& demo : demo_scenes()) count_ += 2 + methods_on(on, demo).size();
  }

  void begin(const char* scene, const std::string& what, int spp) {
    std::fprintf(stderr, "picture %zu of %zu: %s, %s, %d samples a pixel\n", ++begun_, count_, scene,
                 what.c_str(), spp);
  }

 private:
  std::size_t begun_ = 0, count_ = 0;
};

struct method_result {
  const char* method;
  render_result rendering;
  image_error error;  // with the reference's own noise subtracted
};

render_result render_once(const demo_scene& demo, const demo_device& on, const std::string& what,
                          const demo_method& method, render_options options, announcer& announced) {
  announced.begin(demo.name, what, options.spp);
  options.method = method.method;
  options.samples_per_leaf = method.samples_per_leaf;
  options.light.surface_radius = method.radius;
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

// Two halves of other seeds than the methods' tell how noisy it is.
reference make_reference(const demo_scene& demo, const demo_device& on, announcer& announced) {
  render_options options;
  options.spp = reference_samples / 2;
  const auto half = [&](std::uint64_t seed) {
    options.seed = seed;
    return render_once(demo, on, std::string("reference by ") + demo.reference.name, demo.reference, options,
                       announced)
        .picture;
  };
  const image half_a = half(1001), half_b = half(1002);
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
                         const reference& truth, announcer& announced) {
  render_options options;
  options.spp = samples;
  options.checkpoints = render::checkpoint_times::powers_of_two;
  method_result result{method.name, render_once(demo, on, method.name, method, options, announced), {}};
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

double seconds_of(const method_result& result) {
  return result.rendering.checkpoints.back().seconds;
}

nlohmann::ordered_json row(const method_result& result, const method_result& first) {
  const render::render_report& report = result.rendering.report;
  const double gain = first.error.mse_reinhard / result.error.mse_reinhard;
  const double time = seconds_of(result) / seconds_of(first);
  return {{"method", result.method},
          {"spp", report.spp},
          {"seconds", seconds_of(result)},
          {"mse_reinhard", result.error.mse_reinhard},
          {"gain_equal_samples", gain},
          {"gain_equal_time", gain / time},
          {"relmse_trimmed", result.error.relmse_trimmed},
          {"relmse_trimmed_gain_equal_samples", first.error.relmse_trimmed / result.error.relmse_trimmed},
          {"persistent_bytes", report.persistent_bytes},
          {"transient_bytes", report.transient_bytes},
          {"light_vertex_bytes", report.light_vertex_bytes}};
}

render::named_picture on_page(const method_result& result, const method_result& first) {
  char note[64];
  std::snprintf(note, sizeof note, "error %.2e, gain %.2f", result.error.mse_reinhard,
                first.error.mse_reinhard / result.error.mse_reinhard);
  return {result.method, result.rendering.picture, note};
}

/// Writes a scene's files, and adds its pictures to the page.
nlohmann::ordered_json run_scene(const demo_scene& demo, const demo_device& on,
                                 const std::filesystem::path& directory, announcer& announced,
                                 std::vector<render::comparison>& page) {
  const auto path = [&](const std::string& what) { return (directory / (demo.name + what)).string(); };
  const reference truth = make_reference(demo, on, announced);
  render::write_exr(path("-reference.exr"), truth.picture);
  std::vector<image> strip;
  std::vector<method_result> results;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  render::comparison compared{demo.name, {}};
  render::plot plot{demo.name, "seconds", "mean squared error after c / (1 + c)", {}};
  for (const demo_method& method : methods_on(on, demo)) {
    results.push_back(run_method(demo, on, method, truth, announced));
    const method_result& result = results.back();
    render::write_exr(path(std::string("-") + method.name + ".exr"), result.rendering.picture);
    strip.push_back(render::enlarged(result.rendering.picture, on.shown_at));
    rows.push_back(row(result, results.front()));
    compared.pictures.push_back(on_page(result, results.front()));
    plot.curves.push_back(error_over_time(result, truth));
  }
  strip.push_back(render::enlarged(truth.picture, on.shown_at));
  render::write_png(path(".png"), render::side_by_side(strip, 4));
  render::write_svg(path("-error.svg"), plot);
  compared.pictures.push_back({"reference", truth.picture, std::string("by ") + demo.reference.name});
  page.push_back(std::move(compared));
  return {{"scene", demo.name},
          {"shows", demo.shows},
          {"nee", demo.nee},
          {"device", on.name},
          {"size", on.size},
          {"reference_method", demo.reference.name},
          {"reference_radius", demo.reference.radius},
          {"reference_samples", reference_samples},
          {"reference_noise_mse_reinhard", truth.noise.mse_reinhard},
          {"methods", rows}};
}

std::string table_of(const nlohmann::ordered_json& summary) {
  char line[256];
  std::snprintf(line, sizeof line, "%-9s %-17s %-16s %8s %10s %6s %11s\n", "shows", "scene", "method",
                "seconds", "error", "gain", "gain, time");
  std::string table = line;
  for (const auto& scene : summary) {
    for (const auto& method : scene["methods"]) {
      std::snprintf(line, sizeof line, "%-9s %-17s %-16s %8.1f %10.2e %6.2f %11.2f\n",
                    scene["shows"].get<std::string>().c_str(), scene["scene"].get<std::string>().c_str(),
                    method["method"].get<std::string>().c_str(), method["seconds"].get<double>(),
                    method["mse_reinhard"].get<double>(), method["gain_equal_samples"].get<double>(),
                    method["gain_equal_time"].get<double>());
      table += line;
    }
  }
  return table + "\nAll pictures have " + std::to_string(samples) + " samples a pixel, and references " +
         std::to_string(reference_samples) +
         " by wfpg.\nThose of caustic-pool are by vcm with a third of its radius, which leaves a tenth of "
         "its bias, and "
         "those of fog-spot by bpt.\n"
         "pt, vpt: path tracing; wfpg, wfpg-product: guided; bpt, vcm, upbp: paths from both ends "
         "(docs/renderer.md)\n"
         "error: MSE after c / (1 + c), without the reference's own noise.\n"
         "gain: the error of the scene's first method over this one's, at equal samples.\n"
         "gain, time: the gain, times the first method's seconds over this one's: at equal time.\n";
}

void run(const std::filesystem::path& directory, const demo_device& on) {
  render::prepare_folder("DIRECTORY", directory);
  announcer announced(on);
  nlohmann::ordered_json summary = nlohmann::ordered_json::array();
  std::vector<render::comparison> compared;
  for (const demo_scene& demo : demo_scenes())
    summary.push_back(run_scene(demo, on, directory, announced, compared));
  const std::string table = table_of(summary);
  render::write_file((directory / "table.txt").string(), table);
  render::write_file((directory / "summary.json").string(), summary.dump(2) + '\n');
  const std::string page = (directory / "index.html").string();
  render::write_file(page, render::comparison_page("What guiding gains", compared));
  std::printf(
      "\n%s\nEach PNG shows a scene by its methods in the table's order, and the reference. All files: %s\n"
      "Open %s in a browser: a slider compares the pictures.\n",
      table.c_str(), directory.string().c_str(), page.c_str());
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
