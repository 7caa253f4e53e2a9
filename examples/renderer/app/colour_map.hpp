// Numbers as colours.
#pragma once

#include "scene/scene.hpp"

namespace render {

/// Black, purple, red, orange, white for 0 to 1, lighter all the way; linear RGB. What is beyond is as the
/// end.
vec3 heat_colour(float value);

}  // namespace render
