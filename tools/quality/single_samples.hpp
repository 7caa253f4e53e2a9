// Each sample alone, and the ways to combine them (paper, section 3.7 and figure 5): how a guide learns.
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
  std::map<std::string, error_series> combined;  ///< by the name of the combination; empty of path tracing
};

json to_json(const single_samples& samples);
/// Throws nlohmann::json::exception where something is missing.
single_samples single_samples_from_json(const json& object);

planned_run plan_single_samples(const scene_choice& scene, const std::string& identity, const method& sampled,
                                int samples, int seed, const std::string& reference_hash);

/// Renders the samples once guided from the first one on and, where there is guiding, once with a first one
/// that is not; combinations are sums of these pictures.
single_samples measure_single_samples(const render::scene& scene, const render::render_options& options,
                                      const render::image& reference);

/// The mean over seeds, of which there is one at least and which are of equal length.
single_samples mean_of(const std::vector<single_samples>& seeds);

}  // namespace quality
