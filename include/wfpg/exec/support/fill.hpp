// Writes one value to all elements of a buffer, in a loop of the policy. It compiles to one loop a type,
// where thrust::fill_n() makes several. exec.fill_bytes() serves where all bytes of the value are equal.
// wfpg's own.
//
// Cost: one loop. Memory: none.
#pragma once

#include <wfpg/base/config.hpp>
#include <wfpg/exec/buffer.hpp>

#include <cstddef>

namespace wfpg {

namespace detail {

/// Kernel: writes `value` to element i.
template <class T>
struct write_value {
  T* to;    ///< outputs
  T value;  ///< what each becomes
  WFPG_HD void operator()(std::size_t i) const { to[i] = value; }
};

}  // namespace detail

/// Writes `value` to all elements. O(n). The call does nothing where there are no elements. It may return
/// before the loop ran, as for_each() may.
template <class T, class Exec>
void fill(const Exec& exec, const buffer<T, Exec>& all, const T& value) {
  exec.for_each(all.size(), detail::write_value<T>{all.data(), value});
}

}  // namespace wfpg
