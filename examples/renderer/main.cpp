// wfpg-render: renders a scene with or without guiding. SIGINT and SIGTERM end it after the sample in flight,
// with its picture and state. Exit code 0; 2 with a message on failure; 3 where it was interrupted.
#include "interruption.hpp"
#include "progress_bar.hpp"
#include "render.hpp"
#include "render_arguments.hpp"
#include "render_state.hpp"
#include "stats_json.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <iostream>
#include <optional>
#include <string>

namespace {

constexpr int failure = 2;
constexpr int interrupted = 3;

struct arguments {
  render::scene_arguments scene;
  std::string output, png, stats, reference, save_guide, save_state;
  float exposure = 1.0f;  // of the PNG
  render::render_options options;
};

void add_file_options(CLI::App& app, arguments& given) {
  app.add_option("-o,--output", given.output, "picture, OpenEXR");
  app.add_option("--png", given.png, "picture, sRGB PNG");
  app.add_option("--exposure", given.exposure, "multiplies the PNG's values (default: 1)")
      ->check(CLI::PositiveNumber)
      ->needs("--png");
  app.add_option("--stats", given.stats, "what it cost, JSON");
  app.add_option("--reference", given.reference, "picture to print the error against, OpenEXR");
}

void add_state_options(CLI::App& app, arguments& given) {
  app.add_option("--save-guide", given.save_guide,
                 "where the guide of wfpg or wfpg-product goes at the end: what it has learnt");
  CLI::Option* const load = app.add_option("--load-guide", given.options.load_guide,
                                           "guide for wfpg or wfpg-product to begin with, of the same scene");
  app.add_option("--save-state", given.save_state,
                 "where the state of a rendering by pt, wfpg or wfpg-product goes at the end, and when it is "
                 "interrupted");
  app.add_option("--resume", given.options.resume,
                 "state of the rendering to go on with; where it goes when that is interrupted")
      ->excludes(load);
}

/// What goes on from an interrupted rendering, or to more samples.
void save_state(const arguments& given, const render::render_result& result) {
  const bool updates = given.save_state.empty() && result.is_stopped;
  const std::string& state = updates ? given.options.resume : given.save_state;
  if (!state.empty()) render::write_bytes(state, result.state);
  if (!result.is_stopped) return;
  std::cerr << "wfpg-render: interrupted after " << result.report.spp << " samples"
            << (state.empty() ? "" : "; --resume " + state + " goes on") << '\n';
}

void print_error(const render::image_error& error) {
  std::printf("mse %.6e  relmse %.6e  relmse trimmed %.6e  mse reinhard %.6e\n", error.mse, error.relmse,
              error.relmse_trimmed, error.mse_reinhard);
}

/// Writes all that was asked for, whatever of it fails, and says what does: rendering takes longer than that.
bool write_all(const arguments& given, const render::render_result& result,
               const std::optional<render::image>& reference) {
  bool is_written = true;
  const auto attempt = [&is_written](const auto& write) {
    try {
      write();
    } catch (const std::exception& error) {
      std::cerr << "wfpg-render: " << error.what() << '\n';
      is_written = false;
    }
  };
  if (!given.output.empty()) attempt([&] { render::write_exr(given.output, result.picture); });
  if (!given.png.empty()) attempt([&] { render::write_png(given.png, result.picture, given.exposure); });
  if (!given.save_guide.empty()) attempt([&] { render::write_bytes(given.save_guide, result.guide); });
  attempt([&] { save_state(given, result); });
  std::optional<render::image_error> error;
  if (reference) attempt([&] { error = render::compare(result.picture, *reference); });
  if (error) print_error(*error);
  if (!given.stats.empty()) attempt([&] { render::write_stats(given.stats, result.report, error); });
  return is_written;
}

int run(arguments& given) {
  const render::scene scene = render::load_scene(given.scene, given.options, "wfpg-render", std::cerr);
  // Read before rendering, so that a wrong path costs no time.
  std::optional<render::image> reference;
  if (!given.reference.empty()) reference = render::read_exr(given.reference);

  given.options.keep_guide = !given.save_guide.empty();
  given.options.keep_state = !given.save_state.empty() || !given.options.resume.empty();
  given.options.is_stopped = render::is_interrupted;
  render::note_interruptions();
  render::progress_bar bar;
  const render::render_result result =
      render::render(scene, given.options, [&bar](const render::render_progress& p) { bar.show(p); });
  bar.finish();
  if (!write_all(given, result, reference)) return failure;
  return result.is_stopped ? interrupted : 0;
}

}  // namespace

int main(int argc, char** argv) {
  arguments given;
  CLI::App app{"Renders a scene by wavefront path tracing, with or without path guiding."};
  render::add_scene_options(app, given.scene);
  add_file_options(app, given);
  add_state_options(app, given);
  render::add_method_options(app, given.options);
  render::add_device_option(app, given.options);
  render::add_nee_option(app, given.options);
  render::add_budget_options(app, given.options);
  render::add_picture_options(app, given.options);
  render::add_guider_options(app, given.options);
  try {
    app.parse(argc, argv);
    if (given.output.empty() && given.png.empty() && given.stats.empty() && given.reference.empty() &&
        given.save_guide.empty() && given.save_state.empty())
      throw CLI::RequiredError("one of -o, --png, --stats, --reference, --save-guide, --save-state");
    render::check_render_options(app, given.options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : failure;
  }
  try {
    return run(given);
  } catch (const std::exception& error) {
    std::cerr << "wfpg-render: " << error.what() << '\n';
    return failure;
  }
}
