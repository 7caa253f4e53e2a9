// Bilinear lookup along one axis of a texture.
#pragma once

#include "scene/scene.hpp"

#include <glm/common.hpp>

#include <cmath>

namespace render {

/// A coordinate of a texture between two of its `size` texels along one axis.
struct texel_pair {
  std::uint32_t first, second;
  float second_weight;

  WFPG_HD texel_pair(float coordinate, std::uint32_t size, texture_wrap wrap) {
    // Wraps first, since only small coordinates are precise enough. A mirrored texture has a period of two
    // copies.
    const float period = wrap == texture_wrap::mirrored_repeat ? 2.0f : 1.0f;
    const float near = wrap == texture_wrap::clamp_to_edge
                           ? glm::clamp(coordinate, 0.0f, 1.0f)
                           : coordinate - period * std::floor(coordinate / period);
    // A coordinate that is not finite, or too large for a fraction, becomes the edge's.
    const float inside = near >= 0.0f ? glm::min(near, period) : 0.0f;
    const float x = inside * static_cast<float>(size) - 0.5f, floor = std::floor(x);
    second_weight = x - floor;
    first = wrapped(static_cast<std::int32_t>(floor), static_cast<std::int32_t>(size), wrap);
    second = wrapped(static_cast<std::int32_t>(floor) + 1, static_cast<std::int32_t>(size), wrap);
  }

 private:
  // `i` is in [-1, 2 size].
  WFPG_HD static std::uint32_t wrapped(std::int32_t i, std::int32_t size, texture_wrap wrap) {
    if (wrap == texture_wrap::clamp_to_edge) return static_cast<std::uint32_t>(glm::clamp(i, 0, size - 1));
    const std::int32_t copies = wrap == texture_wrap::mirrored_repeat ? 2 * size : size;
    const std::int32_t at = (i + copies) % copies;
    return static_cast<std::uint32_t>(at < size ? at : copies - 1 - at);
  }
};

}  // namespace render
