// bench_cpu and bench_cuda: run the stages' benchmarks, and write the machine into their results.
//
// usage: bench_cpu [--once] [--benchmark_filter=STAGE/POLICY ...]
//   --once   runs each stage once, without warm-up, for tools that count what it executes
#include "timing.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>

namespace bench {

void run_stage(void (*call)(const void*), const void* work) {
  call(work);
  benchmark::ClobberMemory();  // makes this a call, not a jump
}

}  // namespace bench

namespace {

#if defined(__CUDACC__)
/// Writes the GPU's name into the results. False if there is none.
bool add_machine() {
  cudaDeviceProp gpu{};
  const cudaError_t found = cudaGetDeviceProperties(&gpu, 0);
  if (found != cudaSuccess) {
    std::fprintf(stderr, "bench_cuda: %s\n", cudaGetErrorString(found));
    return false;
  }
  int driver = 0;
  cudaDriverGetVersion(&driver);
  const auto version = [](int v) { return std::to_string(v / 1000) + "." + std::to_string(v % 1000 / 10); };
  benchmark::AddCustomContext("gpu", gpu.name);
  benchmark::AddCustomContext("cuda_toolkit", version(CUDART_VERSION));
  benchmark::AddCustomContext("cuda_driver", version(driver));
  return true;
}
#else
/// Writes the number of threads into the results.
bool add_machine() {
  benchmark::AddCustomContext("omp_threads", std::to_string(wfpg::exec::omp().concurrency()));
  benchmark::AddCustomContext("tbb_threads", std::to_string(wfpg::exec::tbb().concurrency()));
  return true;
}
#endif

/// Removes --once from the arguments. Returns whether it was there.
bool take_once(int& argc, char** argv) {
  char** const end =
      std::remove_if(argv + 1, argv + argc, [](const char* a) { return !std::strcmp(a, "--once"); });
  const bool found = end != argv + argc;
  argc = static_cast<int>(end - argv);
  *end = nullptr;
  return found;
}

}  // namespace

int main(int argc, char** argv) {
  if (!add_machine()) return 2;
  if (take_once(argc, argv)) {
    bench::warm_up = 0;
    for (auto* const stage : bench::registered_stages()) stage->Iterations(1);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  try {
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {  // such as that of a driver without OptiX
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
  return 0;
}
