// Errors of a picture against a reference.
#pragma once

#include "app/image_io.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace render {

/// Means over pixels and the three colour channels. r is the reference's value, t the tested picture's. A
/// pixel with a NaN or an infinity in either picture is infinitely wrong in every measure.
struct image_error {
  double mse = 0.0;             ///< (t - r)²
  double relmse = 0.0;          ///< (t - r)² / (r² + 0.01)
  double relmse_trimmed = 0.0;  ///< relmse without the worst 0.1% of the pixels (rounded down)
  double relmse_robust = 0.0;   ///< relmse without the worst 0.01% of the pixels (rounded down)
  /// The fraction of relmse's sum in those pixels, in [0, 1]; 1 if relmse is infinite.
  double worst_share = 0.0;
  double mse_reinhard = 0.0;   ///< (t' - r')² with c' = c / (1 + c), negative values taken as 0
  double mae = 0.0;            ///< |t - r|
  double smape = 0.0;          ///< |t - r| / (|t| + |r| + 0.01)
  std::size_t non_finite = 0;  ///< pixels with a NaN or an infinity, even if trimming hides them
};

/// Throws std::invalid_argument if the sizes differ or a picture has no pixels.
image_error compare(const image& test, const image& reference);

/// mse_reinhard of each pixel, row by row. Its mean is compare()'s. Infinite if a pixel is not finite. Throws
/// as compare() does.
std::vector<double> reinhard_errors(const image& test, const image& reference);

/// Reads the picture that one of this size is compared with, which --reference names. Throws
/// std::invalid_argument if its size differs, and as read_exr() does.
image read_reference(const std::string& path, int width, int height);

/// The error of a reference that is the mean of two independent halves. It is the error of a half against
/// their mean, averaged over both halves. A half has twice the mean's variance and differs from the mean by
/// half of that. Subtract it from a squared error against the mean. `non_finite` and `worst_share` are those
/// of the first half.
image_error noise_of_halves(const image& half_a, const image& half_b);

}  // namespace render
