// Counters that every rank adds to, and of which all ranks need the sum.
//
// Between two sums a rank knows what all ranks had counted, plus what it counted itself since then. A sum
// takes only the latter of each rank, but all of rank 0.
//
// Source: wfpg's own. Cost: O(counters), and a part of an exchange. Memory: two copies of the counters.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/rank_exchange.hpp>

#include <cstddef>

namespace wfpg::detail {

/// Counters that lie in a row, for rank_counters.
template <class T>
struct counters_in_a_row {
  T* values;  ///< a counter each
  /// Returns counter `i`.
  WFPG_HD T& operator()(std::size_t i) const { return values[i]; }
};

/// Kernel: writes what a rank gives to the sum. May run again where the exchange failed.
template <class T, class At>
struct take_counts {
  const T* shared;  ///< a counter: what all ranks had counted
  T* given;         ///< a counter: what the rank gives
  At at;            ///< a counter's place
  bool all;         ///< gives all of it, as one of the ranks does; false: what was added since
  /// Takes counter `i`.
  WFPG_HD void operator()(std::size_t i) const { given[i] = all ? at(i) : at(i) - shared[i]; }
};

/// Kernel: writes the sums to the counters.
template <class T, class At>
struct put_counts {
  T* shared;     ///< a counter: what all ranks have counted
  const T* sum;  ///< a counter: of what they gave
  At at;         ///< a counter's place
  T most;        ///< at which a counter stops
  /// Writes counter `i`.
  WFPG_HD void operator()(std::size_t i) const { at(i) = shared[i] = min(sum[i], most); }
};

/// Remembers what all ranks had counted at the last sum. `At`: (std::size_t) -> T&, the place of a counter.
template <class Exec, class T>
class rank_counters {
 public:
  /// Of no counters.
  rank_counters() = default;
  /// Of `n` counters that are 0. Throws out_of_memory.
  rank_counters(const Exec& exec, std::size_t n) : shared_(exec, n), given_(exec, n) {
    exec.fill_bytes(shared_.data(), 0, shared_.bytes());
  }

  /// Takes counters that are equal on all ranks, such as those of a file. Does nothing without counters.
  template <class At>
  void restart(const Exec& exec, const At& at) {
    exec.for_each(shared_.size(), take_counts<T, At>{shared_.data(), shared_.data(), at, true});
  }
  /// Adds them to an exchange, which gives all ranks the sums, but no more than `most`. They must stay where
  /// they are until it has run.
  template <class At>
  void add_to(const Exec& exec, rank_exchange<Exec>& all, const At& at, T most = static_cast<T>(~T(0))) {
    T* const given = given_.data();
    exec.for_each(given_.size(), take_counts<T, At>{shared_.data(), given, at, all.ranks().rank() == 0});
    all.add(reduction::sum(given_.view()), [this, exec, at, most] {
      exec.for_each(shared_.size(), put_counts<T, At>{shared_.data(), given_.data(), at, most});
    });
  }
  /// Bytes in the policy's memory.
  std::size_t bytes() const { return shared_.bytes() + given_.bytes(); }

 private:
  buffer<T, Exec> shared_, given_;  // a counter
};

}  // namespace wfpg::detail
