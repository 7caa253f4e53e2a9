// Decides when a guide rests. Samples whose guiding gains too little sample BSDFs alone, and cost what path
// tracing costs. Pure functions of counters, and of what was measured; every constant is here.
//
// The first sample is not guided. Its paths are kept, and compared with those of guided samples 4, 8, 16 and
// so on, which are also compared with each other. After each comparison the guide goes on, or it rests until
// the next one. Comparisons are at most 512 samples apart.
//
// Source: wfpg's own. Costs of guiding are weighed against what it saves in Rath et al., "EARS" (2022), too.
// Cost: O(1) a call. Memory: a few numbers on the host.
#pragma once

#include <wfpg/guide/statistics.hpp>

#include <cstdint>
#include <optional>

namespace wfpg {

/// Constants of the schedule of rests.
struct rest_constants {
  /// The first sample that is compared, counted from the unguided one. Guides have learnt little before.
  static constexpr std::uint32_t first_comparison = 4;
  /// From this sample on the whole of least_gain is asked for. Before, guides still learn. Sample i then asks
  /// for i / 32 of what least_gain exceeds 1 by.
  static constexpr std::uint32_t settled_samples = 32;
  /// Most samples between two comparisons, a power of two: what the camera sees may change.
  static constexpr std::uint32_t longest_rest = 512;
};

/// When a guider's samples rest. Ages count samples from the last unguided one on, which has age 1.
class rest_schedule {
 public:
  /// A guide that never rests.
  rest_schedule() = default;
  /// `least_gain`: that of sampling_options. `unguided_samples`: samples at the beginning that are not
  /// guided. The last one of them is compared; where there are none, the guide never rests.
  rest_schedule(std::optional<float> least_gain, std::uint32_t unguided_samples)
      : least_gain_(least_gain.value_or(0.0f)), unguided_(least_gain ? unguided_samples : 0) {}

  /// Whether the guide takes no part in a sample.
  bool rests(std::uint32_t sample) const { return resting_ && !compares(sample); }
  /// Whether a sample is not guided so that others can be compared with it.
  bool is_unguided(std::uint32_t sample) const { return unguided_ > 0 && sample == unguided_; }
  /// Whether a sample is guided, recorded, and measured: at the ages 3, 4, 8, ..., 512, 1024, 1536, ... Each
  /// is compared with the unguided sample, and with the one that was measured before.
  bool compares(std::uint32_t sample) const {
    if (unguided_ == 0 || sample <= unguided_) return false;
    const std::uint32_t age = sample - unguided_ + 1, first = rest_constants::first_comparison;
    if (age > rest_constants::longest_rest) return age % rest_constants::longest_rest == 0;
    return age == first - 1 || (age >= first && (age & (age - 1)) == 0);
  }

  /// Least gain for which the guide goes on after a sample that is compared; at least 1.
  float threshold(std::uint32_t sample) const {
    const float age = static_cast<float>(sample - unguided_ + 1);
    const float part = age / static_cast<float>(rest_constants::settled_samples);
    return 1.0f + (least_gain_ - 1.0f) * (part < 1.0f ? part : 1.0f);
  }
  /// Takes what was measured in a sample. The guide rests from the next one on where the gain is known and
  /// less than threshold(). Precondition: compares(sample).
  void decide(std::uint32_t sample, const guiding_gain& measured) {
    resting_ = measured.is_known() && measured.value() < threshold(sample);
  }
  /// Counts a sample that has begun.
  void count(std::uint32_t sample) { rested_ += rests(sample) ? 1u : 0u; }
  /// Forgets what was measured, after `sample`: light or geometry moved. A guide that rests wakes up. The
  /// next sample is then the unguided one. A guide that does not rest goes on, and is not compared again.
  /// Changes nothing before the unguided sample.
  void restart(std::uint32_t sample) {
    if (sample < unguided_) return;
    unguided_ = resting_ ? sample + 1 : 0;
    resting_ = false;
  }

  /// Number of samples so far that the guide rested in.
  std::uint32_t rested() const { return rested_; }
  /// Number of the sample that others are compared with, counted from 1; 0: there is none.
  std::uint32_t unguided_sample() const { return unguided_; }
  /// Whether samples rest, but for those that are compared.
  bool resting() const { return resting_; }

  /// Takes the state of a guider that had made `samples` samples, under the same options. Returns false where
  /// it has no such state.
  bool restore(std::uint32_t samples, std::uint32_t unguided, std::uint32_t rested, bool resting) {
    const bool is_to_come = unguided == unguided_ || unguided == samples + 1;
    if (rested > samples || (unguided > samples && !is_to_come)) return false;
    if (resting && (unguided == 0 || unguided > samples)) return false;
    unguided_ = unguided;
    rested_ = rested;
    resting_ = resting;
    return true;
  }
  /// Takes only the number of samples that a guider rested in. Its other options differ, so that its samples
  /// are not to be compared with this one's. Such a guide never rests.
  void restore_other(std::uint32_t rested) {
    unguided_ = 0;
    rested_ = rested;
    resting_ = false;
  }

 private:
  float least_gain_ = 0.0f;  // 0: never rests
  std::uint32_t unguided_ = 0;
  std::uint32_t rested_ = 0;
  bool resting_ = false;
};

}  // namespace wfpg
