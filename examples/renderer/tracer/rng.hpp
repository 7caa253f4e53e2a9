// Counter-based random numbers: a pure function of their use. A picture therefore does not depend on the
// order of threads.
#pragma once

#include <wfpg/base/types.hpp>

#include <cstdint>

namespace render {

/// The source of random numbers of one path in one sample.
class random_stream {
 public:
  WFPG_HD random_stream() : random_stream(0, 0) {}
  /// `sample`: of the wave's first paths. `first`: the wave's path that is path 0 here. `pixels`: paths of a
  /// sample; the next sample follows them.
  WFPG_HD random_stream(std::uint64_t seed, std::uint32_t sample, std::uint32_t first = 0,
                        std::uint32_t pixels = 0xffffffffu)
      : seed_(mix(seed + 0x632be59bd9b4e019ull)),
        first_sample_(mix(seed_ ^ sample)),
        sample_(sample),
        first_(first),
        pixels_(pixels) {}

  /// Two independent numbers in [0, 1) for a path and a use (`dimension`).
  WFPG_HD wfpg::vec2 operator()(std::uint32_t path, std::uint32_t dimension) const {
    const std::uint64_t counter = (static_cast<std::uint64_t>(pixel_of(path)) << 32) | dimension;
    const std::uint32_t sample = sample_of(path);
    const std::uint64_t bits = mix((sample == sample_ ? first_sample_ : mix(seed_ ^ sample)) + counter);
    return {unit(static_cast<std::uint32_t>(bits >> 40)), unit(static_cast<std::uint32_t>(bits & 0xffffffu))};
  }

  /// The pixel and the sample of a path. Few waves have more than one sample.
  WFPG_HD std::uint32_t pixel_of(std::uint32_t path) const {
    const std::uint32_t in_wave = first_ + path;
    return in_wave < pixels_ ? in_wave : in_wave % pixels_;
  }
  WFPG_HD std::uint32_t sample_of(std::uint32_t path) const {
    const std::uint32_t in_wave = first_ + path;
    return in_wave < pixels_ ? sample_ : sample_ + in_wave / pixels_;
  }

 private:
  // The finaliser of SplitMix64 (Steele, Lea, Flood 2014): every input bit reaches every output bit.
  WFPG_HD static std::uint64_t mix(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
  }
  WFPG_HD static float unit(std::uint32_t bits24) { return static_cast<float>(bits24) * 0x1p-24f; }

  // Mixed once, not for each number.
  std::uint64_t seed_, first_sample_;
  std::uint32_t sample_, first_, pixels_;
};

/// Uses of random numbers at one vertex. Those of the next vertex begin `per_vertex` later.
namespace dimension {
inline constexpr std::uint32_t direction = 0;  ///< this one and the next: the guider's
inline constexpr std::uint32_t light_point = 2;
inline constexpr std::uint32_t light_choice = 3;
inline constexpr std::uint32_t roulette = 4;
inline constexpr std::uint32_t light_texel = 5;  ///< of an environment
inline constexpr std::uint32_t light_group = 6;
inline constexpr std::uint32_t per_vertex = 8;
inline constexpr std::uint32_t pixel = 0xffffffffu;  ///< the camera's
}  // namespace dimension

}  // namespace render
