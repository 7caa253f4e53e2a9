// Tells scenes apart, for what was saved of one and must not be used with another.
#pragma once

#include "scene/scene.hpp"

#include <cstdint>

namespace render {

/// Of all that decides what a scene looks like; its name and intended picture do not. O(bytes of the scene).
std::uint64_t checksum_of(const scene& scene);

/// Of all that decides the light in a scene: of everything but the camera. O(bytes of the scene).
std::uint64_t checksum_without_camera(const scene& scene);

}  // namespace render
