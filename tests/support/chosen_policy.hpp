// A CPU policy whose backend a test case chooses when it runs: serial, OpenMP or TBB. Code of the library is
// then compiled for one type, in half the time of three. Loops, and what Thrust does, are those of the real
// policies.
#pragma once

#include "support/catch.hpp"

#include <wfpg/exec/cpu_policy.hpp>
#include <wfpg/exec/omp.hpp>
#include <wfpg/exec/seq.hpp>
#include <wfpg/exec/tbb.hpp>

#include <thrust/copy.h>
#include <thrust/count.h>
#include <thrust/fill.h>
#include <thrust/reduce.h>
#include <thrust/scan.h>
#include <thrust/sequence.h>
#include <thrust/sort.h>
#include <thrust/transform_reduce.h>
#include <thrust/transform_scan.h>

#include <cstddef>
#include <utility>

namespace wfpg_test {

enum class backend { seq, omp, tbb };

/// The backend of policies that are made from now on, by all threads.
inline backend current_backend = backend::tbb;

/// Chooses a backend until it dies.
class backend_choice {
 public:
  explicit backend_choice(backend chosen) : before_(std::exchange(current_backend, chosen)) {}
  backend_choice(const backend_choice&) = delete;
  backend_choice& operator=(const backend_choice&) = delete;
  ~backend_choice() { current_backend = before_; }

 private:
  backend before_;
};

/// Returns f(), whose policies have a backend.
template <class F>
auto with_backend(backend chosen, const F& f) {
  const backend_choice choice(chosen);
  return f();
}

/// Checks that f() is equal whatever backend its policies have.
template <class F>
void check_equal_on_backends(const F& f) {
  const auto serial = with_backend(backend::seq, f);
  CHECK(with_backend(backend::omp, f) == serial);
  CHECK(with_backend(backend::tbb, f) == serial);
}

/// Returns f(policy) of the real policy of a backend.
template <int W, class F>
auto on_backend(backend chosen, wfpg::memory_resource* resource, const F& f) {
  switch (chosen) {
    case backend::seq:
      return f(wfpg::exec::basic_seq<W>(resource));
    case backend::omp:
      return f(wfpg::exec::basic_omp<W>(resource));
    default:
      return f(wfpg::exec::basic_tbb<W>(resource));
  }
}

/// A Thrust policy that passes calls on to a backend's.
struct chosen_thrust : thrust::execution_policy<chosen_thrust> {
  backend chosen;
  wfpg::memory_resource* resource;
  chosen_thrust(backend b, wfpg::memory_resource* r) : chosen(b), resource(r) {}
};

// Thrust's algorithms find these by their policy's namespace.
#define WFPG_TEST_PASS_ON(algorithm)                                              \
  template <class... Arguments>                                                   \
  auto algorithm(chosen_thrust& policy, Arguments... arguments) {                 \
    return on_backend<32>(policy.chosen, policy.resource, [&](const auto& exec) { \
      return ::thrust::algorithm(exec.thrust(), arguments...);                    \
    });                                                                           \
  }
WFPG_TEST_PASS_ON(copy_if)
WFPG_TEST_PASS_ON(copy_n)
WFPG_TEST_PASS_ON(count)
WFPG_TEST_PASS_ON(count_if)
WFPG_TEST_PASS_ON(exclusive_scan)
WFPG_TEST_PASS_ON(fill_n)
WFPG_TEST_PASS_ON(inclusive_scan)
WFPG_TEST_PASS_ON(reduce)
WFPG_TEST_PASS_ON(sequence)
WFPG_TEST_PASS_ON(sort)
WFPG_TEST_PASS_ON(stable_sort_by_key)
WFPG_TEST_PASS_ON(transform_inclusive_scan)
WFPG_TEST_PASS_ON(transform_reduce)
#undef WFPG_TEST_PASS_ON

/// The policy of a chosen backend with warps of W lanes.
template <int W>
class basic_chosen : public wfpg::exec::cpu_policy<basic_chosen<W>, W> {
 public:
  static constexpr const char* name = "chosen";

  explicit basic_chosen(wfpg::memory_resource* resource = nullptr)
      : wfpg::exec::cpu_policy<basic_chosen<W>, W>(resource) {}

  chosen_thrust thrust() const { return {backend_, this->resource()}; }
  int concurrency() const {
    return on_real([](const auto& exec) { return exec.concurrency(); });
  }
  template <class F>
  void parallel(std::size_t n, std::size_t grain, const F& f) const {
    const wfpg::exec::range_body body(f);
    on_real([&](const auto& exec) { exec.parallel(n, grain, body); });
  }

 private:
  template <class F>
  auto on_real(const F& f) const {
    return on_backend<W>(backend_, this->resource(), f);
  }

  backend backend_ = current_backend;
};

}  // namespace wfpg_test
