// The serial policy: one thread, indices in order.
// For debugging, and as the reference of the others.
// Source: Thrust's "cpp" backend for sorts and scans.
// Cost: no thread is started and nothing waits.
// Memory: the scratch of one block, during a loop over blocks.
#pragma once

#include <wfpg/exec/cpu_policy.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/system/cpp/execution_policy.h>

namespace wfpg::exec {

/// The serial policy with warps of W lanes: 8, 16 or 32.
/// Copies are cheap: a policy holds one pointer.
template <int W>
class basic_seq : public cpu_policy<basic_seq<W>, W> {
 public:
  /// Name in reports.
  static constexpr const char* name = "seq";

  /// Allocates from `resource`, which must outlive what is allocated.
  /// Null stands for the default resource.
  explicit basic_seq(memory_resource* resource = nullptr) : cpu_policy<basic_seq<W>, W>(resource) {}

  /// Returns Thrust's serial policy, whose temporaries come from resource().
  auto thrust() const { return ::thrust::cpp::par(wfpg::resource_allocator<char>(this->resource())); }

  /// Returns the number of threads of a loop: always 1.
  int concurrency() const { return 1; }

  /// Calls f(0, n, 0) once, in the calling thread, where n is not 0.
  /// The grain is not used.
  /// What f throws passes through.
  template <class F>
  void parallel(std::size_t n, std::size_t, const F& f) const {
    if (n) f(0, n, 0);
  }
};

/// The serial policy with warps of 32 lanes, as wide as a GPU's: results compare lane by lane.
using seq = basic_seq<32>;

}  // namespace wfpg::exec
