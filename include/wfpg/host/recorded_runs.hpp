// Chooses which paths of a sample are recorded, or guided, where only a part of them is.
//
// Example: with a shift of 2 and 512 paths there are 16 runs of 32 paths, in 4 groups. One run of each group
// takes part, so that there are 128 places. With a `rarer` of 3, these are 16 runs of 8 paths, of which two
// take part.
//
// Source: wfpg's own. Cost: one integer hash a look-up, two where `rarer` is set. Memory: 12 bytes, passed to
// kernels by value.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

/// A part of a sample's paths: one run of 32 paths in each group of 2^shift runs, chosen at random for each
/// sample. A run's paths are neighbours in memory, so that recording them writes whole cache lines. With
/// `rarer`, a part of these again, in runs of 8. By default all paths take part.
struct recorded_runs {
  static constexpr std::uint32_t run = 32;       ///< paths in a row that take part together
  static constexpr std::uint32_t rarer_run = 8;  ///< such paths where `rarer` is set: more and smaller places

  std::uint32_t shift = 0;  ///< log2 of the runs in a group
  std::uint32_t seed = 0;   ///< chooses the run of each group; differs between samples
  std::uint32_t rarer = 0;  ///< log2 of the paths of the runs of which one takes part

  /// Returns log2 of the number of paths of which one takes part.
  /// All take part where it is 0.
  WFPG_HD std::uint32_t log2_divisor() const { return shift + rarer; }
  /// Returns the places to store for a sample of `paths` paths. The last group counts as a whole one, so
  /// that some places may have no path.
  WFPG_HD std::size_t size(std::size_t paths) const {
    const std::size_t group = std::size_t(run) << shift, rare = std::size_t(rarer_run) << rarer;
    const std::size_t in_runs = shift == 0 ? paths : (paths + group - 1) / group * run;
    return rarer == 0 ? in_runs : min((in_runs + rare - 1) / rare * rarer_run, in_runs);
  }
  /// Writes the place of a path in the part, below size(). False where the path takes no part. Precondition:
  /// `path` is below 2^32.
  WFPG_HD bool find(std::size_t path, std::uint32_t& place) const {
    place = static_cast<std::uint32_t>(path);
    if (shift > 0) {
      const std::uint32_t group = place / run >> shift;
      if ((place / run & mask(shift)) != run_of(group)) return false;
      place = group * run + place % run;
    }
    if (rarer == 0) return true;
    const std::uint32_t group = place / rarer_run >> rarer;
    if ((place / rarer_run & mask(rarer)) != rarer_run_of(group)) return false;
    place = group * rarer_run + place % rarer_run;
    return true;
  }
  /// Whether a path takes part. One that is not known does. Precondition: as for find().
  WFPG_HD bool includes(std::uint32_t path) const {
    std::uint32_t place;
    return path == no_path || find(path, place);
  }
  /// Returns the path of a place: the inverse of find(). It may be beyond the sample's paths.
  WFPG_HD std::size_t path(std::uint32_t place) const {
    if (rarer > 0) {
      const std::uint32_t group = place / rarer_run;
      place = (group << rarer | rarer_run_of(group)) * rarer_run + place % rarer_run;
    }
    if (shift == 0) return place;
    const std::uint32_t group = place / run;
    return (std::size_t(group) << shift | run_of(group)) * run + place % run;
  }

 private:
  // Selects the low bits.
  WFPG_HD static std::uint32_t mask(std::uint32_t bits) { return (1u << bits) - 1u; }
  // Number of the run that takes part, in a group of runs.
  WFPG_HD std::uint32_t run_of(std::uint32_t group) const { return hash32(seed, group) & mask(shift); }
  // Number of the run of places that takes part, in a group of them.
  WFPG_HD std::uint32_t rarer_run_of(std::uint32_t group) const { return hash32(~seed, group) & mask(rarer); }
};

}  // namespace wfpg
