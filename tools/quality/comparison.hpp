// Plans and measures one scene: its reference, renderings, errors, pictures and plots.
#pragma once

#include "reference.hpp"
#include "runner.hpp"
#include "settings.hpp"

#include <vector>

namespace quality {

/// A rendering and its indices of method, budget and seed.
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
  std::vector<planned_measurement> single_samples;  ///< the budget is unused

  /// All renderings in the order of work.
  std::vector<planned_run> all() const;
};

/// `scene` must be complete. Throws std::invalid_argument if a crop exceeds its pictures.
scene_plan plan_scene(const settings& given, const scene_choice& scene);

/// Executes the plan, writes pictures and plots to the output directory, and returns the scene's part of
/// results.json. Throws what rendering and writing throw.
json measure_scene(const settings& given, const scene_plan& plan, runner& runs);

}  // namespace quality
