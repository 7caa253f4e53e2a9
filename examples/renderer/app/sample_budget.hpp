// How long to take samples, by their number or by time.
#pragma once

#include "app/render.hpp"

#include <algorithm>
#include <chrono>

namespace render {

/// Time since it was made.
class stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Samples taken, and the part of the budget that they used.
class sample_budget {
 public:
  /// `samples`: taken already.
  sample_budget(const render_options& options, int samples)
      : spp_(options.spp),
        seconds_(options.seconds),
        least_(least_samples(options)),
        samples_(samples),
        begun_(options.seconds > 0.0 ? 0.0 : fraction()) {}

  int samples() const { return samples_; }
  double seconds() const { return clock_.seconds() - left_out_; }
  bool is_spent() const { return samples_ >= least_ && fraction() >= 1.0; }
  void count(int samples = 1) { samples_ += samples; }
  void leave_out(double seconds) { left_out_ += seconds; }
  render_progress progress() const { return {samples_, std::min(1.0, fraction()), seconds(), begun_}; }

 private:
  double fraction() const {
    return seconds_ > 0.0 ? seconds() / seconds_ : static_cast<double>(samples_) / spp_;
  }

  stopwatch clock_;
  int spp_;
  double seconds_;
  double left_out_ = 0.0;
  int least_;  ///< the picture of fewer has no weight
  int samples_;
  double begun_;  ///< fraction
};

}  // namespace render
