// Copies a guider's statistics into a render_report.
#pragma once

#include "app/render.hpp"

#include <wfpg/guides/records/irradiance_records.hpp>
#include <wfpg/path_guider.hpp>

#include <algorithm>
#include <string>

namespace render {

/// Memory and time by stage, which every guide reports.
template <class Exec, class Guide>
void report_any_guider(const wfpg::path_guider<Exec, Guide>& guider, render_report& report) {
  const wfpg::memory_report memory = guider.memory();
  report.persistent_bytes = report.used_bytes = memory.persistent();
  report.transient_bytes = memory.transient();
  for (const wfpg::memory_part& part : memory.parts) report.memory.emplace_back(part.name, part.bytes);
  for (const auto& [stage, seconds] : guider.statistics().seconds)
    report.seconds.emplace_back("guide " + std::string(stage), seconds);
}

/// Numbers of irradiance records, from the last build.
template <class Exec, class Smooth>
void report_records(const wfpg::path_guider<Exec, wfpg::irradiance_records<Exec, Smooth>>& guider,
                    std::uint64_t segments, render_report& report) {
  report_any_guider(guider, report);
  const wfpg::irradiance_records_statistics& found = guider.guide().statistics();
  report.records = {found.builds,  found.seconds, found.rays,   found.cones,
                    found.records, found.objects, found.lights, found.directly_lit};
  if (segments > 0)
    report.cones_per_segment = static_cast<double>(found.cones) / static_cast<double>(segments);
}

/// Subtracts statistics of an earlier time from `counted`.
inline void subtract(wfpg::guider_statistics& counted, const wfpg::guider_statistics& before) {
  counted.guided_samples -= before.guided_samples;
  counted.rested_samples -= before.rested_samples;
  for (std::size_t depth = 0; depth < before.depths.size(); ++depth) {
    counted.depths[depth].bins -= before.depths[depth].bins;
    counted.depths[depth].rays -= before.depths[depth].rays;
    counted.depths[depth].cones -= before.depths[depth].cones;
  }
  counted.kept.allocated -= before.kept.allocated;
  counted.kept.freed -= before.kept.freed;
  counted.kept.refreshed -= before.kept.refreshed;
}

/// Numbers of the octree's guides. `segments` are rays that extended paths in all samples, since the
/// statistics `before`.
template <class Exec, class Guide>
void report_guider(const wfpg::path_guider<Exec, Guide>& guider, std::uint64_t segments,
                   render_report& report, const wfpg::guider_statistics& before = {}) {
  report_any_guider(guider, report);
  const wfpg::memory_report memory = guider.memory();

  const wfpg::sparse_voxel_octree<Exec>& octree = guider.guide().octree();
  report.octree.resolution = octree.resolution();
  report.octree.nodes = octree.node_count();
  report.octree.leaves = octree.leaf_count();
  double node_bytes = 0.0;
  for (const wfpg::memory_part& part : memory.parts)
    if (part.name == std::string("octree") || part.name == std::string("cache"))
      node_bytes += static_cast<double>(part.bytes);
  if (octree.node_count() > 0)
    report.octree.bytes_per_node = node_bytes / static_cast<double>(octree.node_count());

  wfpg::guider_statistics statistics = guider.statistics();
  subtract(statistics, before);
  const double samples = std::max(1.0, static_cast<double>(statistics.guided_samples));
  double cones = 0.0;
  for (const wfpg::depth_statistics& depth : statistics.depths) {
    cones += static_cast<double>(depth.cones);
    const double bins = static_cast<double>(depth.bins);
    report.bins.push_back({bins / samples, bins > 0.0 ? static_cast<double>(depth.rays) / bins : 0.0});
  }
  report.rest.rested = statistics.rested_samples;
  report.rest.gain = statistics.gain;
  const wfpg::kept_field_statistics& kept = statistics.kept;
  report.slots.capacity = kept.capacity;
  report.slots.live = kept.live;
  report.slots.live_bytes = kept.live * kept.bytes_a_slot;
  report.used_bytes = report.persistent_bytes - (kept.capacity - kept.live) * kept.bytes_a_slot;
  report.slots.allocated = static_cast<double>(kept.allocated) / samples;
  report.slots.freed = static_cast<double>(kept.freed) / samples;
  report.slots.refreshed = static_cast<double>(kept.refreshed) / samples;
  if (segments > 0) report.cones_per_segment = cones / static_cast<double>(segments);
}

}  // namespace render
