// How stages are timed on the GPU: events around the work, medians over the iterations, and beside each stage
// its floor, measured in turn with it: the least that the hardware would need for the same.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/cuda.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace bench {

using exec_policy = wfpg::exec::cuda;

/// Seconds of GPU time that `work` takes on the policy's stream.
template <class Work>
double seconds_of(const exec_policy& exec, const Work& work) {
  using wfpg::check_cuda;
  cudaEvent_t begin = nullptr, end = nullptr;
  check_cuda(cudaEventCreate(&begin), "cudaEventCreate");
  check_cuda(cudaEventCreate(&end), "cudaEventCreate");
  check_cuda(cudaEventRecord(begin, exec.stream()), "cudaEventRecord");
  work();
  check_cuda(cudaEventRecord(end, exec.stream()), "cudaEventRecord");
  check_cuda(cudaEventSynchronize(end), "cudaEventSynchronize");
  float milliseconds = 0.0f;
  check_cuda(cudaEventElapsedTime(&milliseconds, begin, end), "cudaEventElapsedTime");
  cudaEventDestroy(begin);
  cudaEventDestroy(end);
  return 1.0e-3 * static_cast<double>(milliseconds);
}

inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Nothing to do before a stage or a floor.
struct nothing {
  void operator()() const {}
};

/// Times stage and floor in turn, `prepare` untimed before each stage. Counters: medians in milliseconds,
/// their ratio.
template <class Stage, class Floor, class Prepare = nothing>
void compare(benchmark::State& state, const exec_policy& exec, const Stage& stage, const Floor& floor,
             const Prepare& prepare = {}) {
  constexpr int warm_up = 3;
  for (int i = 0; i < warm_up; ++i) {
    prepare();
    seconds_of(exec, stage);
    seconds_of(exec, floor);
  }
  std::vector<double> stages, floors;
  for (auto _ : state) {
    prepare();
    stages.push_back(seconds_of(exec, stage));
    floors.push_back(seconds_of(exec, floor));
    state.SetIterationTime(stages.back());
  }
  state.counters["median_ms"] = 1.0e3 * median(stages);
  state.counters["floor_ms"] = 1.0e3 * median(floors);
  state.counters["ratio"] = median(stages) / median(floors);
}

/// A device copy that reads and writes `bytes` in all.
class copy_of {
 public:
  copy_of(const exec_policy& exec, std::size_t bytes)
      : exec_(exec), from_(exec, bytes / 2), to_(exec, bytes / 2) {}
  void operator()() const {
    wfpg::check_cuda(
        cudaMemcpyAsync(to_.data(), from_.data(), to_.bytes(), cudaMemcpyDeviceToDevice, exec_.stream()),
        "cudaMemcpyAsync");
  }

 private:
  exec_policy exec_;
  wfpg::buffer<unsigned char, exec_policy> from_, to_;
};

/// Every benchmark: 20 iterations, times from events.
inline void as_stage(benchmark::internal::Benchmark* b) {
  b->Iterations(20)->UseManualTime()->Unit(benchmark::kMillisecond);
}

}  // namespace bench
