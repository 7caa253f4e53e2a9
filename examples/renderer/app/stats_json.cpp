// Converts reports to JSON.
#include "app/stats_json.hpp"

#include "app/output_files.hpp"

#include <nlohmann/json.hpp>

namespace render {
namespace {

using json = nlohmann::ordered_json;

json seconds_of(const render_report& report) {
  json seconds{{"total", report.total_seconds}};
  for (const auto& [stage, value] : report.seconds) seconds[stage] = value;
  return seconds;
}

json memory_of(const render_report& report) {
  json memory = json::object();
  for (const auto& [part, bytes] : report.memory) memory[part] = bytes;
  memory["persistent"] = report.persistent_bytes;
  memory["used"] = report.used_bytes;
  memory["transient"] = report.transient_bytes;
  return memory;
}

json octree_of(const octree_report& octree) {
  return {{"resolution", octree.resolution},
          {"nodes", octree.nodes},
          {"leaves", octree.leaves},
          {"bytes_per_node", octree.bytes_per_node},
          {"build_seconds", octree.build_seconds}};
}

json slots_of(const slot_report& slots) {
  return {{"capacity", slots.capacity},      {"live", slots.live},
          {"live_bytes", slots.live_bytes},  {"born_per_sample", slots.allocated},
          {"freed_per_sample", slots.freed}, {"refreshed_per_sample", slots.refreshed}};
}

json rest_of(const rest_report& rest) {
  const wfpg::guiding_gain& gain = rest.gain;
  json result{{"samples", rest.rested},
              {"compared_paths", gain.paths},
              {"unguided_mean", gain.unguided_mean},
              {"guided_mean", gain.guided_mean},
              {"unguided_variance", gain.unguided_variance},
              {"guided_variance", gain.guided_variance},
              {"unguided_vertices", gain.unguided_vertices},
              {"guided_vertices", gain.guided_vertices},
              {"noise", gain.paths > 0 ? json(gain.noise()) : json(nullptr)},
              {"gain", nullptr},
              {"gain_error", nullptr}};
  if (!gain.is_known()) return result;
  result["gain"] = gain.typical_value();
  result["gain_error"] = gain.typical_error;
  return result;
}

json records_of(const records_report& records) {
  return {{"builds", records.builds},   {"build_seconds", records.build_seconds},
          {"rays", records.rays},       {"cones", records.cones},
          {"records", records.records}, {"objects", records.objects},
          {"lights", records.lights},   {"directly_lit", records.directly_lit}};
}

}  // namespace

json to_json(const image_error& error) {
  return {{"mse", error.mse},
          {"relmse", error.relmse},
          {"relmse_trimmed", error.relmse_trimmed},
          {"relmse_robust", error.relmse_robust},
          {"worst_share", error.worst_share},
          {"mse_reinhard", error.mse_reinhard},
          {"mae", error.mae},
          {"smape", error.smape},
          {"non_finite", error.non_finite}};
}

void write_stats(const std::string& path, const render_report& report,
                 const std::optional<image_error>& error) {
  json stats{
      {"scene", report.scene}, {"method", report.method}, {"device", report.device}, {"spp", report.spp}};
  stats["segments"] = report.segments;
  stats["light_hits_per_path"] = report.light_hits_per_path;
  stats["seconds"] = seconds_of(report);
  stats["memory"] = memory_of(report);
  stats["octree"] = octree_of(report.octree);
  stats["bins"] = json::array();
  for (const bin_report& depth : report.bins)
    stats["bins"].push_back({{"count", depth.count}, {"mean_rays", depth.mean_rays}});
  if (report.slots.capacity > 0) stats["slots"] = slots_of(report.slots);
  if (report.octree.nodes > 0) stats["rest"] = rest_of(report.rest);
  if (report.records.builds > 0) stats["records"] = records_of(report.records);
  if (report.light_vertex_bytes > 0)
    stats["light_vertices"] = {{"bytes", report.light_vertex_bytes},
                               {"dropped", report.dropped_light_vertices},
                               {"surplus_beams", report.surplus_beams}};
  if (report.regions > 0) stats["regions"] = report.regions;
  stats["cones_per_segment"] = report.cones_per_segment;
  if (error) stats["error"] = to_json(*error);

  write_file(path, stats.dump(2) + '\n');
}

}  // namespace render
