// Cells of equal solid angle, as in fields, and pictures of their values. The octahedral square shows the
// cells as they are. Latitude and longitude are the world's, as in environments.
#pragma once

#include "app/image_io.hpp"

#include <wfpg/sampling/field_sampler.hpp>

#include <cstddef>
#include <optional>

namespace inspect {

using render::vec2;
using render::vec3;

/// F x F cells over the sphere, or over the hemisphere above a normal. Trivially copyable.
class direction_grid {
 public:
  /// Over the sphere. Precondition: resolution > 0.
  explicit direction_grid(int resolution) : cells_(grid(resolution)) {}
  /// Over the hemisphere above a unit normal.
  direction_grid(int resolution, vec3 normal) : cells_(grid(resolution), normal) {}
  /// The grid of a field.
  explicit direction_grid(const wfpg::directional_field& field) : cells_(field) {}

  int resolution() const { return static_cast<int>(cells_.grid().resolution()); }
  std::size_t size() const { return std::size_t(resolution()) * std::size_t(resolution()); }
  /// Solid angle of a cell, steradians.
  float solid_angle() const { return cells_.cell_solid_angle(); }

  /// These cells, each divided into `times` x `times`.
  direction_grid refined(int times) const {
    const int fine = resolution() * times;
    return cells_.hemisphere() ? direction_grid(fine, cells_.normal()) : direction_grid(fine);
  }

  /// The unit direction at `inside`, [0, 1]², of a cell. Cells are row by row.
  vec3 direction(std::size_t cell, vec2 inside) const;
  /// The cell of a unit direction. Empty below the hemisphere.
  std::optional<std::size_t> cell_of(vec3 direction) const;

 private:
  static wfpg::grid_distribution grid(int resolution) {
    return {nullptr, static_cast<std::uint32_t>(resolution)};
  }

  wfpg::directional_field cells_;  // maps directions; its distribution is unused
};

/// The unit direction at a place in [0, 1]² of a picture of all directions. Its centre is -z, its right +x,
/// its upper edge +y.
vec3 direction_at(vec2 place);

/// Draws values of F x F cells as a picture of all directions. It has `height` rows and is twice as wide.
/// Directions without a cell get `outside`.
render::image latitude_longitude(const direction_grid& grid, const render::image& cells, int height,
                                 vec3 outside);

}  // namespace inspect
