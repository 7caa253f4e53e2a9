// Binary search among inclusive prefix sums: finds the entry that a number falls into.
// Drawing from a discrete distribution is such a search, for a target uniform in [0, sum).
// Source: the inversion method, as in pbrt-v4, appendix A.
// Cost: O(log n) reads of sums, no branch that diverges between lanes. Memory: none of its own.
#pragma once

#include <wfpg/base/config.hpp>

#include <cstdint>

namespace wfpg {

/// The entry that was found. It owns [begin, end) of the range of the sums.
template <class T>
struct prefix_entry {
  std::uint32_t index;  ///< of the entry, in [0, n)
  T begin;              ///< the sum of all entries before it
  T end;                ///< the sum up to and with it; end - begin is the entry's own value
};

/// Returns the first of n entries whose inclusive sum exceeds `target`.
/// An entry of value 0 is never returned.
/// `sums(i)`: the sum up to and with entry i, for i in [0, n - 1).
/// `before`: the sum before entry 0, which lets a search start inside a longer array.
/// `last`: the sum of all entries; `sums` is not asked for it.
/// Preconditions: n > 0 and before <= target < last. Calls `sums` about log2(n) times, without branches.
template <class T, class Sums>
[[gnu::always_inline]] WFPG_HD inline prefix_entry<T> search_prefix(const Sums& sums, std::uint32_t n,
                                                                    T before, T last, T target) {
  std::uint32_t low = 0;
  for (std::uint32_t size = n; size > 1;) {  // the entry is one of `size` from `low` on
    const std::uint32_t half = size / 2;
    const T sum = sums(low + half - 1);
    const bool above = sum > target;
    low += above ? 0 : half;
    size = above ? half : size - half;
    before = above ? before : sum;
    last = above ? sum : last;
  }
  return {low, before, last};
}

}  // namespace wfpg
