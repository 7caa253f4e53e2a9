// The TBB policy. Link with TBB (target wfpg::tbb).
#pragma once

#include <wfpg/exec/cpu_policy.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <thrust/system/tbb/execution_policy.h>

namespace wfpg::exec {

/// The TBB policy with warps of W lanes. Runs in the calling thread's task arena, so that a host bounds the
/// threads with tbb::task_arena or tbb::global_control.
template <int W>
class basic_tbb : public cpu_policy<basic_tbb<W>, W> {
 public:
  /// What reports call it.
  static constexpr const char* name = "tbb";

  /// Memory from `resource`, which must outlive what is allocated; null stands for the default resource.
  explicit basic_tbb(memory_resource* resource = nullptr) : cpu_policy<basic_tbb<W>, W>(resource) {}

  /// Thrust's TBB policy, with temporaries from resource().
  auto thrust() const { return ::thrust::tbb::par(wfpg::resource_allocator<char>(this->resource())); }

  /// Threads of a loop, at most.
  int concurrency() const { return ::tbb::this_task_arena::max_concurrency(); }

  /// Calls f(first, last, worker) for ranges of about `grain` that cover [0, n), in no order.
  template <class F>
  void parallel(std::size_t n, std::size_t grain, const F& f) const {
    // Isolated, since a thread that waits inside f, for a host's own TBB work, must not take up another
    // range: it would share this one's worker index and scratch.
    ::tbb::parallel_for(
        ::tbb::blocked_range<std::size_t>(0, n, grain), [&f](const ::tbb::blocked_range<std::size_t>& range) {
          ::tbb::this_task_arena::isolate(
              [&] { f(range.begin(), range.end(), ::tbb::this_task_arena::current_thread_index()); });
        });
  }
};

/// The TBB policy, with warps of 32 lanes.
using tbb = basic_tbb<32>;

}  // namespace wfpg::exec
