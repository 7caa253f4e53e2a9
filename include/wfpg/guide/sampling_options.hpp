// Options that every guide has. A guide's own options derive from sampling_options.
//
// Source: Yalçıner & Akyüz, "Path Guiding for Wavefront Path Tracing", 2024, section 3.7, where a member says
// so. Cost: ranges are checked once, on the host. Memory: a struct on the host.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/base/math.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>

namespace wfpg {

// In ranks/communicator.hpp, which adapters and guides include.
class communicator;

/// Options of guiding. path_guider's constructor checks the ranges and throws std::invalid_argument.
struct sampling_options {
  /// Probability that the guide, not the BSDF, samples a direction; in (0, 1]. Unset: the guide's default, or
  /// what it learns.
  std::optional<float> guide_fraction;
  /// Number of depths that are guided, from 0 on; at least 1. Deeper rays sample their BSDFs. Default: all.
  /// With next-event estimation, leave out the depth of a path's last direction. That direction finds
  /// emitters alone, and the BSDF samples it as well for less. So set n - 2 for paths of n segments, if that
  /// is one or more.
  std::uint32_t guided_depths = 0xffffffffu;
  /// Guide toward emitters themselves, too. With next-event estimation, emitters count with their MIS weight.
  /// False leaves them to next-event estimation: better where fields do not learn.
  bool include_emission = true;
  /// Samples at the beginning, and after forget_light(), that only record: "PT first" in section 3.7.
  std::uint32_t unguided_samples = 1;
  /// Gain below which guiding does not pay: at least 1, or 0 for a guide that never rests. Unset: what suits
  /// policy and scene, rest_constants::gpu_least_gain or cpu_least_gain(). Samples 4, 8, 16 and so on are
  /// compared with unguided ones. Where the variance of paths falls by less than this at equal numbers of
  /// vertices, the guide rests until the next comparison. A sample that rests costs what path tracing costs.
  /// Less is asked for where paths are noisy: rest_schedule::enough(). Where they are not, the guide
  /// rests until two million paths or 28 samples are made: rest_schedule::see_unguided().
  ///
  /// Until it is known whether guiding pays, at least until sample 4, few paths are recorded. The guide takes
  /// part in these alone, if surfaces tell their paths (surface::path), and in none of sample 2. Needs
  /// unguided_samples of at least 1, and a guide that measures. It also needs 2048 paths that are recorded,
  /// and go through the same surfaces in all samples that are compared.
  std::optional<float> least_gain;
  std::uint64_t seed = 0;  ///< seed of the guider's own random numbers; the renderer's come with each wave
  /// Most paths of a sample that the recorder has room for, less than 2^32 - 1. 0 records nothing. Times
  /// max_depth it must be less than 2^32 - 1, too.
  std::size_t max_paths = 0;
  /// Most vertices of a path that the recorder holds, in [1, 1024]. Statistics count as many depths, and
  /// deeper ones with the last.
  std::uint32_t max_depth = 8;
  /// The recorder keeps the last vertex of each path, for path_guider::prepare(depth, caster). 28 bytes a
  /// path of max_paths.
  /// Each wave then has max_paths rays, so leave max_rays unset.
  bool records_waves = false;
  /// The host does not call path_recorder_view::escape(). A direction of which nothing more is heard has
  /// found no light. For hosts without environment, or with a dark one.
  ///
  /// Tell scatter() only of rays that are traced. So call it after roulette, and not where a path may end in
  /// a medium. Each hit must be told to vertex(), or its light to emission() or total(). Directions of paths
  /// that end for other reasons would be learnt as dark.
  bool silent_escapes = false;
  /// Most rays of a wave, less than 2^32 - 1. Larger waves throw std::invalid_argument. Unset: max_paths.
  std::optional<std::size_t> max_rays;
  /// Joins the ranks that learn one guide, each with a part of the paths of every sample. Null: this rank has
  /// all paths. It must outlive the guider. Every rank makes the same samples and waves, waves without rays
  /// too. A path has at most one ray in a wave. Surfaces tell their paths, or ray i is that of path i.
  communicator* ranks = nullptr;
  /// Index of this rank's path 0 among the paths of all ranks. The ranks' parts do not overlap. All paths
  /// that the host tells of are numbered from 0 in its part. 0 without ranks.
  std::size_t first_path = 0;
  /// Paths of all ranks in a sample: first_path + max_paths or more, less than 2^31 / max_depth. 0:
  /// max_paths.
  std::size_t all_paths = 0;
};

namespace detail {

/// Paths of a sample: those of all ranks.
inline std::size_t all_paths_of(const sampling_options& o) {
  return o.all_paths > 0 ? o.all_paths : o.max_paths;
}

/// Throws std::invalid_argument, which names the option and its range, where one is out of range.
WFPG_COLD inline void require_valid(const sampling_options& o) {
  const float fraction = o.guide_fraction.value_or(1.0f);
  require(fraction > 0.0f && fraction <= 1.0f, "guide_fraction", fraction, "in (0, 1]");
  const float least = o.least_gain.value_or(1.0f);
  require(is_finite(least) && (least == 0.0f || (least >= 1.0f && least <= 1.0e6f)), "least_gain", least,
          "0, or in [1, 1e6]");
  require(o.guided_depths >= 1, "guided_depths", o.guided_depths, "at least 1");
  require(o.max_depth >= 1 && o.max_depth <= 1024, "max_depth", o.max_depth, "in [1, 1024]");
  require(o.max_paths < 0xffffffffull, "max_paths", o.max_paths, "less than 2^32 - 1");
  const std::size_t rays = o.max_rays.value_or(o.max_paths);
  require(rays < 0xffffffffull, "max_rays", rays, "less than 2^32 - 1");
  require(o.max_paths * o.max_depth < 0xffffffffull, "max_paths times max_depth, the vertices of a sample,",
          o.max_paths * o.max_depth, "less than 2^32 - 1");
  if (!o.ranks) {
    require(o.first_path == 0, "first_path", o.first_path, "0 without ranks");
    return require(o.all_paths == 0 || o.all_paths == o.max_paths, "all_paths", o.all_paths,
                   "max_paths without ranks");
  }
  require(o.max_paths >= 1, "max_paths", o.max_paths, "at least 1 with ranks");
  const std::size_t all = all_paths_of(o);
  require(o.first_path + o.max_paths <= all, "first_path plus max_paths", o.first_path + o.max_paths,
          "at most all_paths");
  require(all * o.max_depth < 0x80000000ull, "all_paths times max_depth", all * o.max_depth,
          "less than 2^31");
}

}  // namespace detail
}  // namespace wfpg
