// From arguments to files.
#include "program.hpp"

#include "app/output_files.hpp"
#include "comparison.hpp"
#include "markdown.hpp"
#include "scene/builtin_scenes.hpp"
#include "summary.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <ostream>

namespace quality {
namespace {

constexpr int failure = 2;

/// Renders a tiny picture by each method. This finds invalid options or devices before hours of work.
void try_methods(const settings& given) {
  const render::scene furnace = render::make_builtin_scene("furnace");
  for (const method& sampled : given.methods) {
    render::render_options options = options_of(given.scenes.front(), sampled);
    options.width = options.height = 4;
    options.spp = 2;
    for (const budget& allowed : given.budgets)
      if (allowed.spp > 0) options.spp = std::min(options.spp, allowed.spp);
    try {
      render::render(furnace, options, {});
    } catch (const std::exception& error) {
      throw std::invalid_argument("method " + sampled.name + ": " + error.what());
    }
  }
}

std::vector<scene_plan> plan_scenes(const settings& given, std::ostream& log) {
  std::vector<scene_plan> plans;
  for (const scene_choice& scene : given.scenes)
    plans.push_back(plan_scene(given, completed(scene, load(scene), log)));
  return plans;
}

json describe(const settings& given) {
  bool with_gpu = false;
  json methods = json::array();
  for (const method& m : given.methods) {
    methods.push_back({{"name", m.name}, {"arguments", m.arguments}});
    with_gpu = with_gpu || is_on_gpu(options_of(given.scenes.front(), m).where);
  }
  return {{"command", given.command},  {"version", version()},
          {"program", program_hash()}, {"machine", machine(with_gpu)},
          {"preset", given.preset},    {"seeds", given.seeds},
          {"methods", methods},        {"baseline", given.methods[baseline_of(given.methods)].name},
          {"scenes", json::array()}};
}

void write_results(const settings& given, const json& results) {
  render::write_file((given.output / "results.json").string(), results.dump(1) + "\n");
  render::write_file((given.output / "results.md").string(), markdown_of(results));
}

void measure_all(const settings& given, std::ostream& log) {
  render::prepare_folder("--output", given.output);
  render::check_outputs({{"--output", (given.output / "results.json").string(), ""},
                         {"--output", (given.output / "results.md").string(), ""}});
  const run_cache cache(given.cache, log);
  try_methods(given);
  const std::vector<scene_plan> plans = plan_scenes(given, log);
  std::vector<planned_run> all;
  for (const scene_plan& plan : plans)
    for (planned_run& run : plan.all()) all.push_back(std::move(run));
  run_progress progress(all, cache, log);
  runner runs(cache, progress);
  json results = describe(given);
  bool has_flip = true;
  for (const scene_plan& plan : plans) {
    results["scenes"].push_back(measure_scene(given, plan, runs));
    has_flip = has_flip && !results["scenes"].back()["reference"]["flip_noise"].is_null();
    write_results(given, results);
  }
  if (!has_flip)
    log << "wfpg-quality: without HDR-FLIP, for which python3 needs two packages: "
           "pip install flip-evaluator numpy\n";
  log << "wfpg-quality: " << (given.output / "results.md").string() << '\n';
}

}  // namespace

int run_program(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& log) {
  try {
    if (const std::optional<settings> given = parse_settings(arguments, out)) measure_all(*given, log);
  } catch (const std::exception& error) {
    log << "wfpg-quality: " << render::reason_of(error) << '\n';
    return failure;
  }
  return 0;
}

}  // namespace quality
