// Tests that docs/tuning.md has the library's defaults. The page, the library and --help share one table.
#include "support/catch.hpp"

#include <wfpg/guides/octree/options.hpp>
#include <wfpg/guides/records/options.hpp>
#include <wfpg/guides/sarsa/options.hpp>
#include <wfpg/light/bidirectional_options.hpp>
#include <wfpg/octree/fragments_from_caster.hpp>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

/// An option's default as the page writes it.
struct option_default {
  std::string section, name, value;
};

template <class T>
std::string text_of(const T& value) {
  std::ostringstream out;
  out << value;
  return out.str();
}
std::string text_of(bool value) {
  return value ? "true" : "false";
}
std::string mebibytes(std::size_t bytes) {
  return text_of(bytes >> 20) + " MiB";
}

std::vector<option_default> defaults() {
  const wfpg::sampling_options every;
  const wfpg::octree_guide_options octree;
  const wfpg::caster_fragments_options cast;
  const wfpg::kept_field_options kept;
  const wfpg::transient_guide_options transient;
  const wfpg::sarsa_grid_options sarsa;
  const wfpg::irradiance_records_options records;
  const wfpg::bidirectional_options light;
  const std::string both = "Both octree guides", grid = "A SARSA grid", irradiance = "Irradiance records",
                    lights = "Choices of lights", all = "Every guide", paths = "Light paths";
  return {{all, "max_paths", text_of(every.max_paths)},
          {all, "max_depth", text_of(every.max_depth)},
          {all, "max_rays", every.max_rays ? "" : "unset"},
          {all, "include_emission", text_of(every.include_emission)},
          {all, "seed", text_of(every.seed)},
          {all, "unguided_samples", text_of(every.unguided_samples)},
          {all, "guide_fraction", every.guide_fraction ? "" : "unset"},
          {all, "guided_depths", every.guided_depths == 0xffffffffu ? "all" : ""},
          {all, "records_waves", text_of(every.records_waves)},
          {all, "silent_escapes", text_of(every.silent_escapes)},
          {both, "octree_resolution", text_of(octree.octree_resolution)},
          {both, "mode", octree.mode == wfpg::guiding_mode::oriented ? "`oriented`" : ""},
          {both, "binning.min_level", text_of(octree.binning.min_level)},
          {both, "binning.rays_per_bin", text_of(octree.binning.rays_per_bin)},
          {both, "product_resolution", octree.product_resolution ? "" : "unset"},
          {both, "deposits_per_leaf", text_of(*octree.deposits_per_leaf)},
          {both, "deposit_capacity", octree.deposit_capacity ? "" : "unset"},
          {both, "caster_buffer_bytes", mebibytes(octree.caster_buffer_bytes)},
          {both, "scene_tag", text_of(octree.scene_tag)},
          {both, "rays", cast.rays ? "" : "unset"},
          {both, "rounds", text_of(cast.rounds)},
          {both, "crossings", text_of(cast.crossings)},
          {both, "filter_alpha", text_of(octree.field.filter_alpha)},
          {both, "floor", text_of(octree.field.floor)},
          {both, "absolute_floor", text_of(octree.field.absolute_floor)},
          {"Kept fields", "budget_bytes", mebibytes(kept.budget_bytes)},
          {"Kept fields", "resolution", text_of(kept.resolution)},
          {"Kept fields", "recast", text_of(kept.recast)},
          {"Kept fields", "learn", text_of(kept.learn)},
          {"Kept fields", "cone_samples", text_of(kept.cone_samples)},
          {"Kept fields", "idle_samples", text_of(kept.idle_samples)},
          {"Transient fields", "field_resolution", text_of(transient.field_resolution)},
          {"Transient fields", "min_field_resolution", text_of(transient.min_field_resolution)},
          {lights, "resolution", text_of(octree.lights.resolution)},
          {lights, "floor", text_of(octree.lights.floor)},
          {grid, "resolution", text_of(sarsa.resolution)},
          {grid, "direction_resolution", text_of(sarsa.direction_resolution)},
          {grid, "normal_resolution", text_of(sarsa.normal_resolution)},
          {grid, "step", text_of(sarsa.step)},
          {grid, "learning_rate", text_of(sarsa.learning_rate)},
          {grid, "floor", text_of(sarsa.floor)},
          {grid, "values_per_direction", text_of(*sarsa.values_per_direction)},
          {irradiance, "octree_resolution", text_of(records.octree_resolution)},
          {irradiance, "record_level", text_of(records.record_level)},
          {irradiance, "emitter_rays", records.emitter_rays == 1u << 18 ? "2¹⁸" : ""},
          {irradiance, "cones_per_direction", text_of(records.cones_per_direction)},
          {irradiance, "albedo", text_of(records.albedo)},
          {paths, "max_vertices", text_of(light.max_vertices)},
          {paths, "max_beams", text_of(light.max_beams)},
          {paths, "segment_beams", text_of(light.segment_beams)},
          {paths, "budget_bytes", light.budget_bytes == std::size_t(4) << 30 ? "4 GiB" : ""},
          {paths, "surface_points", text_of(light.surface_points)},
          {paths, "beams", text_of(light.beams)},
          {paths, "surface_radius", text_of(light.surface_radius)},
          {paths, "volume_radius", text_of(light.volume_radius)},
          {paths, "radius_alpha", text_of(light.radius_alpha)},
          {paths, "dense_photons", text_of(light.dense_photons)},
          {paths, "beam_paths", light.beam_paths ? "" : "unset"},
          {paths, "beam_point_paths", light.beam_point_paths ? "" : "unset"}};
}

/// The page's row of an option in a section. Empty if there is none.
std::string row_of(const std::string& page, const option_default& option) {
  const std::size_t begin = page.find("\n## " + option.section + "\n");
  if (begin == std::string::npos) return "";
  const std::string section = page.substr(begin, page.find("\n## ", begin + 1) - begin);
  const std::size_t row = section.find("\n| `" + option.name + "` | ");
  return row == std::string::npos ? "" : section.substr(row + 1, section.find('\n', row + 1) - row - 1);
}

}  // namespace

TEST_CASE("docs/tuning.md has the library's defaults", "[pages]") {
  std::ifstream in(WFPG_TUNING_PAGE);
  std::stringstream page;
  page << in.rdbuf();
  REQUIRE(page.str().size() > 1000);
  for (const option_default& option : defaults()) {
    INFO(option.section << ": " << option.name << " is " << option.value
                        << "; the row: " << row_of(page.str(), option));
    CHECK(row_of(page.str(), option).find("| `" + option.name + "` | " + option.value) == 0);
  }
}
