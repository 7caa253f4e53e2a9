// References: half by path tracing and half guided, so that neither method is favoured. Each half has chunks
// of different random numbers, so that an interrupted reference can be resumed.
#pragma once

#include "runner.hpp"

#include <array>
#include <string>
#include <vector>

namespace quality {

struct reference_plan {
  std::array<std::vector<planned_run>, 2> halves;

  /// Identifies a reference.
  std::string hash() const;
};

/// `spp` samples, at least 2, in chunks of `chunk` samples, positive.
reference_plan plan_reference(const scene_choice& scene, const std::string& identity, int spp, int chunk);

struct reference {
  render::image picture;
  std::array<render::image, 2> halves;
  render::image_error noise;  ///< of the picture, from its halves
};

/// Renders the chunks that the cache does not have.
reference make_reference(const reference_plan& plan, const render::scene& scene, runner& runs);

}  // namespace quality
