// Timing of stages: by events on a GPU, by the clock on CPUs. Times are medians over the iterations. Beside
// each stage is its floor, the least time that the hardware needs for the same work. Both are measured
// alternately. Each stage is a function template over an execution policy. WFPG_BENCH_STAGE registers it: as
// NAME on CUDA, as NAME/seq, NAME/omp and NAME/tbb on CPUs.
#pragma once

#include "sizes.hpp"

#include <wfpg/exec/buffer.hpp>
#if defined(__CUDACC__)
#include <wfpg/exec/cuda.hpp>
#else
#include <wfpg/exec/omp.hpp>
#include <wfpg/exec/seq.hpp>
#include <wfpg/exec/tbb.hpp>
#endif

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace bench {

/// How often stages run before they are measured. main.cpp sets it to zero for --once.
inline int warm_up = sizes::warm_up;

/// All registered stages, for main.cpp.
inline std::vector<benchmark::internal::Benchmark*>& registered_stages() {
  static std::vector<benchmark::internal::Benchmark*> all;
  return all;
}

/// Calls call(work). Never inlined, since bench/instructions.py counts the instructions in it. Defined in
/// main.cpp.
void run_stage(void (*call)(const void*), const void* work);

#if defined(__CUDACC__)
/// Seconds of GPU time of `work` on the policy's stream.
template <class Work>
double seconds_of(const wfpg::exec::cuda& exec, const Work& work) {
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
#else
/// Seconds of `work` by the clock.
template <class Exec, class Work>
double seconds_of(const Exec&, const Work& work) {
  using clock = std::chrono::steady_clock;
  const clock::time_point begin = clock::now();
  work();
  return std::chrono::duration<double>(clock::now() - begin).count();
}
#endif

/// Seconds of `stage`, called through run_stage.
template <class Exec, class Stage>
double seconds_of_stage(const Exec& exec, const Stage& stage) {
  return seconds_of(
      exec, [&] { run_stage([](const void* work) { (*static_cast<const Stage*>(work))(); }, &stage); });
}

inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Sets a stage's counters: its time and its floor's in milliseconds, and their ratio.
inline void report(benchmark::State& state, double stage_seconds, double floor_seconds) {
  state.counters["median_ms"] = 1.0e3 * stage_seconds;
  state.counters["floor_ms"] = 1.0e3 * floor_seconds;
  state.counters["ratio"] = stage_seconds / floor_seconds;
}

/// Does nothing before a stage or a floor.
struct nothing {
  void operator()() const {}
};

/// Times stage and floor alternately, and reports their medians. `prepare` runs untimed before each stage.
template <class Exec, class Stage, class Floor, class Prepare = nothing>
void compare(benchmark::State& state, const Exec& exec, const Stage& stage, const Floor& floor,
             const Prepare& prepare = {}) {
  for (int i = 0; i < warm_up; ++i) {
    prepare();
    seconds_of(exec, stage);
    seconds_of(exec, floor);
  }
  std::vector<double> stages, floors;
  for (auto _ : state) {
    prepare();
    stages.push_back(seconds_of_stage(exec, stage));
    floors.push_back(seconds_of(exec, floor));
    state.SetIterationTime(stages.back());
  }
  report(state, median(stages), median(floors));
}

/// Names a stage's floor if it is another on CPUs than on a GPU.
inline void set_cpu_floor([[maybe_unused]] benchmark::State& state, [[maybe_unused]] const char* floor) {
#if !defined(__CUDACC__)
  state.SetLabel(floor);
#endif
}

/// Stands for the arguments of a stage without any.
struct no_arguments {};

/// Registers a stage that sets its times itself.
inline auto* add_stage(const char* name, benchmark::internal::Function* stage, no_arguments) {
  auto* const added = benchmark::RegisterBenchmark(name, stage);
  registered_stages().push_back(added);
  return added->Iterations(sizes::iterations)->UseManualTime()->Unit(benchmark::kMillisecond);
}

/// Registers a stage with names of its arguments and rows of their values.
template <std::size_t N>
auto* add_stage(const char* name, benchmark::internal::Function* stage, const std::vector<std::string>& names,
                const argument (&values)[N][2]) {
  auto* const added = add_stage(name, stage, no_arguments{})->ArgNames(names);
  for (const argument(&row)[2] : values) added->Args({row[0], row[1]});
  return added;
}

/// WFPG_BENCH_STAGE(stage, {"name", "name"}, rows) or WFPG_BENCH_STAGE(stage, no_arguments{}). For use in
/// namespace bench.
#if defined(__CUDACC__)
#define WFPG_BENCH_STAGE(stage, ...) \
  [[maybe_unused]] const auto* const stage##_on_cuda = add_stage(#stage, stage<wfpg::exec::cuda>, __VA_ARGS__)
#else
#define WFPG_BENCH_STAGE(stage, ...)                                                 \
  [[maybe_unused]] const benchmark::internal::Benchmark* const stage##_on_cpus[] = { \
      add_stage(#stage "/seq", stage<wfpg::exec::seq>, __VA_ARGS__),                 \
      add_stage(#stage "/omp", stage<wfpg::exec::omp>, __VA_ARGS__),                 \
      add_stage(#stage "/tbb", stage<wfpg::exec::tbb>, __VA_ARGS__)}
#endif

}  // namespace bench
