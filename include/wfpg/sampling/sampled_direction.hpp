// What sampling a direction returns: the direction, the density of the whole mixture, and what drew it.
#pragma once

#include <wfpg/base/types.hpp>

#include <cstdint>

namespace wfpg {

/// What drew a direction.
enum class sampling_technique : std::uint32_t {
  none,   ///< nothing: the ray is inactive, or sampling failed; the path ends
  bsdf,   ///< the BSDF, of a mixture or alone
  guide,  ///< the guide's field
  delta,  ///< a delta BSDF: pdf is its lobe's probability
};

/// Where a number of a field would be.
inline constexpr std::uint32_t no_field = 0xffffffffu;

/// The next direction of a path.
struct sampled_direction {
  vec3 direction{0.0f};  ///< unit length, away from the surface
  float pdf = 0.0f;  ///< of the whole mixture, per steradian; of a delta lobe its probability; 0 with none
  sampling_technique technique = sampling_technique::none;  ///< what drew it
  std::uint32_t field = no_field;  ///< the kept field in the mixture, for path_recorder_view::scatter()
};

}  // namespace wfpg
