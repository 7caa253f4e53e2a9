// The part of a wave that one rank traces.
#pragma once

#include "tracer/rng.hpp"

#include <cstdint>

namespace render {

/// A wave has all pixels of `samples` samples: path p is that of pixel p % pixels in its sample p / pixels. A
/// rank traces `count` of these paths, which it numbers from 0.
struct wave_share {
  std::uint32_t pixels = 0;   ///< of the picture
  std::uint32_t samples = 1;  ///< of a wave
  std::uint32_t first = 0;    ///< the wave's path that is this rank's path 0
  std::uint32_t count = 0;    ///< paths of this rank

  /// One sample of all pixels, by one rank.
  static wave_share all_of(std::size_t pixels) {
    const auto count = static_cast<std::uint32_t>(pixels);
    return {count, 1, 0, count};
  }
  /// Part `rank` of `ranks` of a wave. Precondition: pixels * samples is at least `ranks` and less than 2^32.
  static wave_share part_of(std::size_t pixels, std::size_t samples, std::size_t rank, std::size_t ranks) {
    const std::size_t paths = pixels * samples, first = paths * rank / ranks;
    return {static_cast<std::uint32_t>(pixels), static_cast<std::uint32_t>(samples),
            static_cast<std::uint32_t>(first),
            static_cast<std::uint32_t>(paths * (rank + 1) / ranks - first)};
  }

  /// Paths of all ranks.
  std::size_t all_paths() const { return std::size_t(pixels) * samples; }
  /// The random numbers of this rank's paths, where the wave begins with sample `sample`.
  random_stream random(std::uint64_t seed, std::uint32_t sample) const {
    return {seed, sample, first, pixels};
  }
};

}  // namespace render
