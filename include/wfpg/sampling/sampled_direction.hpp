// What sampling a direction returns: the direction, the density of the whole mixture, and the technique that
// drew it (paper, section 3.5, Algorithm 3). 24 bytes a ray.
//
// It also has the guide's share of the density, w p_guide / p: how likely the guide would have drawn the
// direction, whoever did. Fields learn their fraction of guided directions from it. This is the expectation
// step for a mixture's weights (Dempster et al. 1977, "Maximum Likelihood from Incomplete Data via the EM
// Algorithm").
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cstdint>

namespace wfpg {

/// The technique that drew a direction.
enum class sampling_technique : std::uint16_t {
  none,   ///< nothing: the ray is inactive, or sampling failed; the path ends
  bsdf,   ///< the BSDF, alone or in a mixture
  guide,  ///< the guide: its field or product
  delta,  ///< a delta lobe; `pdf` is its probability in the mixture
};

/// Stands for a field's number where there is no field.
inline constexpr std::uint32_t no_field = 0xffffffffu;

/// Share of a guide in one direction's density, in few bits, and the kind of surface. A default one says that
/// the share is not known, as for delta lobes: nothing is learnt from it.
///
/// A surface is narrow where its lobes leave the guide little of its fraction. The share is then stored over
/// the part that they leave. So one fraction serves surfaces of any roughness.
struct guide_share {
  /// A surface that leaves the guide less than this part of its fraction is narrow.
  static constexpr float least_smooth = 0.9f;
  /// Steps of a share of 1 on smooth surfaces.
  static constexpr std::uint32_t smooth_steps = 126;
  /// Steps of a quotient of 1 on narrow surfaces. It is cut off at 4.
  static constexpr std::uint32_t narrow_steps = 31;
  /// Code of a share that is not known.
  static constexpr std::uint16_t unknown = 0xff;

  /// Bit 7: the surface is narrow. Below: the share in steps. Or `unknown`.
  std::uint16_t code = unknown;

  /// A share that is not known.
  guide_share() = default;
  /// A share with a code that another had.
  WFPG_HD constexpr explicit guide_share(std::uint16_t of_other) : code(of_other) {}

  /// Returns the share of a guide whose term of the density is `of_guide`, of a density `pdf`. `kept`: the
  /// part of its fraction that the surface leaves the guide, in [0, 1]. Unknown where `pdf` or `kept` is 0.
  WFPG_HD static guide_share of(float of_guide, float pdf, float kept) {
    if (!(pdf > 0.0f && kept > 0.0f)) return {};
    const float share = min(of_guide / pdf, 1.0f);
    const bool narrow = kept < least_smooth;
    const float steps =
        narrow ? share / kept * static_cast<float>(narrow_steps) : share * static_cast<float>(smooth_steps);
    return guide_share(static_cast<std::uint16_t>((narrow ? 0x80u : 0u) +
                                                  static_cast<std::uint32_t>(min(steps + 0.5f, 126.0f))));
  }
  /// Whether the share is known.
  WFPG_HD bool is_known() const { return code != unknown; }
  /// Whether the surface is narrow. Precondition: is_known().
  WFPG_HD bool is_narrow() const { return (code & 0x80u) != 0; }
  /// The share in steps. Precondition: is_known().
  WFPG_HD std::uint32_t steps() const { return code & 0x7fu; }
};

/// The next direction of a path. By default it says that nothing was drawn.
struct sampled_direction {
  vec3 direction{0.0f};  ///< unit length, away from the surface, world space
  /// Density of the whole mixture, per steradian. Of a delta lobe it is the lobe's probability, and 0 where
  /// nothing was drawn.
  float pdf = 0.0f;
  sampling_technique technique = sampling_technique::none;  ///< what drew it
  guide_share share;                                        ///< of the guide in `pdf`, from which it learns
  /// Number of the kept field in the mixture, for path_recorder_view::scatter(). The BSDF's directions carry
  /// it too.
  std::uint32_t field = no_field;
};

}  // namespace wfpg
