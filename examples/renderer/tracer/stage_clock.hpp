// Wall time by stage.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace render {

using named_seconds = std::vector<std::pair<std::string, double>>;

/// Sums the seconds of named stages, in the order of their first use.
class stage_clock {
 public:
  /// Calls f and adds its time to `stage`. Work that f leaves running does not count.
  template <class F>
  void measure(const char* stage, const F& f) {
    const auto start = std::chrono::steady_clock::now();
    f();
    add(stage, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }

  void add(const char* stage, double seconds) {
    for (auto& [name, sum] : seconds_) {
      if (name != stage) continue;
      sum += seconds;
      return;
    }
    seconds_.emplace_back(stage, seconds);
  }

  const named_seconds& seconds() const { return seconds_; }

 private:
  named_seconds seconds_;
};

/// Times stages of work on a policy whose calls return when the work is done. Asynchronous policies have a
/// specialisation.
template <class Exec>
class policy_clock : public stage_clock {
 public:
  explicit policy_clock(const Exec&) {}

  /// Adds times that measure() could not know yet. All work must be finished.
  void resolve() {}
};

}  // namespace render
