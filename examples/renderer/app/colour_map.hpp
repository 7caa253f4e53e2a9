// Numbers as colours.
#pragma once

#include "scene/scene.hpp"

namespace render {

/// Black, purple, red, orange, white for 0 to 1, with increasing brightness. Linear RGB. Values beyond are
/// clamped.
vec3 heat_colour(float value);

}  // namespace render
