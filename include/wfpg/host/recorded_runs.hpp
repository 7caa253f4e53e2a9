// Chooses which paths of a sample are recorded, or guided, where only a part of them is.
//
// Example: with a shift of 2 and 512 paths there are 16 runs of 32 paths, in 4 groups. One run of each group
// takes part, so that there are 128 places. With a `rarer` of 3, these are 16 runs of 8 paths, of which two
// take part.
//
// Where several ranks share a sample, all of them choose among all of its paths. `first` is the index that
// the rank's path 0 has there. A rank's places are numbered from 0, too.
//
// Source: wfpg's own. Cost: one integer hash a look-up, two where `rarer` is set. Memory: 16 bytes, passed to
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
  std::uint32_t first = 0;  ///< index of path 0 among the paths of all ranks

  /// Whether all members are equal. Unequal parts may have the same paths: all of them, where log2_divisor()
  /// is 0.
  WFPG_HD bool operator==(const recorded_runs& other) const {
    return shift == other.shift && seed == other.seed && rarer == other.rarer && first == other.first;
  }
  /// Whether some member differs.
  WFPG_HD bool operator!=(const recorded_runs& other) const { return !(*this == other); }
  /// Returns log2 of the number of paths of which one takes part.
  /// All take part where it is 0.
  WFPG_HD std::uint32_t log2_divisor() const { return shift + rarer; }
  /// Returns the places to store for a sample of `paths` paths. The first and the last group count as whole
  /// ones, so that some places may have no path.
  WFPG_HD std::size_t size(std::size_t paths) const {
    const std::size_t group = std::size_t(run) << shift, rare = std::size_t(rarer_run) << rarer;
    const std::size_t in_runs =
        shift == 0 ? paths : ((first + paths + group - 1) / group - first / group) * run;
    if (rarer == 0) return in_runs;
    const std::size_t begin = first_in_runs(), groups = (begin + in_runs + rare - 1) / rare - begin / rare;
    return first == 0 ? min(groups * rarer_run, in_runs) : groups * rarer_run;
  }
  /// Returns the places to store for all values of `rarer`.
  std::size_t capacity(std::size_t paths) const {
    const std::size_t all = recorded_runs{shift, 0, 0, first}.size(paths);
    return first == 0 ? all : all + 2 * rarer_run;
  }
  /// Returns the number that place 0 has among the places of all ranks.
  WFPG_HD std::uint32_t first_place() const {
    const std::uint32_t place = first_in_runs();
    return rarer == 0 ? place : (place / rarer_run >> rarer) * rarer_run;
  }
  /// Writes the place of a path in the part, below size(). False where the path takes no part. Precondition:
  /// `path` and `first` together are below 2^32.
  WFPG_HD bool find(std::size_t path, std::uint32_t& place) const {
    if (!find_of_all(static_cast<std::uint32_t>(path) + first, place)) return false;
    if (first > 0) place -= first_place();
    return true;
  }
  /// Whether a path takes part. One that is not known does. Precondition: as for find().
  WFPG_HD bool includes(std::uint32_t path) const {
    std::uint32_t place;
    return path == no_path || find(path, place);
  }
  /// Returns the path of a place: the inverse of find(). It may be beyond the sample's paths, and is so for
  /// paths before the rank's.
  WFPG_HD std::size_t path(std::uint32_t place) const {
    if (first > 0) place += first_place();
    if (rarer > 0) {
      const std::uint32_t group = place / rarer_run;
      place = (group << rarer | rarer_run_of(group)) * rarer_run + place % rarer_run;
    }
    if (shift == 0) return std::size_t(place) - first;
    const std::uint32_t group = place / run;
    return (std::size_t(group) << shift | run_of(group)) * run + place % run - first;
  }

 private:
  // Selects the low bits.
  WFPG_HD static std::uint32_t mask(std::uint32_t bits) { return (1u << bits) - 1u; }
  // The first place of the group of runs that `first` lies in, where `rarer` is not set. A rank that begins
  // inside a group counts the whole group's run.
  WFPG_HD std::uint32_t first_in_runs() const { return shift == 0 ? first : (first / run >> shift) * run; }
  // find() by the index among the paths of all ranks, of the place among theirs.
  WFPG_HD bool find_of_all(std::uint32_t path, std::uint32_t& place) const {
    place = path;
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
  // Number of the run that takes part, in a group of runs.
  WFPG_HD std::uint32_t run_of(std::uint32_t group) const { return hash32(seed, group) & mask(shift); }
  // Number of the run of places that takes part, in a group of them.
  WFPG_HD std::uint32_t rarer_run_of(std::uint32_t group) const { return hash32(~seed, group) & mask(rarer); }
};

}  // namespace wfpg
