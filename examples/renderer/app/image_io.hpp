// Pictures in memory and in files: reads and writes OpenEXR, reads and writes PNG.
#pragma once

#include "scene/scene.hpp"

#include <string>
#include <vector>

namespace render {

/// Linear RGB (Rec. 709 primaries), row by row. Row 0 is the top.
struct image {
  int width = 0;
  int height = 0;
  std::vector<vec3> pixels;
};

/// A black picture. Throws std::invalid_argument unless both sides are positive.
image make_image(int width, int height);

/// Reads the R, G and B channels, half or float, of a single-part OpenEXR file. Other channels are ignored.
/// Throws std::runtime_error that names the path and the reason.
image read_exr(const std::string& path);

/// Reads a picture of an OpenEXR or PNG file (.exr, .png). A PNG's values are sRGB, and become linear ones in
/// [0, 1]. Throws std::runtime_error that names the path and the reason.
image read_picture(const std::string& path);

/// Reads the environment of an OpenEXR or Radiance HDR (.hdr) file, of any aspect ratio. Throws
/// std::runtime_error that names the path and the reason, also for negative or not finite radiance.
environment_map read_environment(const std::string& path);

/// Replaces a file by an OpenEXR picture with R, G and B as 32-bit floats. A failure leaves the old file.
/// Throws std::runtime_error that names the path and the reason.
void write_exr(const std::string& path, const image& picture);

/// Replaces a file by a PNG picture, 8-bit sRGB. Values are multiplied by `exposure`, clamped to [0, 1], and
/// encoded with the sRGB curve. NaN becomes black. A failure leaves the old file. Throws std::runtime_error
/// that names the path and the reason.
void write_png(const std::string& path, const image& picture, float exposure = 1.0f);

/// Pictures from left to right with `gap` >= 0 white columns between them. Lower ones are padded in white.
image side_by_side(const std::vector<image>& pictures, int gap);

/// Enlarges each pixel to a square of `times` by `times`, which is positive.
image enlarged(const image& picture, int times);

/// The `width` by `height` pixels from column `left` and row `top`. Throws std::invalid_argument if they
/// exceed the picture.
image cropped(const image& picture, int left, int top, int width, int height);

/// The radiance of an sRGB-encoded value in [0, 1] (IEC 61966-2-1), and the inverse.
float srgb_to_linear(float encoded);
float linear_to_srgb(float linear);

}  // namespace render
