// How far a picture is from a reference.
#pragma once

#include "app/image_io.hpp"

#include <cstddef>
#include <vector>

namespace render {

/// Means over pixels and the three colour channels; r is the reference's value, t the tested one's.
/// A pixel with a NaN or an infinity in either picture counts as infinitely wrong in every measure.
struct image_error {
  double mse = 0.0;             ///< (t - r)²
  double relmse = 0.0;          ///< (t - r)² / (r² + 0.01)
  double relmse_trimmed = 0.0;  ///< relmse without the worst 0.1% of the pixels (rounded down)
  double relmse_robust = 0.0;   ///< relmse without the worst 0.01% of the pixels (rounded down)
  double worst_share = 0.0;     ///< of relmse's sum, what those had, in [0, 1]; 1 where relmse is infinite
  double mse_reinhard = 0.0;    ///< (t' - r')² with c' = c / (1 + c), negative values taken as 0
  double mae = 0.0;             ///< |t - r|
  double smape = 0.0;           ///< |t - r| / (|t| + |r| + 0.01)
  std::size_t non_finite = 0;   ///< pixels with a NaN or an infinity; trimming may hide these, this does not
};

/// Throws std::invalid_argument where the sizes differ or a picture has no pixels.
image_error compare(const image& test, const image& reference);

/// mse_reinhard pixel by pixel, row by row; its mean is compare's. Infinite where a pixel is not finite.
/// Throws as compare does.
std::vector<double> reinhard_errors(const image& test, const image& reference);

/// The error of a reference that is the mean of two independent halves: what the halves are from their mean,
/// which they are on opposite sides of, the mean of both. Each half has twice the variance of the mean, half
/// of which is the mean's own. Subtract it from a squared error against the mean. `non_finite` and
/// `worst_share` are those of the first half.
image_error noise_of_halves(const image& half_a, const image& half_b);

}  // namespace render
