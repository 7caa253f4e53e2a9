// A ramp between five colours.
#include "app/colour_map.hpp"

#include <glm/common.hpp>

#include <algorithm>

namespace render {

vec3 heat_colour(float value) {
  constexpr int last = 4;
  static const vec3 colours[] = {{0.0f, 0.0f, 0.0f},
                                 {0.12f, 0.01f, 0.25f},
                                 {0.75f, 0.08f, 0.04f},
                                 {0.95f, 0.60f, 0.05f},
                                 {1.0f, 1.0f, 1.0f}};
  const float at = std::clamp(value, 0.0f, 1.0f) * float(last);
  const int below = std::min(int(at), last - 1);
  return glm::mix(colours[below], colours[below + 1], at - float(below));
}

}  // namespace render
