// Repeats work with several numbers of threads.
#pragma once

#include "support/policies.hpp"

#if !defined(__CUDACC__)
#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#endif

#include <string>

namespace wfpg_test {

/// Calls f(description) with one, two and five threads of TBB and of OpenMP. On a GPU it calls f three times,
/// since its threads run in another order every time.
template <class F>
void with_threads(const F& f) {
#if defined(__CUDACC__)
  for (int again = 0; again < 3; ++again) f("again");
#else
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    tbb::task_arena arena(threads);
    arena.execute([&] { f(std::to_string(threads) + " TBB threads"); });
  }
#endif
#if defined(WFPG_TEST_SEVERAL_POLICIES)
  const int before = omp_get_max_threads();
  for (const int threads : {1, 2, 5}) {
    omp_set_num_threads(threads);
    f(std::to_string(threads) + " OpenMP threads");
  }
  omp_set_num_threads(before);
#endif
}

}  // namespace wfpg_test
