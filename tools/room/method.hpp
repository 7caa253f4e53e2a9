// Shared by the program's methods: their settings, and the measures of what they learnt.
#pragma once

#include "places.hpp"

#include <wfpg/guides/octree/options.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace room {

/// How methods learn.
struct settings {
  std::uint32_t samples = 16;     ///< samples that train a method
  std::size_t paths = 1u << 18;   ///< paths of a sample, each of one direction
  std::uint32_t resolution = 24;  ///< its square bounds the numbers of all designs but wfpg's fields
  /// F: cells along the side of wfpg's fields.
  std::uint32_t slot_resolution = wfpg::kept_field_options().resolution;
  /// Of wfpg's kept fields.
  double budget_mib = static_cast<double>(wfpg::kept_field_options().budget_bytes) / (1u << 20);
  float filter_alpha = wfpg::field_options().filter_alpha;  ///< of wfpg's fields, in cells
  float floor = wfpg::field_options().floor;                ///< of wfpg's fields and exact cells, of the mean
  std::size_t samples_a_leaf = 32000;                       ///< of Open PGL
};

/// Measures of a method that has learnt one arrangement.
struct outcome {
  variances at_places;
  std::size_t unguided = 0;  ///< places that it does not guide
  std::size_t bytes = 0;     ///< of what it learnt; 0: not known
};

/// Names of Open PGL's distributions, as arguments of the program.
inline const std::vector<std::string> openpgl_names{"openpgl-pavmm", "openpgl-vmm", "openpgl-quadtree"};

/// Trains a field of Open PGL and measures it. `name`: one of openpgl_names.
/// Throws std::runtime_error in programs that were built without Open PGL.
outcome measure_openpgl(const std::string& name, const settings& set, const wall_light& light,
                        const std::vector<wall_point>& places);

}  // namespace room
