// The best that cells can do: a grid over each place's own hemisphere, with the exact light of each cell. It
// shows what a resolution can bring where nothing has to be learnt.
//
// Source of the second kind: Rath et al. 2020, "Variance-Aware Path Guiding".
//
// Memory: 8 F² bytes a place.
#pragma once

#include "method.hpp"

#include <cmath>

namespace room {

/// What a cell's probability is proportional to.
enum class cell_target {
  mean,                ///< the cell's irradiance
  root_of_mean_square  ///< the root of the integral of (L cos)², which has the least variance
};

/// The grid of one place.
class exact_cells {
 public:
  exact_cells(const settings& set, cell_target target, const wall_light& light, const wall_point& place)
      : side_(static_cast<int>(set.resolution)),
        basis_(normal_of(place.wall)),
        cells_(std::size_t(set.resolution) * set.resolution) {
    const bool squares = target == cell_target::root_of_mean_square;
    visit_parts(light, place, [&](const visible_part& part) {
      cells_[cell(part.direction)] += squares ? part.squares : part.irradiance;
    });
    double sum = 0.0;
    for (double& value : cells_) sum += value = squares ? std::sqrt(value) : value;
    const double floor = static_cast<double>(set.floor) * sum / static_cast<double>(cells_.size());
    total_ = sum + floor * static_cast<double>(cells_.size());
    for (double& value : cells_) value += floor;
  }

  float pdf(vec3 direction) const {
    const double solid_angle = 2.0 * static_cast<double>(wfpg::pi) / static_cast<double>(cells_.size());
    return static_cast<float>(cells_[cell(direction)] / total_ / solid_angle);
  }

 private:
  std::size_t cell(vec3 direction) const {
    const vec2 uv = wfpg::hemisphere_to_square(basis_.to_local(direction));
    const auto along = [&](float u) {
      return wfpg::clamp(static_cast<int>(u * static_cast<float>(side_)), 0, side_ - 1);
    };
    return static_cast<std::size_t>(along(uv.y) * side_ + along(uv.x));
  }

  int side_;
  wfpg::frame basis_;
  std::vector<double> cells_;
  double total_ = 0.0;
};

/// Measures exact cells.
inline outcome measure_exact(cell_target target, const settings& set, const wall_light& light,
                             const std::vector<wall_point>& places) {
  std::vector<exact_cells> cells;
  for (const wall_point& place : places) cells.emplace_back(set, target, light, place);
  return {measure(light, places, [&](std::size_t i, vec3 direction) { return cells[i].pdf(direction); })};
}

}  // namespace room
