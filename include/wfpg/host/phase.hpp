// The Henyey-Greenstein phase function: how a point in a medium scatters. It has the members of a BSDF, so
// that guides and checks of BSDFs take it. A surface in a medium has its `normal` and `geometric_normal`
// along `outgoing`.
//
// Source: Henyey and Greenstein 1941; directions as in pbrt-v4, section 11.3. The forms without cancellation
// are wfpg's own.
// Cost: a square root a density, and a frame a sample. Memory: 4 bytes.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>

#include <cmath>

namespace wfpg {

/// Phase function of one lobe. Its integral over incident directions is 1, and it has no cosine.
struct henyey_greenstein {
  /// Mean cosine of the angle by which light turns, in (-1, 1): 0 scatters alike in all directions, 0.9
  /// mostly ahead, and -0.9 mostly back. Beyond ±0.999 floats resolve the lobe no more.
  float g = 0.0f;

  /// Value for two unit directions that point away from the point, per steradian.
  WFPG_HD float eval(vec3 outgoing, vec3 incident) const {
    // Light that goes straight on comes from -outgoing. The sum of the directions is then small, and has more
    // digits than 1 plus their cosine.
    const vec3 turn = g >= 0.0f ? outgoing + incident : outgoing - incident;
    const float sharp = fabsf(g), narrow = 1.0f - sharp;
    const float square = narrow * narrow + sharp * glm::dot(turn, turn);
    return narrow * (1.0f + sharp) / (4.0f * pi * square * std::sqrt(square));
  }
  /// Density of sample(), per steradian: that of the light.
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const { return eval(outgoing, incident); }
  /// Draws an incident direction. `u` in [0, 1)². It never fails.
  WFPG_HD bsdf_sample sample(vec3 outgoing, vec2 u) const {
    // The cosine between the ways of light before and after, for any g without a division by it.
    // With v it is (1 + g² - ((1 - g²) / (1 + g v))²) / (2 g).
    const float v = 1.0f - 2.0f * u.x, a = 1.0f + g * v;
    const float cosine =
        clamp((2.0f * v + g * (v * v + 3.0f) + g * g * (2.0f * v + g * (v * v - 1.0f))) / (2.0f * a * a),
              -1.0f, 1.0f);
    const float sine = std::sqrt(max(1.0f - cosine * cosine, 0.0f)), angle = 2.0f * pi * u.y;
    const vec3 local(sine * std::cos(angle), sine * std::sin(angle), -cosine);
    const vec3 incident = glm::normalize(frame(outgoing).to_world(local));
    return {incident, pdf(outgoing, incident)};
  }
  /// Returns false: no direction has a probability.
  WFPG_HD bool is_delta() const { return false; }
  /// Returns true: light comes from everywhere.
  WFPG_HD bool transmits() const { return true; }
  /// Its lobe as a narrow part, by its largest density: a guide draws less where it is narrow.
  WFPG_HD glossy_part glossy(vec3) const {
    const float narrow = 1.0f - fabsf(g);
    return glossy_part::unknown((1.0f + fabsf(g)) / (4.0f * pi * narrow * narrow));
  }
};

static_assert(is_bsdf_v<henyey_greenstein> && has_glossy_part_v<henyey_greenstein>);

}  // namespace wfpg
