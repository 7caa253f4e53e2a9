// Decides how many paths are guided: a few while it is not known whether guiding pays, then all, or none.
// Samples without guiding cost what path tracing costs. Pure functions of counters, and of what was measured;
// every constant is here.
//
// The first sample is not guided. In the next ones the guide probes: it takes part in few paths, which are
// compared with those of the first sample. Samples 3, 4, 8, 16 and so on are compared, also with each other.
// From sample 4 on each comparison lets the guide take part in all paths, or lets it rest until the next one.
// A guide that rests probes in the samples that are compared. Comparisons are at most 512 samples apart.
//
// Source: wfpg's own. Costs of guiding are weighed against what it saves in Rath et al., "EARS" (2022), too.
// Samples are weighed by their variance in Müller, "Path Guiding in Production" (2019), too.
// Cost: O(1) a call. Memory: a few numbers on the host.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/guide/statistics.hpp>

#include <cstdint>

namespace wfpg {

/// Constants of the schedule of rests.
struct rest_constants {
  /// The first sample that decides, counted from the unguided one. Guides have learnt little before.
  static constexpr std::uint32_t first_comparison = 4;
  /// From this sample on the whole of least_gain is asked for. Before, guides still learn. Sample i then asks
  /// for i / 32 of what least_gain exceeds 1 by.
  static constexpr std::uint32_t settled_samples = 32;
  /// From this sample on few paths are enough to let the guide take part in all of them. Before, the gain has
  /// to exceed least_gain, by up to half as much again.
  static constexpr std::uint32_t last_doubt = 16;
  /// Variance of unguided paths, over the square of their mean, above which few paths do not measure it: it
  /// lies in the brightest. Guiding has much to gain there, so that no more than a gain of 1 is asked for.
  static constexpr double much_noise = 4.0;
  /// Most samples between two comparisons, a power of two: what the camera sees may change.
  static constexpr std::uint32_t longest_rest = 512;
  /// least_gain of policies whose blocks have several warps. On an H200 a guided vertex takes 1.3 times an
  /// unguided one's time.
  static constexpr float gpu_least_gain = 1.25f;
  /// least_gain of other policies. On one thread a guided vertex takes 1.3 to 2.2 times an unguided one's
  /// time: the less, the longer a ray takes.
  static constexpr float cpu_least_gain = 1.75f;
  /// Largest weight of a guided sample in the picture, over an unguided one's.
  static constexpr float largest_weight = 16.0f;
  /// Least weight where unguided paths find less than this part of the guided paths' light. The gain is
  /// larger than measured.
  static constexpr float weight_of_missed_light = 4.0f;
  /// That part. Few paths may miss some light by chance.
  static constexpr double much_missed_light = 0.8;
};

/// In which samples a guider guides. Ages count samples from the last unguided one on, which has age 1.
class rest_schedule {
 public:
  /// A guide that takes part in all paths, and is never compared.
  rest_schedule() = default;
  /// `least_gain`: gain below which the guide rests; 0: it never does. `unguided_samples`: samples at the
  /// beginning that are not guided. The last one of them is compared; where there are none, the guide never
  /// rests.
  rest_schedule(float least_gain, std::uint32_t unguided_samples)
      : least_gain_(least_gain), unguided_(least_gain > 0.0f ? unguided_samples : 0) {
    if (unguided_ > 0) takes_part_ = part::in_few;
  }

  /// Whether the guide takes no part in a sample.
  bool rests(std::uint32_t sample) const { return resting() && !compares(sample); }
  /// Whether no other paths than those that are compared are recorded and guided. From the unguided sample
  /// on.
  bool probes(std::uint32_t sample) const {
    return (takes_part_ == part::in_few && sample >= unguided_) || (resting() && compares(sample));
  }
  /// Whether a sample guides few paths, or none.
  bool guides_few(std::uint32_t sample) const { return probes(sample) || rests(sample); }
  /// Whether a sample is not guided so that others can be compared with it.
  bool is_unguided(std::uint32_t sample) const { return unguided_ > 0 && sample == unguided_; }
  /// Whether a sample is guided, recorded, and measured: at the ages 3, 4, 8, ..., 512, 1024, 1536, ... Each
  /// is compared with the unguided sample, and with the one that was measured before.
  bool compares(std::uint32_t sample) const {
    if (unguided_ == 0 || sample <= unguided_) return false;
    const std::uint32_t age = age_of(sample), first = rest_constants::first_comparison;
    if (age > rest_constants::longest_rest) return age % rest_constants::longest_rest == 0;
    return age == first - 1 || (age >= first && (age & (age - 1)) == 0);
  }

