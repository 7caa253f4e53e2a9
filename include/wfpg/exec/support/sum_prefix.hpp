// Inclusive sums of counts, in place: how many entries come up to and with each.
// base/prefix_search.hpp finds the entry that a number falls into.
// Cost: one scan, and one wait for the last sum.
// Memory: the scan's temporaries.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/scan.h>

#include <cstdint>

namespace wfpg {

/// Replaces counts by their inclusive sums.
/// Returns the last sum, which is read back to the host; 0 where there are no counts.
/// Throws out_of_memory.
template <class Exec>
std::uint64_t sum_prefix(const Exec& exec, buffer<std::uint64_t, Exec>& counts) {
  if (counts.size() == 0) return 0;
  ::thrust::inclusive_scan(exec.thrust(), counts.data(), counts.data() + counts.size(), counts.data());
  return read_element(exec, counts.data() + counts.size() - 1);
}

}  // namespace wfpg
