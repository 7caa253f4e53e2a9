// Checks that all ranks call the same function with as many values. MPI and NCCL do not check: they hang, or
// mix the values up.
// Each rank writes four words, the adapter takes their maxima over all ranks, and each rank compares.
// Source: the least of values is the complement of the largest complement.
// Cost: one reduction of 32 bytes a call; docs/ranks.md has what that takes.
// Memory: the four words.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

namespace wfpg::detail {

/// The functions of a communicator, and a meeting: an adapter's own, where ranks wait for each other.
/// The first four are numbered as reduction::kind.
enum class rank_function : std::uint32_t { sum32, sum64, max32, max64, all, broadcast, meeting };

static_assert(static_cast<std::uint32_t>(rank_function::max64) ==
                  static_cast<std::uint32_t>(reduction::kind::max64),
              "rank_call::of() takes kinds as functions");

/// Returns the function's name, for messages.
inline const char* name_of(rank_function function) {
  if (function == rank_function::broadcast) return "broadcast";
  if (function == rank_function::all) return "all_reduce";
  if (function == rank_function::meeting) return "the meeting of ranks that join or leave";
  const bool is_sum = function == rank_function::sum32 || function == rank_function::sum64;
  return is_sum ? "all_reduce_sum" : "all_reduce_max";
}

/// One call of a communicator's function by one rank.
struct rank_call {
  /// Number of words that ranks compare.
  static constexpr std::size_t word_count = 4;

  rank_function function;  ///< the function that this rank calls
  std::uint64_t count;     ///< number of its values, or bytes
  std::uint32_t root = 0;  ///< of a broadcast; of several arrays, a hash of their kinds and sizes

  /// Returns the call of communicator::all_reduce(). A single array is as if its own function was called.
  static rank_call of(array_view<const reduction> arrays) {
    if (arrays.size() == 1) return {static_cast<rank_function>(arrays[0].what), arrays[0].count};
    std::uint64_t count = 0, kinds = arrays.size();
    for (const reduction& one : arrays) {
      count += one.count;
      kinds = hash(hash(kinds, static_cast<std::uint64_t>(one.what)), one.count);
    }
    return {rank_function::all, count, static_cast<std::uint32_t>(kinds)};
  }

  /// Writes the words whose maxima over all ranks agrees() and require_same() read.
  void write(std::uint64_t (&words)[word_count]) const {
    words[0] = key();
    words[1] = ~key();
    words[2] = count;
    words[3] = ~count;
  }
  /// Returns whether all ranks made this call. `most`: the maxima of all ranks' words.
  bool agrees(const std::uint64_t (&most)[word_count]) const {
    return most[0] == key() && most[1] == ~key() && most[2] == count && most[3] == ~count;
  }
  /// Throws rank_error unless all ranks made this call. `rank`: this rank, for the message.
  void require_same(const std::uint64_t (&most)[word_count], std::uint32_t rank) const {
    if (agrees(most)) return;
    const bool is_function = most[0] == key() && most[1] == ~key();
    const std::string own = "rank " + std::to_string(rank) + " calls " + name_of(function) + " with " +
                            std::to_string(count) + " values, ";
    const std::string others =
        is_function ? "ranks have " + std::to_string(~most[3]) + " to " + std::to_string(most[2])
                    : std::string("another rank calls another function, or has another root or other arrays");
    throw rank_error(own + others + "; give all ranks the same scene, options and version of the program");
  }

 private:
  /// Has to be equal beside the number of values: the function with its kind of values, and the root.
  std::uint64_t key() const { return std::uint64_t(root) << 32 | static_cast<std::uint32_t>(function); }
};

/// Returns the error of a rank that waited too long. `doing`: what it waited for, such as "all_reduce_sum".
inline rank_error late_error(std::uint32_t rank, const char* doing, double seconds) {
  char waited[32];
  std::snprintf(waited, sizeof waited, "%g", seconds);
  return rank_error(
      "rank " + std::to_string(rank) + " waited " + waited + " s in " + doing +
      " for another rank, which has ended, hangs or is slow; see that rank's messages, or raise "
      "the communicator's time limit");
}

}  // namespace wfpg::detail
