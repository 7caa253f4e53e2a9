// From arguments to a picture.
#include "program.hpp"

#include "app/image_io.hpp"
#include "app/metrics.hpp"
#include "app/number_options.hpp"
#include "app/output_files.hpp"
#include "app/progress_bar.hpp"
#include "app/render_arguments.hpp"
#include "renderer.hpp"

#include <wfpg/sampling/sample_combiner.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace kernels {
namespace {

constexpr int failure = 2;

struct arguments {
  render::scene_arguments scene;
  render::render_options options;  // of which the picture's and the budget's are used
  std::string output, png, reference, where = "tbb";
  float fog = 0.0f;
  bool unguided = false, check = false;
};

const std::map<std::string, device> devices{
    {"serial", device::serial}, {"tbb", device::tbb}, {"cuda", device::cuda}};

void add_options(CLI::App& app, arguments& given) {
  render::add_scene_options(app, given.scene);
  render::add_budget_options(app, given.options);
  render::add_picture_options(app, given.options);
  app.add_option("-o,--output", given.output, "picture, OpenEXR")->transform(render::file_path());
  app.add_option("--png", given.png, "picture, sRGB PNG")->transform(render::file_path());
  app.add_option("--reference", given.reference, "picture to print the error against, OpenEXR")
      ->transform(render::file_path());
  app.add_option("--fog", given.fog, "scattering events per scene unit (default: 0)")
      ->transform(render::number(0.0, 1.0e6));
  CLI::Option* const unguided = app.add_flag("--unguided", given.unguided, "no sample is guided");
  app.add_flag("--check", given.check,
               "says what is wrong in the use of the guide, and whether it pays; needs --spp of 4 or more")
      ->excludes(unguided);
  app.add_option("--device", given.where, "serial, tbb or cuda (default: tbb)")
      ->check(CLI::IsMember({"serial", "tbb", "cuda"}));
}

/// Takes samples until the budget is spent, and returns their weighted mean.
render::image take_samples(renderer& host, const arguments& given, int width, int height) {
  const auto begin = std::chrono::steady_clock::now();
  std::vector<glm::dvec3> sums(std::size_t(width) * std::size_t(height), glm::dvec3(0.0));
  double weights = 0.0, seconds = 0.0;
  const double limit = given.options.seconds;
  render::progress_bar bar;
  for (int i = 1; limit > 0.0 ? i == 1 || seconds < limit : i <= given.options.spp; ++i) {
    using wfpg::sample_combination, wfpg::sample_weight;
    const auto number = static_cast<std::uint32_t>(i);
    const double weight = given.unguided ? 1.0 : sample_weight(sample_combination::pt_linear, number);
    const std::vector<vec3> colours = host.sample();
    for (std::size_t p = 0; p < sums.size(); ++p) sums[p] += weight * glm::dvec3(colours[p]);
    weights += weight;
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    bar.show({i, std::min(1.0, limit > 0.0 ? seconds / limit : double(i) / given.options.spp), seconds, 0.0});
  }
  bar.finish();
  render::image picture = render::make_image(width, height);
  for (std::size_t p = 0; p < sums.size(); ++p) picture.pixels[p] = vec3(sums[p] / weights);
  return picture;
}

/// A picture of luminance alone. Four wavelengths a path make more noise of colour than of luminance.
render::image grey(render::image picture) {
  for (vec3& pixel : picture.pixels) pixel = vec3(wfpg::luminance(pixel));
  return picture;
}

void print_error(const render::image& picture, const render::image& reference, std::ostream& out) {
  const render::image_error error = render::compare(picture, reference);
  const double of_luminance = render::compare(grey(picture), grey(reference)).mse_reinhard;
  char line[160];
  std::snprintf(line, sizeof line, "mse %.6e  relmse %.6e  mse reinhard %.6e, of luminance %.6e\n", error.mse,
                error.relmse, error.mse_reinhard, of_luminance);
  out << line;
}

void run(arguments& given, std::ostream& out, std::ostream& log) {
  render::check_outputs({{"--output", given.output, ".exr"}, {"--png", given.png, ".png"}},
                        {{"--reference", given.reference, ""}});
  const render::scene scene = render::load_scene(given.scene, given.options, "wfpg-kernels", log);
  const render::render_options options = render::completed(scene, given.options);
  std::optional<render::image> reference;
  if (!given.reference.empty()) reference = render::read_exr(given.reference);
  if (reference && (reference->width != options.width || reference->height != options.height))
    throw std::invalid_argument("--reference: " + given.reference + " has another size than the picture");
  settings wanted;
  wanted.width = options.width;
  wanted.height = options.height;
  wanted.max_depth = static_cast<std::uint32_t>(options.max_depth);
  wanted.roulette_depth = static_cast<std::uint32_t>(options.roulette_depth);
  wanted.fog = given.fog;
  wanted.guided = !given.unguided;
  wanted.check = given.check;
  if (given.check && (options.seconds > 0.0 || options.spp < 4))
    throw std::invalid_argument("--check: expected --spp of 4 or more, half of which is guided");
  if (given.check) wanted.unguided_samples = static_cast<std::uint32_t>(std::max(options.spp / 2, 2));
  wanted.seed = options.seed;
  const auto host = make_renderer(devices.at(given.where), scene, wanted);
  const render::image picture = take_samples(*host, given, options.width, options.height);
  if (given.check) {
    const std::string faults = host->faults(), note = host->note();
    out << (faults.empty() ? "the guide is used as it should be" : faults) << '\n';
    if (!note.empty()) out << note << '\n';
  }
  if (!given.output.empty()) render::write_exr(given.output, picture);
  if (!given.png.empty()) render::write_png(given.png, picture);
  if (reference) print_error(picture, *reference, out);
}

}  // namespace

int run_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log) {
  arguments given;
  CLI::App app{"Renders a scene with kernels by material, four wavelengths a path, and a fog."};
  render::report_in_one_line(app, "wfpg-kernels");
  add_options(app, given);
  try {
    app.parse(argc, argv);
    if (given.output.empty() && given.png.empty() && given.reference.empty() && !given.check)
      throw CLI::RequiredError("one of -o, --png, --reference, --check");
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, log) == 0 ? 0 : failure;
  }
  try {
    run(given, out, log);
  } catch (const std::exception& error) {
    log << "wfpg-kernels: " << render::reason_of(error) << '\n';
    return failure;
  }
  return 0;
}

}  // namespace kernels
