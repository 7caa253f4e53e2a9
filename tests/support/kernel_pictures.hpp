// Pictures of examples/kernels, and the means of their tiles.
#pragma once

#include "renderer.hpp"
#include "support/renderings.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace wfpg_test {

/// A picture of the host, and how long it is rendered.
struct kernel_picture {
  std::string scene;
  float fog = 0.0f;                ///< scattering events per scene unit
  int guided = 8;                  ///< samples of a pixel in a picture that guiding renders
  int unguided = 8;                ///< and in one that is path traced
  int side = tiles * tile_pixels;  ///< of the picture, in pixels
  int pictures = renderings;       ///< whose means are compared

  render::scene world() const { return make_test_scene(scene); }
};

/// The host's renderer of a picture of `side` by `side` pixels.
inline std::unique_ptr<kernels::renderer> host_of(const render::scene& world, int side, float fog,
                                                  bool guided, std::uint64_t seed, kernels::device where) {
  kernels::settings wanted;
  wanted.width = wanted.height = side;
  wanted.max_depth = 6;
  wanted.fog = fog;
  wanted.guided = guided;
  wanted.seed = seed;
  return kernels::make_renderer(where, world, wanted);
}

/// The tiles of a picture's renderings, each of which goes on with what the guide has learnt before.
inline tile_means tiles_of(const kernel_picture& what, bool guided, int factor = 1) {
  const auto host = host_of(what.world(), what.side, what.fog, guided,
                            static_cast<std::uint64_t>(10 * factor + (guided ? 1 : 2)),
                            kernels::device::serial);  // such waves are too small to share
  const int samples = guided ? what.guided : what.unguided;
  tile_means result(tiles * tiles);
  for (int picture = 0; picture < factor * what.pictures; ++picture) {
    std::vector<double> sums(tiles * tiles, 0.0);
    for (int sample = 0; sample < samples; ++sample) {
      const std::vector<double> one = tiles_of(render::image{what.side, what.side, host->sample()});
      for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += one[i] / samples;
    }
    result.add(sums);
  }
  return result;
}

/// The median over lit tiles of the standard error of a tile's mean, as a part of the mean.
inline double median_error(const tile_means& of) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < of.size(); ++i)
    if (of.mean(i) > 0.0) errors.push_back(std::sqrt(of.variance_of_mean(i)) / of.mean(i));
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2),
                   errors.end());
  return errors[errors.size() / 2];
}
/// The standard error of a picture's mean, as a part of the mean.
inline double error_of_picture(const tile_means& of) {
  return std::sqrt(of.variance_of_picture_mean()) / of.picture_mean();
}

}  // namespace wfpg_test
