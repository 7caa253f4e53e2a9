// Planned and finished renderings. Each is looked up in the cache before it is rendered.
#pragma once

#include "app/metrics.hpp"
#include "cache.hpp"
#include "scenes.hpp"
#include "settings.hpp"

#include <cstdint>
#include <vector>

namespace quality {

/// A planned rendering: its options and its names.
struct planned_run {
  run_key key;
  std::string title;  ///< such as "ajar, wfpg, 64 samples, seed 1"
  std::string rate;   ///< renderings of one rate take equal times for each sample of a pixel
  render::render_options options;
};

/// The error of a picture after some of its samples.
struct error_point {
  int samples = 0;
  double seconds = 0.0;
  render::image_error error;
};

/// The cost of a rendering. Memory and cones are the guide's.
struct run_cost {
  int samples = 0;
  double seconds = 0.0;        ///< of samples
  double total_seconds = 0.0;  ///< of samples and building
  std::uint64_t segments = 0;
  std::size_t persistent_bytes = 0;
  std::size_t used_bytes = 0;  ///< of them
  std::size_t transient_bytes = 0;
  double cones_per_segment = 0.0;
  double light_hits_per_path = 0.0;  ///< segments that ended at a light
};

/// A measured rendering. Its errors include the reference's noise.
struct run_record {
  std::vector<error_point> points;  ///< after 1, 2, 4, ... samples and the last
  run_cost cost;
};

json to_json(const run_record& record);
/// Throws nlohmann::json::exception if something is missing.
run_record record_from_json(const json& object);

/// The part of the key that all renderings of a scene share.
json key_of_scene(const scene_choice& scene, const std::string& identity);

/// A rendering that is measured against the reference of this hash. `seed` counts from 1, after the method's
/// own.
planned_run plan_run(const scene_choice& scene, const std::string& identity, const method& sampled,
                     const budget& allowed, int seed, const std::string& reference_hash);

bool is_on_gpu(render::device where);

/// Adds to a measured rendering's key what its times depend on, besides the options.
void add_program_and_machine(json& key, render::device where);

/// Compares every checkpoint with the reference.
run_record measured(const render::render_result& result, const render::image& reference);

}  // namespace quality
