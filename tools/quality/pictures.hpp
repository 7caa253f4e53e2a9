// Pictures for people: exposures, crops, error maps.
#pragma once

#include "app/image_io.hpp"
#include "settings.hpp"

#include <vector>

namespace quality {

/// The factor that brings the median of the reference's positive luminances to 0.25. 1 for a black picture.
float exposure_for(const render::image& reference);

/// The window with the greatest sum of `errors`, one per pixel. It has a quarter of the picture's width and
/// height, and at least 24 pixels if there are so many. Errors that are not finite count as the greatest
/// finite one.
window worst_window(const std::vector<double>& errors, int width, int height);

/// Errors from 0 to `greatest` > 0 as black, purple, orange, yellow, white, by their square roots.
render::image error_map(const std::vector<double>& errors, int width, int height, double greatest);

/// The 99th percentile of the positive errors, or 1 if there are none.
double shown_greatest(const std::vector<double>& errors);

/// The picture with a frame of one pixel around the window. The frame is yellow after `exposure`.
render::image framed(render::image picture, const window& at, float exposure);

/// Enlarges by the factor that gives the longer side at least `least` pixels.
render::image enlarged_to(const render::image& picture, int least);

}  // namespace quality
