// Options of sarsa_grid: how it learns and how it samples directions.
//
// Source: Kim & Kim, "Fast and Lightweight Path Guiding Algorithm on GPU", 2021, sections 2 and 3.
// Cost: of each choice, beside its name. Memory: as sarsa_grid.hpp says, by the resolutions.
#pragma once

#include <wfpg/guide/sampling_options.hpp>

#include <cstdint>
#include <optional>

namespace wfpg {

/// Values from which a direction's radiance is learnt (section 2). Each is the radiance that arrives along
/// the direction, from the path's next vertex.
enum class sarsa_update : std::uint8_t {
  /// What the next vertex emits, and what it scatters of the path's one next direction. The known radiance of
  /// that direction counts (Eq. 6).
  sarsa,
  /// What the next vertex emits, and what it scatters of all its directions, at their known radiances (Eq.
  /// 5).
  /// Evaluates B² BSDFs a ray.
  expected_sarsa,
  /// All radiance that the rest of the path brings to the next vertex. Reads no known radiance.
  monte_carlo
};

/// How a sarsa_grid samples directions (section 3). B is direction_resolution.
enum class sarsa_sampler : std::uint8_t {
  /// Proportional to radiance over the sphere, by inversion: O(log B). Directions below the surface are lost.
  sphere_inversion,
  /// Proportional to radiance times cosine above the surface, by inversion: O(B²).
  hemisphere_inversion,
  /// Density of hemisphere_inversion, by rejection from the uniform hemisphere: O(1/c) tries, where c is the
  /// acceptance.
  rejection,
  /// Rejection mixed with the uniform hemisphere, with the optimal weights of Eqs. 8 and 9: fewer tries.
  mixed_rejection
};

/// Options of sarsa_grid, beside sampling_options; guide_fraction is 0.5 where unset. The guide's constructor
/// throws std::invalid_argument for values out of range.
struct sarsa_grid_options : sampling_options {
  std::uint32_t resolution = 8;  ///< cells along each side of the scene's bounds, in [1, 64]
  /// B: directions along each side of the octahedral square, even, in [2, 64]. A cell has B² directions.
  std::uint32_t direction_resolution = 16;
  /// Resolution of the normals that products are normalised for: steps along each side of the octahedral
  /// square, even, in [2, 64].
  std::uint32_t normal_resolution = 16;
  sarsa_update update = sarsa_update::sarsa;               ///< which values are learnt
  sarsa_sampler sampler = sarsa_sampler::mixed_rejection;  ///< the sampling algorithm
  std::uint32_t step = 8;  ///< period, in samples, in which learnt radiance is published to rays; at least 1
  /// Weight of a new value in a mean, alpha of Eq. 7, in [0, 1]. It applies once a direction has
  /// 1 / learning_rate values. Before that, and with 0, all values weigh alike. SARSA needs it to forget
  /// early values, which lack light that had not reached the next vertex yet.
  float learning_rate = 0.05f;
  float floor = 0.01f;  ///< least weight of a direction, in multiples of the cell's mean: finite, at least 0
  /// Target for the values that a direction gets a sample, on average over all directions, at least 1. It
  /// sets the recorded fraction of paths, which yields up to twice as many. After the warm-up a quarter
  /// suffices: one sample of four is recorded, or one of two, or all where there are few paths. Unset: all
  /// paths of all samples are recorded.
  std::optional<std::uint32_t> values_per_direction = 4;
};

}  // namespace wfpg
