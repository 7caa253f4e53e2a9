// Identifies scenes, so that saved data of one is not used with another.
#pragma once

#include "scene/scene.hpp"

#include <cstdint>

namespace render {

/// Hash of all that affects the picture, without the name and the intended picture size. O(bytes of the
/// scene).
std::uint64_t checksum_of(const scene& scene);

/// Hash of all that affects the light, which is all but the camera. O(bytes of the scene).
std::uint64_t checksum_without_camera(const scene& scene);

}  // namespace render
