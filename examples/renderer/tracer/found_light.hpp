// What the kernels of bidirectional methods find in a sample, by technique where someone asked for it.
#pragma once

#include "tracer/technique_set.hpp"

#include <wfpg/base/types.hpp>

namespace render {

/// A sum of what a technique finds, with its weights and without.
struct technique_sum {
  wfpg::vec3 weighted{0.0f}, plain{0.0f};

  WFPG_HD void add(wfpg::vec3 value, float weight) {
    weighted += value * weight;
    plain += value;
  }
};

/// View of a sample's picture. Trivially copyable. Calls for one pixel come from one thread at a time.
struct found_light {
  wfpg::array_view<wfpg::vec3> radiance;
  /// Pictures of all techniques, one after the other. Empty where nobody asked for them.
  wfpg::array_view<wfpg::vec3> weighted, plain;

  WFPG_HD void add(std::size_t pixel, technique by, const technique_sum& sum, wfpg::vec3 throughput) const {
    radiance[pixel] += throughput * sum.weighted;
    if (weighted.empty()) return;
    const std::size_t i = static_cast<std::size_t>(by) * radiance.size() + pixel;
    weighted[i] += throughput * sum.weighted;
    plain[i] += throughput * sum.plain;
  }
};

}  // namespace render
