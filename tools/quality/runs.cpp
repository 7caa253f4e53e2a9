// Keys of renderings, and their records as JSON.
#include "runs.hpp"

#include "app/stats_json.hpp"

#include <limits>

namespace quality {
namespace {

constexpr int format = 1;  // version of the cache's content

/// JSON has null for infinity.
double number_of(const json& value) {
  return value.is_null() ? std::numeric_limits<double>::infinity() : value.get<double>();
}

render::image_error error_from_json(const json& object) {
  render::image_error error;
  error.mse = number_of(object.at("mse"));
  error.relmse = number_of(object.at("relmse"));
  error.relmse_trimmed = number_of(object.at("relmse_trimmed"));
  error.relmse_robust = number_of(object.at("relmse_robust"));
  error.worst_share = number_of(object.at("worst_share"));
  error.mse_reinhard = number_of(object.at("mse_reinhard"));
  error.mae = number_of(object.at("mae"));
  error.smape = number_of(object.at("smape"));
  error.non_finite = object.at("non_finite").get<std::size_t>();
  return error;
}

}  // namespace

bool is_on_gpu(render::device where) {
  return where == render::device::cuda || where == render::device::optix;
}

json to_json(const run_record& record) {
  json points = json::array();
  for (const error_point& p : record.points)
    points.push_back({{"samples", p.samples}, {"seconds", p.seconds}, {"error", render::to_json(p.error)}});
  const run_cost& cost = record.cost;
  return {{"samples", cost.samples},
          {"seconds", cost.seconds},
          {"total_seconds", cost.total_seconds},
          {"segments", cost.segments},
          {"persistent_bytes", cost.persistent_bytes},
          {"used_bytes", cost.used_bytes},
          {"transient_bytes", cost.transient_bytes},
          {"cones_per_segment", cost.cones_per_segment},
          {"light_hits_per_path", cost.light_hits_per_path},
          {"points", points}};
}

run_record record_from_json(const json& object) {
  run_record record;
  for (const json& p : object.at("points"))
    record.points.push_back(
        {p.at("samples").get<int>(), p.at("seconds").get<double>(), error_from_json(p.at("error"))});
  run_cost& cost = record.cost;
  cost.samples = object.at("samples").get<int>();
  cost.seconds = object.at("seconds").get<double>();
  cost.total_seconds = object.at("total_seconds").get<double>();
  cost.segments = object.at("segments").get<std::uint64_t>();
  cost.persistent_bytes = object.at("persistent_bytes").get<std::size_t>();
  cost.used_bytes = object.at("used_bytes").get<std::size_t>();
  cost.transient_bytes = object.at("transient_bytes").get<std::size_t>();
  cost.cones_per_segment = object.at("cones_per_segment").get<double>();
  cost.light_hits_per_path = object.at("light_hits_per_path").get<double>();
  return record;
}

json key_of_scene(const scene_choice& scene, const std::string& identity) {
  json key{{"format", format},
           {"scene", identity},
           {"width", scene.options.width},
           {"height", scene.options.height},
           {"max_depth", scene.options.max_depth},
           {"nee", scene.options.nee}};
  // References from before this option existed keep their keys.
  if (scene.options.roulette_depth != render::render_options().roulette_depth)
    key["roulette_depth"] = scene.options.roulette_depth;
  return key;
}

void add_program_and_machine(json& key, render::device where) {
  key["device"] = static_cast<int>(where);
  key["program"] = program_hash();
  key["machine"] = machine(is_on_gpu(where));
}

planned_run plan_run(const scene_choice& scene, const std::string& identity, const method& sampled,
                     const budget& allowed, int seed, const std::string& reference_hash) {
  planned_run run;
  run.options = options_of(scene, sampled);
  run.options.spp = allowed.spp;
  run.options.seconds = allowed.seconds;
  run.options.seed += static_cast<std::uint64_t>(seed);
  run.options.checkpoints = render::checkpoint_times::powers_of_two;
  run.title = scene.title + ", " + sampled.name + ", " + title_of(allowed) + ", seed " + std::to_string(seed);
  run.rate = scene.title + ", " + sampled.name;
  run.key.label =
      file_name_of(scene.title + "-" + sampled.name + "-" + title_of(allowed) + "-" + std::to_string(seed));
  json& key = run.key.content = key_of_scene(scene, identity);
  key["reference"] = reference_hash;
  key["method"] = sampled.arguments;
  key["spp"] = allowed.spp;
  key["seconds"] = allowed.seconds;
  key["seed"] = seed;
  add_program_and_machine(key, run.options.where);
  return run;
}

run_record measured(const render::render_result& result, const render::image& reference) {
  run_record record;
  for (const render::checkpoint& at : result.checkpoints)
    record.points.push_back({at.samples, at.seconds, render::compare(at.picture, reference)});
  const render::render_report& report = result.report;
  record.cost = {report.spp,
                 record.points.back().seconds,
                 report.total_seconds,
                 report.segments,
                 report.persistent_bytes,
                 report.used_bytes,
                 report.transient_bytes,
                 report.cones_per_segment,
                 report.light_hits_per_path};
  return record;
}

}  // namespace quality
