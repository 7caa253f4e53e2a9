// One scene, planned and measured: its reference, its renderings, their errors, pictures and plots.
#pragma once

#include "reference.hpp"
#include "runner.hpp"
#include "settings.hpp"

#include <vector>

namespace quality {

/// A rendering and its place among methods, budgets and seeds.
struct planned_measurement {
  planned_run run;
  std::size_t method = 0, budget = 0;
  int seed = 0;
};

struct scene_plan {
  scene_choice scene;
  std::string identity;
  reference_plan reference;
  std::vector<planned_measurement> runs;
  std::vector<planned_measurement> single_samples;  ///< budget is not used

  /// In the order in which they are done.
  std::vector<planned_run> all() const;
};

/// `scene` is complete. Throws std::invalid_argument where a crop is not within its pictures.
scene_plan plan_scene(const settings& given, const scene_choice& scene);

/// Does what is planned, writes pictures and plots to the output directory, and returns what results.json
/// says of the scene. Throws what rendering and writing throw.
json measure_scene(const settings& given, const scene_plan& plan, runner& runs);

}  // namespace quality
