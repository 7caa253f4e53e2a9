// Pictures in memory and in files: OpenEXR in and out, PNG out.
#pragma once

#include "scene/scene.hpp"

#include <string>
#include <vector>

namespace render {

/// Linear RGB (Rec. 709 primaries), row by row; row 0 is the top.
struct image {
  int width = 0;
  int height = 0;
  std::vector<vec3> pixels;
};

/// A black picture. Throws std::invalid_argument unless both sides are positive.
image make_image(int width, int height);

/// The R, G and B channels, half or float, of a single-part OpenEXR file; other channels are ignored.
/// Throws std::runtime_error that names the path and the reason.
image read_exr(const std::string& path);

/// The environment of an OpenEXR or Radiance HDR (.hdr) file, twice as wide as high or not. Throws
/// std::runtime_error that names the path and the reason, also of radiance that is negative or not finite.
environment_map read_environment(const std::string& path);

/// Replaces a file by an OpenEXR picture, R, G and B as 32-bit float; a failure leaves the old file. Throws
/// std::runtime_error that names the path and the reason.
void write_exr(const std::string& path, const image& picture);

/// Replaces a file by a PNG picture, 8-bit sRGB: values times `exposure`, clamped to [0, 1], through the sRGB
/// curve. NaN becomes black. A failure leaves the old file. Throws std::runtime_error that names the path and
/// the reason.
void write_png(const std::string& path, const image& picture, float exposure = 1.0f);

/// Pictures from left to right with `gap` >= 0 white columns between them; lower ones are filled up in white.
image side_by_side(const std::vector<image>& pictures, int gap);

/// Each pixel as a square of `times` by `times`, which is positive.
image enlarged(const image& picture, int times);

/// The `width` by `height` pixels from column `left` and row `top` on. Throws std::invalid_argument where
/// they are not within the picture.
image cropped(const image& picture, int left, int top, int width, int height);

/// The radiance that an sRGB-encoded value in [0, 1] stands for (IEC 61966-2-1), and back.
float srgb_to_linear(float encoded);
float linear_to_srgb(float linear);

}  // namespace render
