// Light at four wavelengths that a path draws and keeps. Colours of a scene are spectra of three bands. A
// wavelength is drawn in proportion to its part of luminance, so that the mean of the four is luminance.
#pragma once

#include "device.hpp"
#include "scene/scene.hpp"

namespace kernels {

using render::vec2;
using render::vec3;
using spectrum = glm::vec4;

/// Parts of luminance that red, green and blue have (Rec. 709).
inline constexpr float red_part = 0.2126f, green_part = 0.7152f, blue_part = 0.0722f;

/// Mean of the four values: luminance, where they are radiance.
KERNELS_BOTH inline float mean_of(const spectrum& s) {
  return 0.25f * (s.x + s.y + s.z + s.w);
}

/// The bands that the four wavelengths of a path lie in: 0 red, 1 green, 2 blue.
class wavelengths {
 public:
  wavelengths() = default;
  /// Draws four wavelengths, one in each quarter of luminance. `u` in [0, 1).
  KERNELS_BOTH explicit wavelengths(float u) {
    for (int i = 0; i < 4; ++i) {
      const float place = 0.25f * (static_cast<float>(i) + u);
      bands_[i] = place < blue_part ? 2 : place < blue_part + green_part ? 1 : 0;
    }
  }

  /// A colour's values at the four wavelengths.
  KERNELS_BOTH spectrum of(const vec3& colour) const {
    return {colour[bands_[0]], colour[bands_[1]], colour[bands_[2]], colour[bands_[3]]};
  }
  /// The estimate of a colour from radiance at the four wavelengths.
  KERNELS_BOTH vec3 to_colour(const spectrum& radiance) const {
    vec3 colour(0.0f);
    for (int i = 0; i < 4; ++i) colour[bands_[i]] += 0.25f * radiance[i];
    return colour / vec3(red_part, green_part, blue_part);
  }

 private:
  std::uint8_t bands_[4] = {};
};

}  // namespace kernels
