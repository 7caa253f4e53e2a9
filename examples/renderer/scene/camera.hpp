// The pinhole camera as kernels use it.
#pragma once

#include "scene/frame.hpp"
#include "scene/scene.hpp"

namespace render {

/// Maps points on the picture to rays.
class pinhole {
 public:
  pinhole(const camera& view, int width, int height)
      : position_(view.position),
        forward_(glm::normalize(view.forward)),
        width_(static_cast<std::uint32_t>(width)),
        height_(static_cast<std::uint32_t>(height)) {
    const vec3 right = glm::normalize(glm::cross(forward_, view.up));
    const float half_height = std::tan(0.5f * view.vertical_fov);
    down_ = -half_height * glm::cross(right, forward_);
    right_ = right * (half_height * static_cast<float>(width) / static_cast<float>(height));
    pixel_area_ = 4.0f * glm::length(right_) * glm::length(down_) /
                  (static_cast<float>(width) * static_cast<float>(height));
  }

  WFPG_HD vec3 position() const { return position_; }

  /// The ray through a pixel (row by row from the top) at `offset` in [0, 1)² of it.
  WFPG_HD wfpg::ray through(std::uint32_t pixel, vec2 offset) const {
    const float x = (static_cast<float>(pixel % width_) + offset.x) / static_cast<float>(width_);
    const float y = (static_cast<float>(pixel / width_) + offset.y) / static_cast<float>(height_);
    wfpg::ray ray;
    ray.origin = position_;
    ray.direction = glm::normalize(forward_ + (2.0f * x - 1.0f) * right_ + (2.0f * y - 1.0f) * down_);
    return ray;
  }

  /// Density, per steradian, of the directions of a pixel's rays, where they have `direction`.
  WFPG_HD float pdf(vec3 direction) const {
    const float cosine = glm::dot(forward_, direction);
    return cosine > 0.0f ? 1.0f / (pixel_area_ * cosine * cosine * cosine) : 0.0f;
  }
  /// Writes the pixel of the ray with that direction. False where there is none.
  WFPG_HD bool find_pixel(vec3 direction, std::uint32_t& pixel) const {
    const float ahead = glm::dot(forward_, direction);
    if (!(ahead > 0.0f)) return false;
    const auto along = [&](vec3 axis, std::uint32_t size, std::uint32_t& place) {
      const float x = 0.5f + 0.5f * glm::dot(axis, direction) / (glm::dot(axis, axis) * ahead);
      if (!(x >= 0.0f && x < 1.0f)) return false;
      // The product may round up to the size.
      place = glm::min(static_cast<std::uint32_t>(x * static_cast<float>(size)), size - 1);
      return true;
    };
    std::uint32_t column, row;
    if (!along(right_, width_, column) || !along(down_, height_, row)) return false;
    pixel = row * width_ + column;
    return true;
  }

 private:
  vec3 position_, forward_, right_, down_;
  std::uint32_t width_, height_;
  float pixel_area_;  // on the plane at distance 1
};

}  // namespace render
