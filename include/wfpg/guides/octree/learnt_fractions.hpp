// Learns the fraction of guided directions of each field from what directions brought. Where the guide would
// have drawn the light that was found, its fraction grows; where the BSDF would have, it shrinks. Smooth and
// narrow surfaces have fractions of their own.
//
// With X = what a direction brought over its density, and a = the guide's share of that density, the fraction
// becomes E[X a] / E[X]. It is the step of expectation maximisation. Its fixed point has the least divergence
// between the light that a surface reflects and the mixture. Delta lobes are left out: only a BSDF whose
// parts are drawn apart keeps their probability.
//
// Source: Mueller (2019), "Path Guiding in Production", section 10.5, learns it by gradients of the same
// divergence. Means that forget, and what is exact of them, are wfpg's own.
//
// Cost: three atomics a direction, and O(fields) a sample. Memory: 88 bytes a field.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/guides/octree/field_slots.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

#include <cstdint>

namespace wfpg {

/// Constants of learnt fractions, with what was measured of them at 64 samples of 128 x 128 pixels.
struct fraction_constants {
  /// Lower bound: light that moves in is found.
  static constexpr float least = 0.1f;
  /// Upper bound. What the BSDF alone finds has up to 1 / (1 - most) times its noise. 0.95 gains 2% in
  /// thin-wall, and loses 4% in ajar, which then has a bright pixel.
  static constexpr float most = 0.9f;
  /// Directions that the first fraction counts as.
  static constexpr float first_counts = 32.0f;
  /// Part of what was learnt that the next sample keeps. Older directions had another mixture. 0.97 is no
  /// better.
  static constexpr float kept_part = 0.9f;
  /// Largest sum of light that a file may have. What a direction brought is at most 1e30.
  static constexpr float most_light = 1.0e36f;
};

/// Sums over one sample's directions from surfaces of one kind. Integers, so that the order of threads does
/// not matter. 24 bytes.
struct fraction_sums {
  std::uint64_t light = 0;    ///< sum of X, in units of the reference / 2^20
  std::uint64_t guided = 0;   ///< sum of X times its share in steps
  std::uint32_t count = 0;    ///< directions
  std::uint32_t largest = 0;  ///< float bits of the largest X
};

/// Sums over directions of earlier samples from surfaces of one kind, each sample forgotten a little. 16
/// bytes.
struct fraction_means {
  float light = 0.0f;      ///< sum of X
  float guided = 0.0f;     ///< sum of X times its share
  float count = 0.0f;      ///< directions
  float reference = 0.0f;  ///< an X of which 16 times are not exceeded; 0: none was seen
};

/// All that a field learns of its fractions: of smooth surfaces, then of narrow ones. 88 bytes.
struct field_fractions {
  fraction_sums sums[2];    ///< of this sample
  fraction_means means[2];  ///< of the samples before
  float first = 0.0f;       ///< fraction that the field begins with

  /// Adds what one direction brought, over its density; at most 1e30. Any number of threads may call it at
  /// once. Drops what is negative or not finite. A sample in which nothing had been seen before learns the
  /// reference alone.
  WFPG_HD void add(float brought, guide_share share) {
    if (!share.is_known() || !is_finite(brought) || !(brought >= 0.0f)) return;
    const std::uint32_t kind = share.is_narrow() ? 1 : 0;
    fraction_sums& to = sums[kind];
    atomic_add(&to.count, 1);
    brought = min(brought, 1.0e30f);
    const std::uint32_t bits = float_bits(brought) & 0x7fffffffu;  // without zero's sign
    if (atomic_load(&to.largest) < bits) atomic_max(&to.largest, bits);
    const float reference = means[kind].reference;
    if (!(reference > 0.0f)) return;
    const auto units = static_cast<std::uint64_t>(min(brought / reference, most_references) * unit);
    if (units == 0) return;
    atomic_add(&to.light, units);
    atomic_add(&to.guided, units * share.steps());
  }

  /// Ends the sample of one kind of surface, and returns the fraction for the next. `now`: today's. One
  /// thread calls it.
  WFPG_HD float learn(std::uint32_t kind, float now) {
    const fraction_sums from = sums[kind];
    if (from.count == 0) return now;
    sums[kind] = {};
    fraction_means& to = means[kind];
    const float scale = to.reference / unit;
    const auto steps = static_cast<float>(kind == 0 ? guide_share::smooth_steps : guide_share::narrow_steps);
    const bool first_seen = !(to.reference > 0.0f);
    const float largest = bits_float(from.largest);
    if (first_seen)
      to.reference = largest;
    else {
      to.light = fraction_constants::kept_part * to.light + static_cast<float>(from.light) * scale;
      to.guided = fraction_constants::kept_part * to.guided + static_cast<float>(from.guided) / steps * scale;
      to.count = fraction_constants::kept_part * to.count + static_cast<float>(from.count);
      // One bright direction must not set the scale of all that follow.
      to.reference = clamp(largest, 0.5f * to.reference, most_references * to.reference);
    }
    if (!(to.light > 0.0f && to.count > 0.0f)) return now;
    const float before = fraction_constants::first_counts * (to.light / to.count);
    if (!is_finite(to.light + before) || !is_finite(to.guided)) {  // too bright for floats: it begins anew
      to = {};
      return now;
    }
    return clamp((to.guided + before * first) / (to.light + before), fraction_constants::least,
                 fraction_constants::most);
  }

 private:
  static constexpr float unit = 0x1p20f, most_references = 16.0f;
};

/// Kernel: gives the fields that a sample's rays used their new fractions.
struct learn_fractions {
  array_view<field_slot> slots;  ///< which of them were used
  std::uint32_t sample;          ///< that ends
  field_fractions* fractions;    ///< a slot
  resident_field* fields;        ///< a slot

  /// Learns the fractions of slot `i`.
  WFPG_HD void operator()(std::size_t i) const {
    resident_field& field = fields[i];
    if (slots[i].last_used != sample || !field.is_built()) return;
    const float smooth = fractions[i].learn(0, field.fraction());
    field.set_fractions(smooth, fractions[i].learn(1, field.narrow_fraction()));
  }
};

}  // namespace wfpg
