// Whether methods' pictures have one mean: tile by tile, over the seeds that all of them were rendered with.
#pragma once

#include "app/image_io.hpp"

#include <cstddef>
#include <vector>

namespace quality {

/// Pixels along a tile's side; tiles at the right and lower edge may be smaller.
inline constexpr int tile_side = 4;

/// Fewer seeds than these say nothing of means.
inline constexpr int least_seeds_for_tiles = 20;

/// How far a method's mean is from the baseline's. With one mean z is normally distributed: it exceeds 4 in
/// 0.006% of tiles, and the mean of its square is 1.
struct tile_agreement {
  std::size_t tiles = 0;     ///< that have noise, or a difference
  std::size_t beyond_4 = 0;  ///< of them, with |z| of 4 or more
  double worst = 0.0;        ///< the z farthest from 0
  double mean_square = 0.0;  ///< of z
};

/// The mean luminance of each tile.
std::vector<double> tiles_of(const render::image& picture);

/// `method` and `baseline`: tiles of pictures of the same seeds in the same order, at least two. Differences
/// are taken seed by seed, since what a seed decides for both is no noise between them. Student's t is turned
/// to a normal deviate by Wallace's approximation (1959). Tiles whose difference and its error are
/// less than a part in 10^5, as rounding makes them, are left out.
tile_agreement agreement_of(const std::vector<std::vector<double>>& method,
                            const std::vector<std::vector<double>>& baseline);

}  // namespace quality
