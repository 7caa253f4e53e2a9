// Plans and measures a scene.
#include "comparison.hpp"

#include "app/stats_json.hpp"
#include "flip.hpp"
#include "scene_files.hpp"
#include "single_samples.hpp"
#include "summary.hpp"
#include "tiles.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace quality {
namespace {

namespace fs = std::filesystem;

measured_run measure_run(const planned_measurement& planned, const render::scene& scene,
                         const reference& truth, runner& runs) {
  measured_run result{
      planned.method, planned.budget, planned.seed, {}, runs.cache().picture_path(planned.run.key), {}};
  result.record = runs.get(
      planned.run,
      [&] {
        render::render_result rendering = render::render(scene, planned.run.options, {});
        return cache_entry{to_json(measured(rendering, truth.picture)), std::move(rendering.picture)};
      },
      [&](cache_entry& entry) {
        picture_of(entry, planned.run.options);
        return record_from_json(entry.result);
      });
  return result;
}

/// The mean over seeds, by method.
std::vector<single_samples> measure_single(const settings& given, const scene_plan& plan,
                                           const render::scene& scene, const reference& truth, runner& runs) {
  std::vector<std::vector<single_samples>> by_method(given.methods.size());
  for (const planned_measurement& planned : plan.single_samples)
    by_method[planned.method].push_back(runs.get(
        planned.run,
        [&] {
          return cache_entry{to_json(measure_single_samples(scene, planned.run.options, truth.picture)),
                             std::nullopt};
        },
        [&](cache_entry& entry) { return single_samples_from_json(entry.result); }));
  std::vector<single_samples> means;
  for (const std::vector<single_samples>& seeds : by_method)
    if (!seeds.empty()) means.push_back(mean_of(seeds));
  return means;
}

/// Adds the errors of all runs and returns that of the reference's halves. Nothing without HDR-FLIP.
std::optional<double> add_flip(std::vector<measured_run>& runs, const reference_files& files,
                               const fs::path& folder) {
  std::vector<std::pair<fs::path, fs::path>> pairs{{files.halves[0], files.halves[1]}};
  for (const measured_run& run : runs) pairs.emplace_back(files.picture, run.picture);
  const auto errors = flip_errors(pairs, folder);
  if (!errors) return std::nullopt;
  for (std::size_t i = 0; i < runs.size(); ++i) runs[i].flip = (*errors)[i + 1];
  return errors->front() ? std::optional<double>(*errors->front() / 2.0) : std::nullopt;
}

std::vector<std::vector<double>> tiles_by_seed(const std::vector<measured_run>& runs, std::size_t budget,
                                               std::size_t method) {
  std::vector<std::vector<double>> seeds;
  for (const measured_run& run : runs)
    if (run.budget == budget && run.method == method)
      seeds.push_back(tiles_of(render::read_exr(run.picture.string())));
  return seeds;
}

/// Adds to each method's summary whether its pictures have the baseline's mean.
void add_agreement(const settings& given, const std::vector<measured_run>& runs, json& summary) {
  if (given.seeds < least_seeds_for_tiles) return;
  for (std::size_t b = 0; b < given.budgets.size(); ++b) {
    const auto baseline = tiles_by_seed(runs, b, baseline_of(given.methods));
    for (std::size_t m = 0; m < given.methods.size(); ++m) {
      if (m == baseline_of(given.methods)) continue;
      const tile_agreement found = agreement_of(tiles_by_seed(runs, b, m), baseline);
      summary[b]["methods"][m]["tiles"] = {{"count", found.tiles},
                                           {"beyond_4", found.beyond_4},
                                           {"worst", found.worst},
                                           {"mean_square", found.mean_square}};
    }
  }
}

json runs_json(const settings& given, const std::vector<measured_run>& runs) {
  json list = json::array();
  for (const measured_run& run : runs) {
    json object{{"method", given.methods[run.method].name},
                {"budget", title_of(given.budgets[run.budget])},
                {"seed", run.seed},
                {"picture", fs::absolute(run.picture).string()},
                {"flip", run.flip ? json(*run.flip) : json()}};
    object.update(to_json(run.record));
    list.push_back(object);
  }
  return list;
}

json single_json(const settings& given, const std::vector<single_samples>& single) {
  json object = json::object();
  for (std::size_t m = 0; m < single.size(); ++m) object[given.methods[m].name] = to_json(single[m]);
  return object;
}

void check_crop(const settings& given, const scene_choice& scene) {
  if (!given.crop) return;
  const window& w = *given.crop;
  const render::render_options& options = scene.options;
  if (w.left + w.width > options.width || w.top + w.height > options.height)
    throw std::invalid_argument("--crop is not within the " + std::to_string(options.width) + " x " +
                                std::to_string(options.height) + " pixels of " + scene.title);
}

}  // namespace

std::vector<planned_run> scene_plan::all() const {
  std::vector<planned_run> result;
  for (const std::vector<planned_run>& half : reference.halves)
    result.insert(result.end(), half.begin(), half.end());
  for (const auto* const list : {&runs, &single_samples})
    for (const planned_measurement& planned : *list) result.push_back(planned.run);
  return result;
}

scene_plan plan_scene(const settings& given, const scene_choice& scene) {
  check_crop(given, scene);
  scene_plan plan{scene, identity_of(scene), {}, {}, {}};
  plan.reference = plan_reference(scene, plan.identity, given.reference_spp, given.reference_chunk);
  const std::string hash = plan.reference.hash();
  for (int seed = 1; seed <= given.seeds; ++seed)
    for (std::size_t b = 0; b < given.budgets.size(); ++b)
      for (std::size_t m = 0; m < given.methods.size(); ++m)
        plan.runs.push_back(
            {plan_run(scene, plan.identity, given.methods[m], given.budgets[b], seed, hash), m, b, seed});
  for (int seed = 1; given.per_sample > 0 && seed <= given.seeds; ++seed)
    for (std::size_t m = 0; m < given.methods.size(); ++m)
      plan.single_samples.push_back(
          {plan_single_samples(scene, plan.identity, given.methods[m], given.per_sample, seed, hash), m, 0,
           seed});
  return plan;
}

json measure_scene(const settings& given, const scene_plan& plan, runner& runs) {
  const render::scene scene = load(plan.scene);
  const reference truth = make_reference(plan.reference, scene, runs);
  std::vector<measured_run> measured;
  for (const planned_measurement& planned : plan.runs)
    measured.push_back(measure_run(planned, scene, truth, runs));
  const std::vector<single_samples> single = measure_single(given, plan, scene, truth, runs);

  const scene_files files(given, plan.scene, truth);
  reference_noise noise{truth.noise, add_flip(measured, files.reference(), given.output)};
  json summary = summary_of(given, measured, noise);
  add_agreement(given, measured, summary);
  const render::render_options& options = plan.scene.options;
  return {{"scene", plan.scene.title},
          {"identity", plan.identity},
          {"width", options.width},
          {"height", options.height},
          {"max_depth", options.max_depth},
          {"roulette_depth", options.roulette_depth},
          {"nee", options.nee},
          {"reference",
           {{"samples", given.reference_spp},
            {"noise", render::to_json(noise.error)},
            {"flip_noise", noise.flip ? json(*noise.flip) : json()}}},
          {"files", files.write(measured, single)},
          {"summary", summary},
          {"runs", runs_json(given, measured)},
          {"single_samples", single_json(given, single)}};
}

}  // namespace quality
