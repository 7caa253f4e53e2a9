// The OpenMP policy: loops on the threads of a parallel region.
// Compile with OpenMP enabled (target wfpg::omp).
// Source: OpenMP 4, and Thrust's "omp" backend for sorts and scans.
// Cost: tasks are scheduled dynamically, since rays differ in length.
// Memory: the scratch of one block for each thread.
#pragma once

#include <wfpg/exec/cpu_policy.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <omp.h>
#include <thrust/system/omp/execution_policy.h>

#include <exception>

namespace wfpg::detail {

/// Allocator of Thrust's temporaries that takes requests from inside parallel regions to the heap.
/// Thrust's OpenMP sorts allocate there, from many threads at once.
/// A resource need not be thread-safe, and no exception may leave such a region.
/// The serial sorts that Thrust runs there use the heap as well.
template <class T>
class omp_allocator : public resource_allocator<T> {
 public:
  using resource_allocator<T>::resource_allocator;

  /// Returns memory for n elements.
  /// Throws out_of_memory.
  T* allocate(std::size_t n) { return allocator().allocate(n); }
  /// Frees `p`. Precondition: called inside a parallel region if and only if `p` was allocated in one.
  void deallocate(T* p, std::size_t n) { allocator().deallocate(p, n); }

 private:
  resource_allocator<T> allocator() const {
    return resource_allocator<T>(omp_in_parallel() ? std::pmr::new_delete_resource() : this->resource());
  }
};

}  // namespace wfpg::detail

namespace wfpg::exec {

namespace detail {

/// Calls body(first, last, worker) for ranges of `grain` indices that cover [0, n).
/// Ranges are dealt out dynamically, since rays differ in length.
/// Throws the first exception of the body when the loop has ended: none may leave a parallel region.
/// Precondition: grain > 0.
inline void omp_for(std::size_t n, std::size_t grain, const range_body& body) {
  std::exception_ptr failure;
  // Signed, since loops of OpenMP 2 are.
  const auto tasks = static_cast<long long>((n + grain - 1) / grain);
#pragma omp parallel for schedule(dynamic)
  for (long long task = 0; task < tasks; ++task) {
    try {
      const std::size_t first = static_cast<std::size_t>(task) * grain;
      body(first, first + grain < n ? first + grain : n, omp_get_thread_num());
    } catch (...) {
#pragma omp critical(wfpg_exec_omp_failure)
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace detail

/// The OpenMP policy with warps of W lanes: 8, 16 or 32.
/// A loop has as many threads as OpenMP gives a parallel region: OMP_NUM_THREADS bounds them.
template <int W>
class basic_omp : public cpu_policy<basic_omp<W>, W> {
 public:
  /// Name in reports.
  static constexpr const char* name = "omp";

  /// Allocates from `resource`, which must outlive what is allocated.
  /// Null stands for the default resource.
  explicit basic_omp(memory_resource* resource = nullptr) : cpu_policy<basic_omp<W>, W>(resource) {}

  /// Returns Thrust's OpenMP policy, whose temporaries come from resource().
  auto thrust() const { return ::thrust::omp::par(wfpg::detail::omp_allocator<char>(this->resource())); }

  /// Returns the largest number of threads of a loop.
  int concurrency() const { return omp_get_max_threads(); }

  /// Calls f(first, last, worker) for ranges of `grain` indices that cover [0, n), in no order.
  /// `worker` is below concurrency(), and no two calls have one number at a time.
  /// The first exception of f is thrown again when the loop has ended; other ranges still run.
  template <class F>
  void parallel(std::size_t n, std::size_t grain, const F& f) const {
    detail::omp_for(n, grain, range_body(f));
  }
};

/// The OpenMP policy with warps of 32 lanes.
using omp = basic_omp<32>;

}  // namespace wfpg::exec
