// Single samples, and the ways to combine them (paper, section 3.7 and figure 5). They show how a guide
// learns.
#pragma once

#include "reference.hpp"
#include "runner.hpp"

#include <map>
#include <string>
#include <vector>

namespace quality {

/// Errors after 1, 2, 3, ... samples.
struct error_series {
  std::map<std::string, std::vector<double>> by_measure;
};

struct single_samples {
  error_series alone;                            ///< of each sample's own picture: its variance
  std::map<std::string, error_series> combined;  ///< by name of the combination; empty for path tracing
};

json to_json(const single_samples& samples);
/// Throws nlohmann::json::exception if something is missing.
single_samples single_samples_from_json(const json& object);

planned_run plan_single_samples(const scene_choice& scene, const std::string& identity, const method& sampled,
                                int samples, int seed, const std::string& reference_hash);

/// Renders the samples, guided from the first one on. A guided method renders again with an unguided first
/// sample. Combinations are sums of these pictures.
single_samples measure_single_samples(const render::scene& scene, const render::render_options& options,
                                      const render::image& reference);

/// The mean over seeds, at least one. All must have equal length.
single_samples mean_of(const std::vector<single_samples>& seeds);

}  // namespace quality
