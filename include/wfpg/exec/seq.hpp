// The serial policy: one thread, in order. For debugging and as the reference of the others.
#pragma once

#include <wfpg/exec/cpu_policy.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/system/cpp/execution_policy.h>

namespace wfpg::exec {

/// The serial policy with warps of W lanes.
template <int W>
class basic_seq : public cpu_policy<basic_seq<W>, W> {
 public:
  /// What reports call it.
  static constexpr const char* name = "seq";

  /// Memory from `resource`, which must outlive what is allocated; null stands for the default resource.
  explicit basic_seq(memory_resource* resource = nullptr) : cpu_policy<basic_seq<W>, W>(resource) {}

  /// Thrust's serial policy, with temporaries from resource().
  auto thrust() const { return ::thrust::cpp::par(wfpg::resource_allocator<char>(this->resource())); }

  /// Threads of a loop.
  int concurrency() const { return 1; }

  /// Calls f(0, n, 0) once.
  template <class F>
  void parallel(std::size_t n, std::size_t, const F& f) const {
    if (n) f(0, n, 0);
  }
};

/// The serial policy, with warps of 32 lanes.
using seq = basic_seq<32>;

}  // namespace wfpg::exec
