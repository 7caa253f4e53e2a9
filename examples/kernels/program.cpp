// From arguments to a picture.
#include "program.hpp"

#include "app/image_io.hpp"
#include "app/metrics.hpp"
#include "app/number_options.hpp"
#include "app/output_files.hpp"
#include "app/progress_bar.hpp"
#include "app/render_arguments.hpp"
#include "app/sample_budget.hpp"
#include "renderer.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
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
      ->check(CLI::IsMember(devices));
}

/// Takes samples until the budget is spent, and returns their weighted mean.
render::image take_samples(renderer& host, const render::render_options& options) {
  render::image picture = render::make_image(options.width, options.height);
  std::vector<glm::dvec3> sums(picture.pixels.size(), glm::dvec3(0.0));
  double weights = 0.0;
  render::progress_bar bar;
  for (render::sample_budget budget(options, 0); !budget.is_spent();) {
    budget.count();
    const std::vector<vec3> colours = host.sample();
    const double weight = host.weight();
    for (std::size_t p = 0; p < sums.size(); ++p) sums[p] += weight * glm::dvec3(colours[p]);
    weights += weight;
    bar.show(budget.progress());
  }
  bar.finish();
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
  if (given.check && (given.options.seconds > 0.0 || given.options.spp < 4))
    throw std::invalid_argument("--check: expected --spp of 4 or more, half of which is guided");
  render::check_outputs({{"--output", given.output, ".exr"}, {"--png", given.png, ".png"}},
                        {{"--reference", given.reference, ""}});
  // How samples add up without a guide.
  if (given.unguided) given.options.method = render::sampling_method::pt;
  const render::scene scene = render::load_scene(given.scene, given.options, "wfpg-kernels", log);
  const render::render_options options = render::completed(scene, given.options);
  std::optional<render::image> reference;
  if (!given.reference.empty())
    reference = render::read_reference(given.reference, options.width, options.height);
  settings wanted;
  wanted.width = options.width;
  wanted.height = options.height;
  wanted.max_depth = static_cast<std::uint32_t>(options.max_depth);
  wanted.roulette_depth = static_cast<std::uint32_t>(options.roulette_depth);
  wanted.fog = given.fog;
  wanted.guided = !given.unguided;
  wanted.check = given.check;
  if (given.check) wanted.unguided_samples = static_cast<std::uint32_t>(options.spp / 2);
  wanted.seed = options.seed;
  const auto host = make_renderer(devices.at(given.where), scene, wanted);
  const render::image picture = take_samples(*host, options);
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
