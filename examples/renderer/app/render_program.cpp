// From arguments to pictures.
#include "app/render_program.hpp"

#include "app/interruption.hpp"
#include "app/number_options.hpp"
#include "app/option_names.hpp"
#include "app/output_files.hpp"
#include "app/processes.hpp"
#include "app/progress_bar.hpp"
#include "app/render.hpp"
#include "app/render_arguments.hpp"
#include "app/render_state.hpp"
#include "app/stats_json.hpp"
#include "scene/builtin_scenes.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace render {
namespace {

constexpr int failure = 2;
constexpr int interrupted = 3;
constexpr const char* plain_end = "-unweighted";  ///< of names of technique pictures without weights

struct arguments {
  scene_arguments scene;
  std::string output, png, stats, reference, save_guide, save_state;
  std::string technique_pictures;  ///< how names of files begin
  float exposure = 1.0f;           ///< of the PNG
  float fog = 0.0f;                ///< scattering per scene unit; 0: the scene's own
  render_options options;
};

/// The file of a technique's picture. `end`: of its name, without extension.
std::string technique_file(const arguments& given, technique by, const char* end = "") {
  return given.technique_pictures + name_of(by) + end + ".exr";
}

/// Checks files before the scene is loaded, since rendering takes long.
void check_files(const arguments& given) {
  const render_options& options = given.options;
  std::vector<named_file> outputs = {{"--output", given.output, ".exr"},
                                     {"--png", given.png, ".png"},
                                     {"--stats", given.stats, ""},
                                     {"--save-guide", given.save_guide, ""},
                                     {"--save-state", given.save_state, ""}};
  const technique_set techniques = pictured(techniques_of(options));
  for (int i = 0; i < technique_count && !given.technique_pictures.empty(); ++i)
    if (techniques.has(technique(i)))
      for (const char* end : {"", plain_end})
        outputs.push_back({"--technique-pictures", technique_file(given, technique(i), end), ""});
  // An interrupted rendering continues from its newer state.
  if (given.save_state.empty()) outputs.push_back({"--resume", options.resume, ""});
  check_outputs(outputs, {{"SCENE", is_builtin_scene(given.scene.name) ? "" : given.scene.name, ""},
                          {"--environment", given.scene.environment, ""},
                          {"--reference", given.reference, ""}});
}

void add_file_options(CLI::App& app, arguments& given) {
  app.add_option("-o,--output", given.output, "picture, OpenEXR")->transform(file_path());
  app.add_option("--png", given.png, "picture, sRGB PNG")->transform(file_path());
  app.add_option("--exposure", given.exposure, "multiplies the PNG's values (default: 1)")
      ->transform(positive_number(1.0e30))
      ->needs("--png");
  app.add_option("--technique-pictures", given.technique_pictures,
                 "pictures of what each technique finds, OpenEXR; how their names begin, such as out/by-");
  app.add_option("--stats", given.stats, "what it cost, JSON")->transform(file_path());
  app.add_option("--reference", given.reference, "picture to print the error against, OpenEXR")
      ->transform(file_path());
}

void add_fog_option(CLI::App& app, arguments& given) {
  app.add_option("--fog", given.fog,
                 "scattering per scene unit of a fog around everything (default: the scene's)")
      ->transform(positive_number(double(largest_coefficient)));
}

void add_state_options(CLI::App& app, arguments& given) {
  app.add_option("--save-guide", given.save_guide,
                 "where the guide of wfpg or wfpg-product goes at the end: what it has learnt")
      ->transform(file_path());
  CLI::Option* const load = app.add_option("--load-guide", given.options.load_guide,
                                           "guide for wfpg or wfpg-product to begin with, of the same scene")
                                ->transform(file_path());
  app.add_option("--save-state", given.save_state,
                 "where the state of a rendering by " + names_of_methods(&method_properties::can_be_saved) +
                     " goes at the end, and when it is interrupted")
      ->transform(file_path());
  app.add_option("--resume", given.options.resume,
                 "state of the rendering to go on with; where it goes when that is interrupted")
      ->transform(file_path())
      ->excludes(load)
      ->excludes(app.get_option("--technique-pictures"));
}

/// Writes the state of a rendering that can be resumed, also with more samples.
void save_state(const arguments& given, const render_result& result, std::ostream& log) {
  const bool updates = given.save_state.empty() && result.is_stopped;
  const std::string& state = updates ? given.options.resume : given.save_state;
  if (!state.empty()) write_file(state, result.state);
  if (!result.is_stopped) return;
  log << "wfpg-render: interrupted after " << result.report.spp << " samples"
      << (state.empty() ? "" : "; --resume " + state + " goes on") << '\n';
}

void print_error(const image_error& error, std::ostream& out) {
  char line[200];
  std::snprintf(line, sizeof line, "mse %.6e  relmse %.6e  relmse trimmed %.6e  mse reinhard %.6e\n",
                error.mse, error.relmse, error.relmse_trimmed, error.mse_reinhard);
  out << line;
}

void say(std::ostream& log, const std::exception& error) {
  // One text, so that messages of several processes do not mix.
  log << "wfpg-render: " + reason_of(error) + '\n';
}

/// Writes all requested files, even if some fail, and reports failures. Rendering takes long, so no result is
/// lost.
bool write_all(const arguments& given, const render_result& result, const std::optional<image>& reference,
               std::ostream& out, std::ostream& log) {
  bool is_written = true;
  const auto attempt = [&](const auto& write) {
    try {
      write();
    } catch (const std::exception& error) {
      say(log, error);
      is_written = false;
    }
  };
  if (!given.output.empty()) attempt([&] { write_exr(given.output, result.picture); });
  if (!given.png.empty()) attempt([&] { write_png(given.png, result.picture, given.exposure); });
  for (const technique_images& found : result.by_technique) {
    attempt([&] { write_exr(technique_file(given, found.by), found.weighted); });
    attempt([&] { write_exr(technique_file(given, found.by, plain_end), found.plain); });
  }
  if (!given.save_guide.empty()) attempt([&] { write_file(given.save_guide, result.guide); });
  attempt([&] { save_state(given, result, log); });
  std::optional<image_error> error;
  if (reference) error = compare(result.picture, *reference);
  if (error) print_error(*error, out);
  if (!given.stats.empty()) attempt([&] { write_stats(given.stats, result.report, error); });
  return is_written;
}

/// The picture that the rendering is compared with, if any. Throws std::invalid_argument if its size differs.
std::optional<image> reference_of(const arguments& given, const scene& scene) {
  if (given.reference.empty()) return std::nullopt;
  const render_options options = completed(scene, given.options);
  return read_reference(given.reference, options.width, options.height);
}

/// Fog without end leaves nothing of light that is infinitely far.
void warn_of_far_lights(const scene& scene, std::ostream& log) {
  const bool has_far_lights =
      scene.environment != vec3(0.0f) || !scene.sky.texels.empty() ||
      std::any_of(scene.punctual_lights.begin(), scene.punctual_lights.end(),
                  [](const punctual_light& l) { return l.kind == punctual_kind::directional; });
  if (has_far_lights && scene.fog.extinction() != vec3(0.0f))
    log << "wfpg-render: warning: the environment and directional lights do not shine through fog\n";
}

/// Throws std::invalid_argument where each process of mpirun would render the whole picture.
void require_shared_processes(const render_options& options) {
  const int started = started_processes();
  if (started <= 1 || (options.split && options.devices.size() <= 1)) return;
  const std::string found = std::to_string(started) + " processes were started, as by mpirun, and each ";
  if (options.devices.size() > 1)
    throw std::invalid_argument(
        found +
        "would render on several GPUs; start one process, or set CUDA_VISIBLE_DEVICES for each and leave "
        "the numbers out of --device");
  throw std::invalid_argument(found +
                              "would render the whole picture; add --split tiles or --split samples, or "
                              "start one process");
}

int render_scene(arguments& given, std::ostream& out, std::ostream& log) {
  // Of several ranks, the first writes all files.
  const bool writes = !given.options.ranks || given.options.ranks->rank() == 0;
  if (writes) check_files(given);
  scene scene = load_scene(given.scene, given.options, "wfpg-render", log);
  if (given.fog > 0.0f) scene.fog = {vec3(0.0f), vec3(given.fog), 0.0f};
  warn_of_far_lights(scene, log);
  const std::optional<image> reference = reference_of(given, scene);

  given.options.technique_pictures = !given.technique_pictures.empty();
  given.options.keep_guide = !given.save_guide.empty();
  given.options.keep_state = !given.save_state.empty() || !given.options.resume.empty();
  given.options.is_stopped = is_interrupted;
  note_interruptions();
  progress_bar bar;
  const render_result result = render(scene, given.options, [&](const render_progress& p) {
    if (writes) bar.show(p);
  });
  bar.finish();
  if (result.report.dropped_light_vertices > 0)
    log << "wfpg-render: warning: " << result.report.dropped_light_vertices
        << " vertices and beams of light paths had no memory, and their light is missing; raise "
           "--light-memory\n";
  if (result.report.surplus_beams > 0)
    log << "wfpg-render: warning: " << result.report.surplus_beams
        << " photon beams are missing, since segments of light paths cross more than "
        << wfpg::bidirectional_options().segment_beams << " media; leave bb1d out of --techniques\n";
  if (writes && !write_all(given, result, reference, out, log)) return failure;
  return result.is_stopped ? interrupted : 0;
}

}  // namespace

