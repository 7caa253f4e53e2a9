// bench_cuda: runs the benchmarks, and notes in their results what they ran on.
#include <benchmark/benchmark.h>
#include <cuda_runtime_api.h>

#include <cstdio>
#include <string>

int main(int argc, char** argv) {
  cudaDeviceProp gpu{};
  const cudaError_t found = cudaGetDeviceProperties(&gpu, 0);
  if (found != cudaSuccess) {
    std::fprintf(stderr, "bench_cuda: %s\n", cudaGetErrorString(found));
    return 2;
  }
  int driver = 0;
  cudaDriverGetVersion(&driver);
  const auto version = [](int v) { return std::to_string(v / 1000) + "." + std::to_string(v % 1000 / 10); };
  benchmark::AddCustomContext("gpu", gpu.name);
  benchmark::AddCustomContext("cuda_toolkit", version(CUDART_VERSION));
  benchmark::AddCustomContext("cuda_driver", version(driver));
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
