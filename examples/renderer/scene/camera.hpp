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
  }

  /// The ray through a pixel (row by row from the top) at `offset` in [0, 1)² of it.
  WFPG_HD wfpg::ray through(std::uint32_t pixel, vec2 offset) const {
    const float x = (static_cast<float>(pixel % width_) + offset.x) / static_cast<float>(width_);
    const float y = (static_cast<float>(pixel / width_) + offset.y) / static_cast<float>(height_);
    wfpg::ray ray;
    ray.origin = position_;
    ray.direction = glm::normalize(forward_ + (2.0f * x - 1.0f) * right_ + (2.0f * y - 1.0f) * down_);
    return ray;
  }

 private:
  vec3 position_, forward_, right_, down_;
  std::uint32_t width_, height_;
};

}  // namespace render