int run_program(int argc, const char* const* argv, std::ostream& out, std::ostream& log) {
  arguments given;
  CLI::App app{"Renders a scene by wavefront path tracing, with or without path guiding."};
  report_in_one_line(app, "wfpg-render");
  add_scene_options(app, given.scene);
  add_fog_option(app, given);
  add_file_options(app, given);
  add_state_options(app, given);
  add_method_options(app, given.options);
  add_bidirectional_options(app, given.options);
  add_device_option(app, given.options);
  add_rank_options(app, given.options);
  add_nee_option(app, given.options);
  add_budget_options(app, given.options);
  add_picture_options(app, given.options);
  add_guider_options(app, given.options);
  try {
    app.parse(argc, argv);
    if (given.output.empty() && given.png.empty() && given.stats.empty() && given.reference.empty() &&
        given.save_guide.empty() && given.save_state.empty() && given.technique_pictures.empty())
      throw CLI::RequiredError(
          "one of -o, --png, --stats, --reference, --technique-pictures, --save-guide, --save-state");
    check_render_options(app, given.options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, out, log) == 0 ? 0 : failure;
  }
  std::optional<processes> joined;
  try {
    require_shared_processes(given.options);
    // Several GPUs are threads of this process, which mpirun has not started.
    if (!given.options.split || given.options.devices.size() > 1) return render_scene(given, out, log);
    // A process that cannot join the others ends them, too.
    given.options.ranks = &joined.emplace().join(given.options.rank_seconds);
    std::ostream none(nullptr);
    const bool is_first = given.options.ranks->rank() == 0;
    if (is_first && given.options.ranks->size() > 1)
      log << "wfpg-render: " << given.options.ranks->size() << " processes share the picture" << std::endl;
    return render_scene(given, is_first ? out : none, is_first ? log : none);
  } catch (const std::exception& error) {
    say(log, error);
    if (joined) joined->abort(failure);
    return failure;
  }
}

}  // namespace render
