// A homogeneous medium: how light fades along a ray, and where a path scatters. Pure functions, for hosts
// that trace media of their own. A path is in one medium along a segment. Its distances are drawn by one
// channel, chosen at random, with the density of all: chromatic media then have bounded weights.
//
//   const distance_sample drawn = medium.sample(u_channel, u, distance_to_surface);
//   throughput *= drawn.weight;
//   if (drawn.scatters) ...                   // at drawn.distance, by the phase function; else a surface
//
// Source: the exponential law of Beer and Lambert; one-sample MIS over channels as in pbrt-v4, section 14.2.
// Cost: an exponential a channel. Memory: 8 bytes a channel.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>

namespace wfpg {

/// Where a path that crosses a medium scatters, or that it does not. `Spectrum` has a value a channel.
template <class Spectrum>
struct basic_distance_sample {
  float distance = 0.0f;  ///< scene units, in [0, limit]
  bool scatters = false;  ///< false: the path reaches the limit
  Spectrum weight{1.0f};  ///< transmittance, times scattering where it scatters, over `pdf`
  /// Density of scattering at `distance`, per scene unit, or the probability of reaching the limit.
  float pdf = 1.0f;
};

/// A medium with the same coefficients everywhere. `Spectrum` is a vector of GLM: vec3, or four wavelengths.
template <class Spectrum>
struct basic_homogeneous_medium {
  Spectrum absorption{0.0f};  ///< per scene unit and channel, at least 0, finite
  Spectrum scattering{0.0f};  ///< per scene unit and channel, at least 0, finite

  /// Number of channels.
  static constexpr int channels = Spectrum::length();

  /// Absorption and scattering together, per scene unit.
  WFPG_HD Spectrum extinction() const { return absorption + scattering; }
  /// Part of light that passes a distance, per channel. `distance`: at least 0.
  WFPG_HD Spectrum transmittance(float distance) const {
    Spectrum result;
    const Spectrum sigma = extinction();
    for (int i = 0; i < channels; ++i) result[i] = passes(sigma[i], distance);
    return result;
  }

  /// Density with which sample() scatters after a distance, per scene unit. With `scatters` false it is the
  /// probability of getting as far. It is the same both ways along a segment. Paths whose ends differ in kind
  /// have another density for the way back: ask for the kind of the end that they reach.
  WFPG_HD float pdf(float distance, bool scatters) const {
    float sum = 0.0f;
    const Spectrum sigma = extinction();
    for (int i = 0; i < channels; ++i) sum += passes(sigma[i], distance) * (scatters ? sigma[i] : 1.0f);
    return sum / float(channels);
  }

  /// Draws where a path scatters before `limit`. `u_channel` and `u` in [0, 1). `limit`: the distance to what
  /// the ray hits, or ray::t_max, positive. It never fails.
  WFPG_HD basic_distance_sample<Spectrum> sample(float u_channel, float u, float limit) const {
    const int channel = min(static_cast<int>(u_channel * float(channels)), channels - 1);
    const float sigma = extinction()[channel];
    basic_distance_sample<Spectrum> drawn;
    drawn.distance = sigma > 0.0f ? -std::log1p(-u) / sigma : limit;
    drawn.scatters = drawn.distance < limit;
    if (!drawn.scatters) drawn.distance = limit;
    drawn.pdf = pdf(drawn.distance, drawn.scatters);
    drawn.weight = transmittance(drawn.distance) / drawn.pdf;
    if (drawn.scatters) drawn.weight *= scattering;
    return drawn;
  }

 private:
  /// exp(-sigma distance), and 1 where nothing absorbs, however far.
  WFPG_HD static float passes(float sigma, float distance) {
    return sigma > 0.0f ? std::exp(-sigma * distance) : 1.0f;
  }
};

using distance_sample = basic_distance_sample<vec3>;        ///< of a medium in three colours
using homogeneous_medium = basic_homogeneous_medium<vec3>;  ///< in three colours

}  // namespace wfpg
