// A t-test of each tile.
#include "tiles.hpp"

#include "statistic.hpp"

#include <wfpg/base/types.hpp>

#include <cmath>

namespace quality {
namespace {

/// The z of a difference without noise.
constexpr double certain = 1000.0;

/// The normal deviate of the same probability as t.
double deviate_of(double t, double degrees) {
  const double z = std::sqrt(degrees * std::log1p(t * t / degrees));
  return std::copysign(z * (8.0 * degrees + 1.0) / (8.0 * degrees + 3.0), t);
}

void add(tile_agreement& result, double z) {
  ++result.tiles;
  if (!(std::fabs(z) < 4.0)) ++result.beyond_4;
  if (std::fabs(z) > std::fabs(result.worst)) result.worst = z;
  result.mean_square += z * z;
}

}  // namespace

std::vector<double> tiles_of(const render::image& picture) {
  const auto along = [](int pixels) { return (pixels + tile_side - 1) / tile_side; };
  const int columns = along(picture.width);
  const std::size_t count = static_cast<std::size_t>(columns * along(picture.height));
  std::vector<double> sums(count), pixels(count);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const auto tile = static_cast<std::size_t>(y / tile_side * columns + x / tile_side);
      sums[tile] += static_cast<double>(
          wfpg::luminance(picture.pixels[static_cast<std::size_t>(y * picture.width + x)]));
      pixels[tile] += 1.0;
    }
  for (std::size_t tile = 0; tile < count; ++tile) sums[tile] /= pixels[tile];
  return sums;
}

tile_agreement agreement_of(const std::vector<std::vector<double>>& method,
                            const std::vector<std::vector<double>>& baseline) {
  tile_agreement result;
  const std::size_t seeds = method.size();
  for (std::size_t tile = 0; tile < method.front().size(); ++tile) {
    std::vector<double> differences(seeds);
    double mean = 0.0;
    for (std::size_t s = 0; s < seeds; ++s) {
      differences[s] = method[s][tile] - baseline[s][tile];
      mean += baseline[s][tile] / static_cast<double>(seeds);
    }
    const statistic difference = statistic_of(differences);
    const double rounding = 1.0e-5 * mean, error = difference.standard_error.value_or(0.0);
    if (std::fabs(difference.mean) <= rounding && error <= rounding) continue;
    add(result, error > 0.0 ? deviate_of(difference.mean / error, static_cast<double>(seeds) - 1.0)
                            : std::copysign(certain, difference.mean));
  }
  if (result.tiles > 0) result.mean_square /= static_cast<double>(result.tiles);
  return result;
}

}  // namespace quality
