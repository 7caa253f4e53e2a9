// Measures what guiding gains: the variance of paths that sampled their BSDFs, over that of guided paths.
//
// Paths of one index in several samples go through one pixel, so that differences between them are noise.
// Half the mean square of differences of two guided paths is the variance of guided paths. Differences of up
// to four unguided paths give that of unguided ones.
//
// Differences are relative to what the cache expects of the path's first surface, and the mean of the scene.
// Dark and bright parts then count alike, and no part without light counts much. Squares count up to 8, and
// larger differences linearly (Huber 1964), since a few bright paths would decide alone. The means of both
// kinds of paths show where unguided ones miss light: a path counts 8 at most. The gain's standard error
// follows from the squares of what paths add to both variances.
//
// Source: wfpg's own. Cost: a look-up and O(vertices) a path, over at most 65,536 paths, and a reduction.
// Memory: 28 bytes a path, at most 1.75 MiB. With ranks 12 a path more.
//
// With ranks, each has a part of the compared paths, and all keep all of them. Traffic: 12 bytes a path of
// the first unguided sample, and 4 of others that are compared.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/statistics.hpp>
#include <wfpg/guides/octree/detail/gain_kernels.hpp>
#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/ranks/communicator.hpp>

namespace wfpg {

/// Compares the paths of guided samples with those of unguided ones. Movable, not copyable. Precondition:
/// the paths to compare are the same ones in all calls, and the recorder records them.
template <class Exec>
class gain_meter {
 public:
  /// Most paths that are measured: more would not change what is decided.
  static constexpr std::size_t most_paths = 65536;
  /// Least paths to compare, where as many are recorded. Of all paths one in 16 is enough.
  static constexpr std::size_t least_paths = 4096;

  /// Returns log2 of the number of recorded paths of which one is compared. `paths`: of a sample.
  static std::uint32_t rarer(std::size_t recorded, std::size_t paths) {
    const std::size_t wanted = clamp(paths / 16, least_paths, most_paths);
    std::uint32_t result = 0;
    while (recorded >> (result + 1) >= wanted || recorded >> result > most_paths) ++result;
    return result;
  }

  /// A meter of no paths, whose gain is never known.
  gain_meter() = default;
  /// A meter for up to `paths` paths to compare. With 0, gains are never known. `ranks`: each has a part of
  /// these paths. Throws out_of_memory.
  gain_meter(const Exec& exec, std::size_t paths, communicator* ranks = nullptr);

  /// Keeps what the recorded paths of an unguided sample brought. `number`: that sample's among unguided
  /// ones, less than rest_constants::most_unguided. 0: all that was kept is forgotten. 1: it
  /// returns what unguided paths contribute to a gain, and waits for the work before it. For others it
  /// returns no paths. Call it before the recorder is cleared. O(paths).
  guiding_gain keep_unguided(const Exec& exec, const path_recorder<Exec>& recorder,
                             const recorded_runs& compared, const exitance_cache_view& cache,
                             std::uint32_t number);
  /// Measures the recorded paths of a guided sample, and keeps what they brought. The gain is known from the
  /// second call on, after two unguided samples. Call it before the recorder is cleared, and before the cache
  /// has these paths. Waits for the work before it. O(paths).
  guiding_gain gain(const Exec& exec, const path_recorder<Exec>& recorder, const recorded_runs& compared,
                    const exitance_cache_view& cache);

  /// Forgets all that is kept. The next gain() then knows no path. O(paths).
  void forget(const Exec& exec);
  /// Most paths to compare.
  std::size_t size() const { return kept_.size(); }
  /// Bytes in the policy's memory: 28 a path, and 12 more with ranks.
  std::size_t bytes() const { return kept_.bytes() + words_.bytes() + sums_.bytes(); }

 private:
  friend struct detail::guide_sections;

  // Variances and means from the sums over paths.
  static guiding_gain gain_of(const detail::path_sums& sums);
  // Standard error of the logarithm of the gain of typical paths.
  static double error_of(const detail::path_sums& sums);
  // Sum of what measure(i) adds, for i in [0, n).
  template <class Measure>
  static detail::path_sums sum(const Exec& exec, std::size_t n, const Measure& measure);
  // Sums over the paths of all ranks, of those over this rank's `own`.
  detail::path_sums sum_of_ranks(const Exec& exec, detail::path_sums own);
  // Keeps what paths brought in earlier_paths::radiance(number).
  void keep(const Exec& exec, const detail::measured_paths& paths, std::uint32_t number);
  // Keeps what the paths of all ranks brought.
  void keep_of_ranks(const Exec& exec, const detail::measured_paths& paths, std::uint32_t number);
  // Number of paths, for which there is room.
  std::size_t count(const detail::measured_paths& paths) const {
    const std::size_t first = paths.compared.first_place();
    return first < kept_.size() ? min(paths.size(), kept_.size() - first) : 0;
  }

  communicator* ranks_ = nullptr;
  buffer<detail::earlier_paths, Exec> kept_;  // a measured path, of all ranks
  buffer<std::uint32_t, Exec> words_;         // 3 a measured path, with ranks
  buffer<std::uint64_t, Exec> sums_;          // path_sums, with ranks
};

}  // namespace wfpg

#include <wfpg/guides/octree/detail/gain_meter_impl.hpp>
