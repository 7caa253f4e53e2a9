// Of how many paths a guide has the vertices recorded, and in which samples.
#pragma once

#include <wfpg/exec/support/value_queue.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/recorded_runs.hpp>
#include <wfpg/guide/sampling_options.hpp>

#include <string>

namespace wfpg::detail {

/// As few paths as have so many vertices wanted in a sample, or up to twice as many: of 2^shift one. All are
/// recorded where none are wanted in particular.
class recorded_fraction {
 public:
  recorded_fraction(const sampling_options& o, std::uint64_t wanted)
      : paths_(o.max_paths), depth_(o.max_depth), wanted_(wanted) {}

  /// A quarter of the vertices is enough once means have settled: as many, but not of all samples.
  recording_needs needs(bool directions) const {
    const std::uint32_t share = shift(wanted_), settled = shift((wanted_ + 3) / 4);
    return {share, directions, 1u << (settled - share)};
  }

  /// Of a sample, at most. Throws std::invalid_argument, which says to set `options`, where a queue holds
  /// fewer.
  std::size_t vertices(const char* options) const {
    const std::size_t count = recorded_runs{shift(wanted_)}.size(paths_) * depth_;
    const std::string remedy = std::string("at most 2^31: set ") + options;
    require(count <= most_queued, "max_paths times max_depth, the vertices that are recorded,", count,
            remedy.c_str());
    return count;
  }

 private:
  std::uint32_t shift(std::uint64_t wanted) const {
    const std::uint64_t all = std::uint64_t(paths_) * depth_;
    std::uint32_t result = 0;
    while (wanted > 0 && all >> (result + 1) >= wanted) ++result;
    return result;
  }

  std::size_t paths_;
  std::uint32_t depth_;
  std::uint64_t wanted_;
};

}  // namespace wfpg::detail
