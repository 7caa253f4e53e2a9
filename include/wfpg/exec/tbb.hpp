// The TBB policy: loops as tasks of oneTBB.
// Link with TBB (target wfpg::tbb).
// Source: oneTBB's parallel_for, and Thrust's "tbb" backend for sorts and scans.
// Cost: work is stolen between threads, so that loops nest in a host's own tasks.
// Memory: a block's scratch for each thread of the arena.
#pragma once

#include <wfpg/exec/cpu_policy.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <thrust/system/tbb/execution_policy.h>

namespace wfpg::exec {

namespace detail {

/// Calls body(first, last, worker) for ranges of about `grain` indices that cover [0, n).
/// Each range is isolated: a thread that waits inside it, for a host's own TBB work, takes up no other range.
/// That one would share its worker index and scratch.
inline void tbb_for(std::size_t n, std::size_t grain, const range_body& body) {
  ::tbb::parallel_for(::tbb::blocked_range<std::size_t>(0, n, grain),
                      [&body](const ::tbb::blocked_range<std::size_t>& range) {
                        ::tbb::this_task_arena::isolate([&] {
                          body(range.begin(), range.end(), ::tbb::this_task_arena::current_thread_index());
                        });
                      });
}

}  // namespace detail

/// The TBB policy with warps of W lanes: 8, 16 or 32.
/// It runs in the calling thread's task arena.
/// A host bounds the threads with tbb::task_arena or tbb::global_control.
template <int W>
class basic_tbb : public cpu_policy<basic_tbb<W>, W> {
 public:
  /// Name in reports.
  static constexpr const char* name = "tbb";

  /// Allocates from `resource`, which must outlive what is allocated.
  /// Null stands for the default resource.
  explicit basic_tbb(memory_resource* resource = nullptr) : cpu_policy<basic_tbb<W>, W>(resource) {}

  /// Returns Thrust's TBB policy, whose temporaries come from resource().
  auto thrust() const { return ::thrust::tbb::par(wfpg::resource_allocator<char>(this->resource())); }

  /// Returns the largest number of threads of a loop: those of the calling thread's arena.
  int concurrency() const { return ::tbb::this_task_arena::max_concurrency(); }

  /// Calls f(first, last, worker) for ranges of about `grain` indices that cover [0, n), in no order.
  /// `worker` is the thread's index in its arena.
  /// What f throws cancels the rest, and passes through.
  template <class F>
  void parallel(std::size_t n, std::size_t grain, const F& f) const {
    detail::tbb_for(n, grain, range_body(f));
  }
};

/// The TBB policy with warps of 32 lanes.
using tbb = basic_tbb<32>;

}  // namespace wfpg::exec