  /// Least gain for which the guide goes on after a sample that is compared; at least 1.
  float threshold(std::uint32_t sample) const {
    const float part =
        static_cast<float>(age_of(sample)) / static_cast<float>(rest_constants::settled_samples);
    return 1.0f + (least_gain_ - 1.0f) * min(part, 1.0f);
  }
  /// Gain from which on the guide takes part in all paths after a sample that is compared. Between
  /// threshold() and this one a guide that takes part in few paths goes on so: few paths measure the gain to
  /// a third.
  float sure_gain(std::uint32_t sample) const {
    const std::uint32_t age = age_of(sample), last = rest_constants::last_doubt;
    if (age >= last) return threshold(sample);
    const float doubt = static_cast<float>(last - age) / static_cast<float>(last);
    return max(least_gain_, 1.0f) * (1.0f + 0.5f * doubt);
  }
  /// Takes what was measured in a sample. From the next one on the guide rests where the gain is known and
  /// less than threshold(). It takes part in all paths where the gain is at least sure_gain(), or not known.
  /// Nothing is decided before the first comparison. Precondition: compares(sample).
  void decide(std::uint32_t sample, const guiding_gain& measured) {
    if (age_of(sample) < rest_constants::first_comparison) return;
    weight_ = weight_of(measured);
    const double gain = measured.value_a_vertex(), mean = measured.unguided_mean;
    const bool is_noisy = measured.unguided_variance > rest_constants::much_noise * mean * mean;
    if (measured.is_known() && gain < (is_noisy ? 1.0f : threshold(sample)))
      takes_part_ = part::in_none;
    else if (!measured.is_known() || gain >= sure_gain(sample) || takes_part_ == part::in_all)
      takes_part_ = part::in_all;
    else
      takes_part_ = part::in_few;
  }
  /// Weight of a guided sample in the picture, over an unguided one's: the gain of the last comparison, from
  /// 1 to largest_weight.
  float weight() const { return weight_; }
  /// Counts a sample that has begun.
  void count(std::uint32_t sample) { rested_ += rests(sample) ? 1u : 0u; }
  /// Forgets what was measured, after `sample`: light or geometry moved. A guide that rests wakes up, and the
  /// next sample is the unguided one. Another guide takes part in all paths from then on, and is not compared
  /// again. Otherwise, a host that moves something after each sample would never know. Changes nothing before
  /// the unguided sample.
  void restart(std::uint32_t sample) {
    if (sample < unguided_ || unguided_ == 0) return;
    unguided_ = resting() ? sample + 1 : 0;
    takes_part_ = resting() ? part::in_few : part::in_all;
    weight_ = 1.0f;
  }

  /// Number of samples so far that the guide rested in.
  std::uint32_t rested() const { return rested_; }
  /// Number of the sample that others are compared with, counted from 1; 0: there is none.
  std::uint32_t unguided_sample() const { return unguided_; }
  /// Whether samples rest, but for those that are compared.
  bool resting() const { return takes_part_ == part::in_none; }

  /// A schedule as a guide file holds it.
  struct state {
    std::uint32_t unguided = 0;    ///< unguided_sample()
    std::uint32_t rested = 0;      ///< rested()
    std::uint32_t takes_part = 2;  ///< 0: in no path, 1: in few, 2: in all
    float weight = 1.0f;           ///< of guided samples in the picture
  };
  /// The schedule's state.
  state saved() const { return {unguided_, rested_, static_cast<std::uint32_t>(takes_part_), weight_}; }
  /// Takes the state of a guider that had made `samples` samples, under the same options. Returns false where
  /// it has no such state.
  bool restore(std::uint32_t samples, const state& from) {
    const bool is_to_come = from.unguided == unguided_ || from.unguided == samples + 1;
    if (from.rested > samples || (from.unguided > samples && !is_to_come) || from.takes_part > 2)
      return false;
    const auto takes_part = static_cast<part>(from.takes_part);
    if (takes_part == part::in_none && (from.unguided == 0 || from.unguided > samples)) return false;
    if (takes_part == part::in_few && from.unguided == 0) return false;
    if (!is_finite(from.weight)) return false;
    if (from.weight < 1.0f || from.weight > rest_constants::largest_weight) return false;
    unguided_ = from.unguided;
    rested_ = from.rested;
    takes_part_ = takes_part;
    weight_ = from.weight;
    return true;
  }
  /// Takes only the number of samples that a guider rested in. Its other options differ, so that its samples
  /// are not to be compared with this one's. Such a guide never rests.
  void restore_other(std::uint32_t rested) {
    *this = {};
    rested_ = rested;
  }

 private:
  // In how many paths the guide takes part. Numbers are those of the file.
  enum class part : std::uint32_t { in_none = 0, in_few = 1, in_all = 2 };

  std::uint32_t age_of(std::uint32_t sample) const { return sample - unguided_ + 1; }
  static float weight_of(const guiding_gain& measured) {
    if (measured.paths < guiding_gain::least_paths) return 1.0f;
    const bool misses_much =
        measured.unguided_mean < rest_constants::much_missed_light * measured.guided_mean;
    const float least = misses_much ? rest_constants::weight_of_missed_light : 1.0f;
    return clamp(static_cast<float>(measured.value()), least, rest_constants::largest_weight);
  }

  float least_gain_ = 0.0f;  // 0: never rests
  float weight_ = 1.0f;
  part takes_part_ = part::in_all;
  std::uint32_t unguided_ = 0;
  std::uint32_t rested_ = 0;
};

}  // namespace wfpg
