// Pictures for people: exposures, crops, maps of errors.
#pragma once

#include "app/image_io.hpp"
#include "settings.hpp"

#include <vector>

namespace quality {

/// What brings the median of the reference's positive luminances to 0.25; 1 of a black one.
float exposure_for(const render::image& reference);

/// A quarter of the picture's width and height, at least 24 pixels where there are so many, where the sum of
/// `errors`, one a pixel, is greatest; errors that are not finite count as the greatest that is.
window worst_window(const std::vector<double>& errors, int width, int height);

/// Errors from 0 to `greatest` > 0 as black, purple, orange, yellow, white, by their square roots.
render::image error_map(const std::vector<double>& errors, int width, int height, double greatest);

/// The 99th percentile of the positive ones, or 1 where there are none.
double shown_greatest(const std::vector<double>& errors);

/// The picture with a frame of one pixel around the window, in yellow after `exposure`.
render::image framed(render::image picture, const window& at, float exposure);

/// So many times that the longer side has at least `least` pixels.
render::image enlarged_to(const render::image& picture, int least);

}  // namespace quality
