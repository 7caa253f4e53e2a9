// What a sarsa_grid can be told: how it learns, how it draws (Kim & Kim, "Fast and Lightweight Path Guiding
// Algorithm on GPU", 2021).
#pragma once

#include <wfpg/guide/sampling_options.hpp>

#include <cstdint>

namespace wfpg {

/// What a direction's radiance is learnt from (section 2).
enum class sarsa_update : std::uint8_t {
  sarsa,           ///< the next vertex: what it emits, and the path's next direction as it is known (Eq. 6)
  expected_sarsa,  ///< what it emits, and all directions there as they are known (Eq. 5): B² BSDFs a ray
  monte_carlo      ///< all that the path gathers from there
};

/// How a sarsa_grid draws directions (section 3).
enum class sarsa_sampler : std::uint8_t {
  sphere_inversion,      ///< the radiance alone, by inversion: O(log B), and half of it below the surface
  hemisphere_inversion,  ///< radiance times cosine above the surface, by inversion: O(B²)
  rejection,       ///< the same by rejection from the uniform hemisphere: O(1/c), c being its acceptance
  mixed_rejection  ///< that mixed with the uniform hemisphere by the optimal share (Eqs. 8, 9)
};

/// What a sarsa_grid can be told, beside sampling_options, of which guide_fraction is 0.5 by default. Ranges
/// are checked when a guider is made.
struct sarsa_grid_options : sampling_options {
  std::uint32_t resolution = 8;               ///< cells along each side of the scene's bounds, in [1, 64]
  std::uint32_t direction_resolution = 16;    ///< B: directions along their square's side, even, in [2, 64]
  std::uint32_t normal_resolution = 16;       ///< steps between normals along their square's side, even, in
                                              ///< [2, 64]
  sarsa_update update = sarsa_update::sarsa;  ///< what is learnt
  sarsa_sampler sampler = sarsa_sampler::mixed_rejection;  ///< how directions are drawn
  std::uint32_t step = 8;  ///< samples after which what was learnt is used, at least 1
  /// alpha of Eq. 7, in [0, 1]: what a new value counts for beside what is known, once 1 / learning_rate
  /// values are; before that, and with 0, all count alike. SARSA forgets by it what it took for radiance
  /// before light had come so far.
  float learning_rate = 0.05f;
  float floor = 0.01f;  ///< that each direction has at least, times the cell's mean: finite, at least 0
  /// Of the paths of a sample so many are recorded, others in each, that directions get about as many values
  /// on average, or up to twice as many; once means have settled a quarter of that, in one sample of four, or
  /// in two or all where there are few paths. 0: all are, in all samples.
  std::uint32_t values_per_direction = 4;
};

}  // namespace wfpg
