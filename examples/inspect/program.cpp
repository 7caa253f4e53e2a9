// From arguments to an inspection.
#include "program.hpp"

#include "app/number_options.hpp"
#include "app/output_files.hpp"
#include "app/render_arguments.hpp"
#include "inspection.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <ostream>
#include <string>

namespace inspect {
namespace {

constexpr int failure = 2;

struct arguments {
  render::scene_arguments scene;
  std::string output = "inspection";
  inspection asked;
};

void parse_pixel(const std::string& text, inspection& asked) {
  char end = 0;
  if (std::sscanf(text.c_str(), "%6d,%6d%c", &asked.x, &asked.y, &end) != 2)
    throw CLI::ValidationError("--pixel is " + text + ", expected X,Y from the upper left, such as 320,90");
}

void add_options(CLI::App& app, arguments& given) {
  render::add_scene_options(app, given.scene);
  app.add_option_function<std::string>(
         "--pixel", [&given](const std::string& text) { parse_pixel(text, given.asked); },
         "X,Y from the upper left: what its middle hits is looked at")
      ->required();
  app.add_option("-o,--output", given.output, "folder of the page and its pictures (default: inspection)")
      ->transform(render::file_path());
  app.add_option("--sample", given.asked.sample,
                 "number of the sample whose photons are shown (default: the one to which merges bring most)")
      ->transform(render::whole_number(1, 1 << 30));
  app.add_option("--vdb", given.asked.vdb, "the octree's voxels, OpenVDB")->transform(render::file_path());
  app.add_option("--load-guide", given.asked.learning.load_guide,
                 "guide to begin with, of the same scene and options")
      ->transform(render::file_path());
  app.add_option("--reference-spp", given.asked.reference_spp,
                 "paths for each of the reference's cells, of which there are about 96 x 96 (default: 256)")
      ->transform(render::whole_number(2, 1 << 24));
  app.add_option("--histogram", given.asked.histogram, "samples in the histogram (default: 1048576)")
      ->transform(render::whole_number(1, 1 << 30));
  render::render_options& options = given.asked.learning;
  render::add_method_options(app, options);
  render::add_bidirectional_options(app, options);
  render::add_device_option(app, options);
  render::add_nee_option(app, options);
  render::add_budget_options(app, options);
  render::add_picture_options(app, options);
  render::add_guider_options(app, options);
}

/// Options of one kind of page alone.
void check_options(const CLI::App& app, const render::render_options& options) {
  const auto require = [&app](const char* name, bool holds, const std::string& what) {
    if (app.get_option(name)->count() > 0 && !holds) throw CLI::RequiresError(name, what);
  };
  for (const char* const name : {"--reference-spp", "--histogram", "--vdb", "--load-guide", "--combine"})
    require(name, !render::is_bidirectional(options.method), "--method wfpg or wfpg-product");
  require("--sample", render::is_bidirectional(options.method), "--method bpt, vcm, upbp or lt");
  require("--sample", options.seconds <= 0.0, "--spp, which tells how many samples there are");
}

void inspect_scene(arguments& given, std::ostream& out, std::ostream& log) {
  const render::scene scene = render::load_scene(given.scene, given.asked.learning, "wfpg-inspect", log);
  given.asked.output = given.output;
  run(scene, given.asked, log);
  out << (given.asked.output / "index.html").string() << '\n';
}

}  // namespace

int run_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log) {
  arguments given;
  CLI::App app{
      "Shows why a pixel is noisy: the field that guides its samples, or the photons in reach of its path."};
  render::report_in_one_line(app, "wfpg-inspect");
  add_options(app, given);
  try {
    app.parse(argc, argv);
    render::check_render_options(app, given.asked.learning);
    check_options(app, given.asked.learning);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, log) == 0 ? 0 : failure;
  }
  try {
    inspect_scene(given, out, log);
    return 0;
  } catch (const std::exception& error) {
    log << "wfpg-inspect: " << render::reason_of(error) << '\n';
    return failure;
  }
}

}  // namespace inspect
