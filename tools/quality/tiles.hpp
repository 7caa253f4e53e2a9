// Whether methods' pictures have the same mean, tile by tile, over the seeds that all of them have.
#pragma once

#include "app/image_io.hpp"

#include <cstddef>
#include <vector>

namespace quality {

/// Pixels along a tile's side. Tiles at the right and lower edge may be smaller.
inline constexpr int tile_side = 4;

/// With fewer seeds, means are not compared.
inline constexpr int least_seeds_for_tiles = 20;

/// How far a method's mean is from the baseline's. With equal means z is normally distributed. It exceeds 4
/// in 0.006% of tiles, and the mean of its square is 1.
struct tile_agreement {
  std::size_t tiles = 0;     ///< tiles with noise or a difference
  std::size_t beyond_4 = 0;  ///< of them, with |z| of 4 or more
  double worst = 0.0;        ///< the z farthest from 0
  double mean_square = 0.0;  ///< of z
};

/// The mean luminance of each tile.
std::vector<double> tiles_of(const render::image& picture);

/// `method` and `baseline` are tiles of pictures of the same seeds in the same order, at least two.
/// Differences are taken seed by seed, since noise that both share is no noise between them. Wallace's
/// approximation (1959) turns Student's t into a normal deviate. Tiles are left out if their difference and
/// its error are below 1e-5, as from rounding.
tile_agreement agreement_of(const std::vector<std::vector<double>>& method,
                            const std::vector<std::vector<double>>& baseline);

}  // namespace quality
