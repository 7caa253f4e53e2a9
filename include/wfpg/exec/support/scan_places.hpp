// Places of elements in a dense array: the sums of the counts before each. A functor takes them as they are
// found, so that they need neither an array nor a pass of their own.
// Source: Blelloch 1990, "Prefix Sums and Their Applications".
// Cost: one scan, which Thrust runs on one thread of OpenMP.
// Memory: the scan's temporaries.
#pragma once

#include <wfpg/exec/detail/place_iterator.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/scan.h>

#include <cstddef>
#include <cstdint>

namespace wfpg {

/// Calls f(i, place) once for each i in [0, n), in no order. On a GPU it returns before the work is
/// done. O(n). Throws out_of_memory.
/// `counts`: an iterator of the policy over std::uint32_t, with a sum below 2³². It may be read twice.
/// `f`: a trivially copyable functor. It reads nothing that another call writes, and does not write what
/// `counts` reads.
/// `place`: std::uint32_t, the sum of the counts before i.
template <class Exec, class Iterator, class F>
void scan_places(const Exec& exec, std::size_t n, Iterator counts, const F& f) {
  ::thrust::exclusive_scan(exec.thrust(), counts, counts + static_cast<std::ptrdiff_t>(n),
                           detail::place_iterator<F>(f), 0u);
}

}  // namespace wfpg
