// A host whose paths have one vertex on a wall. A path brings 0, or its pixel's mean over the probability of
// not bringing 0: that probability sets the variance. For guides that measure what they gain.
#pragma once

#include "support/scenes.hpp"

#include <wfpg/base/math.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guides/octree/options.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg_test {

/// A path with one vertex on a wall.
struct wall_path {
  static constexpr std::uint32_t count = 6000;  ///< of a sample

  vec3 position, normal;
  float mean;  ///< luminance

  WFPG_HD static wall_path of(std::uint32_t path) {
    const vec2 u = wfpg::unit_vec2(wfpg::hash(7u, path)) * 0.6f + 0.2f;
    const std::uint32_t face = path % 6;
    return {face_point(face, u.x, u.y), face_normal(face), 1.0f + static_cast<float>(face)};
  }
  /// What path `path` brings in a sample, with this probability.
  WFPG_HD static float radiance(std::uint32_t path, std::uint32_t sample, float probability) {
    const bool lit = wfpg::unit_vec2(wfpg::hash(wfpg::hash(sample, path), 11u)).x < probability;
    return lit ? of(path).mean / probability : 0.0f;
  }
};

/// Kernel: records the paths of a sample.
struct record_wall_paths {
  wfpg::path_recorder_view recorder;
  std::uint32_t sample;
  float probability;
  std::uint32_t shift;  ///< above 0: a path has another index in each sample

  WFPG_HD void operator()(std::size_t i) const {
    const auto index = static_cast<std::uint32_t>(i);
    const std::uint32_t path = shift > 0 ? (index + shift * sample) % wall_path::count : index;
    const wall_path at = wall_path::of(path);
    recorder.vertex(i, 0, at.position, at.normal, 1.0f);
    recorder.radiance(i, 0, wall_path::radiance(path, sample, probability));
  }
};

/// Options of a guide that may rest.
inline wfpg::kept_guide_options rest_options() {
  wfpg::kept_guide_options options;
  options.octree_resolution = 32;
  options.max_paths = wall_path::count;
  options.max_depth = 2;
  options.kept.budget_bytes = std::size_t(1) << 20;
  options.least_gain = 1.25f;  // for all policies
  return options;
}

}  // namespace wfpg_test
