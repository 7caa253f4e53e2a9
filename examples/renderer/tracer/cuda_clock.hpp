// The clock of the renderer's stages on the CUDA policy. Include it where render_on of app/render_impl.hpp is
// called with that policy.
#pragma once

#include "tracer/stage_clock.hpp"

#include <wfpg/exec/cuda.hpp>

#include <cstddef>
#include <vector>

namespace render {

/// Times stages by events between them. Does not wait for a stage to end.
template <>
class policy_clock<wfpg::exec::cuda> {
 public:
  explicit policy_clock(const wfpg::exec::cuda& exec) : stream_(exec.stream()) {}
  policy_clock(const policy_clock&) = delete;
  policy_clock& operator=(const policy_clock&) = delete;
  ~policy_clock() {
    for (const interval& i : intervals_) {
      cudaEventDestroy(i.begin);
      cudaEventDestroy(i.end);
    }
  }

  /// Calls f. Later adds the device's time from the first to the last work of f to `stage`.
  template <class F>
  void measure(const char* stage, const F& f) {
    if (used_ == intervals_.size()) intervals_.push_back(make_interval());
    interval& now = intervals_[used_++];
    now.stage = stage;
    record(now.begin);
    f();
    record(now.end);
  }

  void resolve() {
    for (std::size_t i = 0; i < used_; ++i) {
      float milliseconds = 0.0f;
      wfpg::check_cuda(cudaEventSynchronize(intervals_[i].end), "cudaEventSynchronize");
      wfpg::check_cuda(cudaEventElapsedTime(&milliseconds, intervals_[i].begin, intervals_[i].end),
                       "cudaEventElapsedTime");
      sums_.add(intervals_[i].stage, 1e-3 * static_cast<double>(milliseconds));
    }
    used_ = 0;
  }

  const named_seconds& seconds() const { return sums_.seconds(); }

 private:
  struct interval {
    cudaEvent_t begin = nullptr, end = nullptr;
    const char* stage = nullptr;
  };

  static interval make_interval() {
    interval made;
    wfpg::check_cuda(cudaEventCreate(&made.begin), "cudaEventCreate");
    wfpg::check_cuda(cudaEventCreate(&made.end), "cudaEventCreate");
    return made;
  }
  void record(cudaEvent_t event) const {
    wfpg::check_cuda(cudaEventRecord(event, stream_), "cudaEventRecord");
  }

  cudaStream_t stream_;
  std::vector<interval> intervals_;  // allocated once, used for every sample
  std::size_t used_ = 0;             // since the last resolve()
  stage_clock sums_;
};

}  // namespace render
