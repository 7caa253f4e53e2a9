// Chooses how many paths of a sample are recorded, and in how many samples, from the number of values that a
// guide wants.
//
// Source: wfpg's own. Cost: O(log(vertices / wanted)) on the host, once a guider. Memory: 40 bytes.
#pragma once

#include <wfpg/exec/support/value_queue.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/sampling_options.hpp>
#include <wfpg/host/recorded_runs.hpp>

#include <string>

namespace wfpg::detail {

// Example: 2^20 paths of 8 vertices and 100,000 wanted give a shift of 6 and 131,072 vertices a sample.

/// Records one path in 2^shift: the largest shift that still yields `wanted` vertices a sample. So a sample
/// has `wanted` vertices, or up to twice as many. Counts max_depth vertices a path.
class recorded_fraction {
 public:
  /// `wanted` is in vertices a sample; 0 records all paths of all samples.
  recorded_fraction(const sampling_options& o, std::uint64_t wanted)
      : paths_(o.max_paths),
        first_(static_cast<std::uint32_t>(o.first_path)),
        all_(all_paths_of(o)),
        depth_(o.max_depth),
        wanted_(wanted) {}

  /// What a guide's recording() returns. After warm-up one sample of four is recorded, with as many vertices
  /// as before: means of many samples change slowly. One of two is where paths are few.
  ///
  /// Measured where all paths are recorded, after 256 samples, in scenes of wfpg-render. At 112 x 112 pixels
  /// a stride of 4 takes 0.81 of the time of a stride of 1. Its error is 1.01 to 1.07 times as large. At 48 x
  /// 48 the error is up to 1.2 times as large, and with a stride of 2 at most 1.03 times.
  recording_needs needs(bool directions) const {
    const std::uint64_t all = std::uint64_t(all_) * depth_;
    const std::uint32_t stride = wanted_ == 0 ? 1 : few * all < wanted_ ? 2 : 4;
    return {shift(wanted_), directions, stride};
  }

  /// Most vertices that this rank can have in a recorded sample: the capacity of a value queue. Throws
  /// std::invalid_argument above 2^31, the most that a queue holds; the message advises to set `options`.
  std::size_t vertices(const char* options) const {
    // Whole groups of runs are stored, so that this may exceed the fraction by a run.
    const std::size_t count = recorded_runs{shift(wanted_), 0, 0, first_}.size(paths_) * depth_;
    const std::string remedy = std::string("at most 2^31: set ") + options;
    require(count <= most_queued, "max_paths times max_depth, the vertices that are recorded,", count,
            remedy.c_str());
    return count;
  }

  /// Most paths that a recorded sample can have, on all ranks together.
  std::size_t paths() const { return part(0); }
  /// Most paths of a sample that records one in 2^rarer of them, on all ranks together.
  std::size_t part(std::uint32_t rarer) const { return recorded_runs{shift(wanted_), 0, rarer}.size(all_); }

 private:
  // Paths are few whose vertices are less than one in so many of those wanted.
  static constexpr std::uint64_t few = 32;

  // A shift is log2 of a divisor: recorded_runs records so many paths fewer.

  /// Largest shift by which at least `wanted` of all vertices remain; 0 where `wanted` is 0.
  std::uint32_t shift(std::uint64_t wanted) const {
    const std::uint64_t all = std::uint64_t(all_) * depth_;
    std::uint32_t result = 0;
    while (wanted > 0 && all >> (result + 1) >= wanted) ++result;
    return result;
  }

  std::size_t paths_;     ///< max_paths
  std::uint32_t first_;   ///< first_path
  std::size_t all_;       ///< paths of all ranks
  std::uint32_t depth_;   ///< max_depth
  std::uint64_t wanted_;  ///< vertices a sample
};

}  // namespace wfpg::detail
