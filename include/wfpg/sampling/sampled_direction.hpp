// What sampling a direction returns: the direction, the density of the whole mixture, and the technique that
// drew it (paper, section 3.5, Algorithm 3). 24 bytes a ray.
#pragma once

#include <wfpg/base/types.hpp>

#include <cstdint>

namespace wfpg {

/// The technique that drew a direction.
enum class sampling_technique : std::uint32_t {
  none,   ///< nothing: the ray is inactive, or sampling failed; the path ends
  bsdf,   ///< the BSDF, alone or in a mixture
  guide,  ///< the guide: its field or product
  delta,  ///< a delta lobe; `pdf` is its probability in the mixture
};

/// Stands for a field's number where there is no field.
inline constexpr std::uint32_t no_field = 0xffffffffu;

/// The next direction of a path. By default it says that nothing was drawn.
struct sampled_direction {
  vec3 direction{0.0f};  ///< unit length, away from the surface, world space
  /// Density of the whole mixture, per steradian. Of a delta lobe it is the lobe's probability, and 0 where
  /// nothing was drawn.
  float pdf = 0.0f;
  sampling_technique technique = sampling_technique::none;  ///< what drew it
  /// Number of the kept field in the mixture, for path_recorder_view::scatter(). The BSDF's directions carry
  /// it too.
  std::uint32_t field = no_field;
};

}  // namespace wfpg
