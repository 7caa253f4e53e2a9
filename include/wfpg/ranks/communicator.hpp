// Joins the ranks that render one picture: processes, GPUs or threads, which learn one guide. Each rank has a
// part of the paths of every sample. At a sample's end the ranks add up what their paths found, in integers.
// The guide then has the same bytes for any number of ranks.
//
// An abstract class, so that kernels and guiders do not depend on what carries the messages: its functions
// are called a few times a sample. Adapters: ranks/threads.hpp, ranks/mpi.hpp, ranks/nccl.hpp. A host derives
// its own in 20 lines.
//
// Cost and memory: the adapter's.
#pragma once

#include <wfpg/base/types.hpp>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace wfpg {

/// Thrown where a rank is lost, is late, or renders something else than the others do. The communicator is of
/// no more use then. A guider that uses it may only be destroyed: its guide may have a part of a sample.
class rank_error : public std::runtime_error {
 public:
  /// The message becomes "wfpg: REASON".
  explicit rank_error(const std::string& reason) : std::runtime_error("wfpg: " + reason) {}
};

/// One array that ranks reduce in place, for communicator::all_reduce().
/// The array must stay where it is until the call returns. Copyable.
struct reduction {
  /// The sum of values or the largest of them, of 32 or 64 bits.
  enum class kind : std::uint32_t { sum32, sum64, max32, max64 };

  kind what = kind::sum32;  ///< what they become
  void* values = nullptr;   ///< the first of them, in the memory of the communicator's policy
  std::size_t count = 0;    ///< number of values, not bytes; may be 0

  /// Returns whether values are summed. Of others the largest is taken.
  bool is_sum() const { return what == kind::sum32 || what == kind::sum64; }
  /// Returns whether values have 32 bits. Others have 64.
  bool is_short() const { return what == kind::sum32 || what == kind::max32; }

  /// Returns the sum of 32-bit values, modulo 2^32.
  static reduction sum(array_view<std::uint32_t> v) { return {kind::sum32, v.data(), v.size()}; }
  /// Returns that of 64-bit values, modulo 2^64.
  static reduction sum(array_view<std::uint64_t> v) { return {kind::sum64, v.data(), v.size()}; }
  /// Returns the largest of 32-bit values.
  static reduction max(array_view<std::uint32_t> v) { return {kind::max32, v.data(), v.size()}; }
  /// Returns the largest of 64-bit values.
  static reduction max(array_view<std::uint64_t> v) { return {kind::max64, v.data(), v.size()}; }
};

/// Joins ranks 0 to size() - 1. All ranks call the same functions in the same order with as many values.
/// Arrays lie in the memory of the policy for which the communicator was made. A call is ordered after the
/// policy's calls before it, and calls after it see its result. One thread at a time may call one rank's
/// communicator.
///
/// Functions throw rank_error where another rank does not come within the adapter's time limit.
class communicator {
 public:
  virtual ~communicator() = default;
  /// Number of this rank.
  virtual std::uint32_t rank() const = 0;
  /// Number of ranks, at least 1.
  virtual std::uint32_t size() const = 0;
  /// Replaces each value by its sum over all ranks, modulo 2^32 or 2^64. O(values) of traffic a rank.
  virtual void all_reduce_sum(array_view<std::uint32_t> values) = 0;
  /// As above, of 64 bits.
  virtual void all_reduce_sum(array_view<std::uint64_t> values) = 0;
  /// Replaces each value by the largest of all ranks.
  virtual void all_reduce_max(array_view<std::uint32_t> values) = 0;
  /// As above, of 64 bits.
  virtual void all_reduce_max(array_view<std::uint64_t> values) = 0;
  /// Makes several reductions, whose arrays must not overlap. All ranks have equal kinds and numbers of
  /// values in the same order. Here it makes one call after the other. NCCL makes one exchange of all, and
  /// MPI compares calls once.
  virtual void all_reduce(array_view<const reduction> arrays) {
    for (const reduction& one : arrays) reduce_one(one);
  }
  /// Replaces the bytes of all ranks by those of the rank `root`.
  virtual void broadcast(array_view<unsigned char> bytes, std::uint32_t root) = 0;

 private:
  // Makes one reduction by the function of its kind.
  void reduce_one(const reduction& one) {
    const array_view<std::uint32_t> words(static_cast<std::uint32_t*>(one.values), one.count);
    const array_view<std::uint64_t> longs(static_cast<std::uint64_t*>(one.values), one.count);
    switch (one.what) {
      case reduction::kind::sum32:
        return all_reduce_sum(words);
      case reduction::kind::sum64:
        return all_reduce_sum(longs);
      case reduction::kind::max32:
        return all_reduce_max(words);
      case reduction::kind::max64:
        return all_reduce_max(longs);
    }
  }
};

}  // namespace wfpg
