// The OpenMP policy. Compile with OpenMP enabled (target wfpg::omp).
#pragma once

#include <wfpg/exec/cpu_policy.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <omp.h>
#include <thrust/system/omp/execution_policy.h>

#include <exception>

namespace wfpg::detail {

/// Thrust's OpenMP sorts allocate inside their parallel regions, from many threads at once, and nothing may
/// be thrown out of there: such requests go to the heap, as those of the serial sorts they run do.
template <class T>
class omp_allocator : public resource_allocator<T> {
 public:
  using resource_allocator<T>::resource_allocator;

  T* allocate(std::size_t n) { return allocator().allocate(n); }
  void deallocate(T* p, std::size_t n) { allocator().deallocate(p, n); }

 private:
  resource_allocator<T> allocator() const {
    return resource_allocator<T>(omp_in_parallel() ? std::pmr::new_delete_resource() : this->resource());
  }
};

}  // namespace wfpg::detail

namespace wfpg::exec {

/// The OpenMP policy with warps of W lanes. As many threads as OpenMP gives a parallel region.
template <int W>
class basic_omp : public cpu_policy<basic_omp<W>, W> {
 public:
  /// What reports call it.
  static constexpr const char* name = "omp";

  /// Memory from `resource`, which must outlive what is allocated; null stands for the default resource.
  explicit basic_omp(memory_resource* resource = nullptr) : cpu_policy<basic_omp<W>, W>(resource) {}

  /// Thrust's OpenMP policy, with temporaries from resource().
  auto thrust() const { return ::thrust::omp::par(wfpg::detail::omp_allocator<char>(this->resource())); }

  /// Threads of a loop, at most.
  int concurrency() const { return omp_get_max_threads(); }

  /// What f throws is thrown here, once, when the loop has ended.
  template <class F>
  void parallel(std::size_t n, std::size_t grain, const F& f) const {
    std::exception_ptr failure;
    const auto tasks = static_cast<long long>((n + grain - 1) / grain);
#pragma omp parallel for schedule(dynamic)
    for (long long task = 0; task < tasks; ++task) {
      try {
        const std::size_t first = static_cast<std::size_t>(task) * grain;
        f(first, first + grain < n ? first + grain : n, omp_get_thread_num());
      } catch (...) {
#pragma omp critical(wfpg_exec_omp_failure)
        if (!failure) failure = std::current_exception();
      }
    }
    if (failure) std::rethrow_exception(failure);
  }
};

/// The OpenMP policy, with warps of 32 lanes.
using omp = basic_omp<32>;

}  // namespace wfpg::exec
