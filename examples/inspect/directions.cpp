// Maps cells to directions and back.
#include "directions.hpp"

#include "scene/frame.hpp"

#include <cmath>

namespace inspect {

vec3 direction_grid::direction(std::size_t cell, vec2 inside) const {
  const auto f = static_cast<std::size_t>(resolution());
  const vec2 corner(static_cast<float>(cell % f), static_cast<float>(cell / f));
  return cells_.direction((corner + inside) / static_cast<float>(f));
}

std::optional<std::size_t> direction_grid::cell_of(vec3 direction) const {
  vec2 uv;
  if (!cells_.locate(direction, uv)) return std::nullopt;
  return cells_.grid().cell_of(uv);
}

vec3 direction_at(vec2 place) {
  const float around = 2.0f * render::pi * (place.x - 0.5f), down = render::pi * place.y;
  return {std::sin(down) * std::sin(around), std::cos(down), -std::sin(down) * std::cos(around)};
}

render::image latitude_longitude(const direction_grid& grid, const render::image& cells, int height,
                                 vec3 outside) {
  render::image picture = render::make_image(2 * height, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < 2 * height; ++x) {
      const vec2 middle(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const auto cell = grid.cell_of(direction_at(middle / vec2(2.0f * float(height), float(height))));
      picture.pixels[std::size_t(y) * std::size_t(2 * height) + std::size_t(x)] =
          cell ? cells.pixels[*cell] : outside;
    }
  return picture;
}

}  // namespace inspect
