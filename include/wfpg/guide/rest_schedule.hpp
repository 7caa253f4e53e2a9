// Decides how many paths are guided: a few while it is not known whether guiding pays, then all, or none.
// Samples without guiding cost what path tracing costs. Pure functions of counters, and of what was measured;
// every constant is here.
//
// The first two samples are not guided. Where they show little noise, the guide rests until probing costs
// little beside what was rendered. Two more samples are then unguided, and all begins as if the first of them
// was sample 1. In the next samples the guide probes: it takes part in few paths, which are compared with
// those of unguided samples. Samples 3, 4, 8, 16 and so on are compared, also with each
// other. From sample 4 on each comparison lets the guide take part in all paths, or lets it rest until the
// next one. A gain that a few bright paths may have made by chance is not enough. A guide that goes on
// probing leaves out samples 5 and 9, so that the variance of unguided paths is known better. A guide that
// rests probes in the samples that are compared. Comparisons are at most 512 samples apart.
//
// Source: wfpg's own. Costs of guiding are weighed against what it saves in Rath et al., "EARS" (2022), too.
// Samples are weighed by their variance in Müller, "Path Guiding in Production" (2019), too.
// Cost: O(1) a call. Memory: a few numbers on the host.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/guide/statistics.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace wfpg {

/// Constants of the schedule of rests.
struct rest_constants {
  /// The first sample that decides, counted from the first that is compared. Guides have learnt little
  /// before.
  static constexpr std::uint32_t first_comparison = 4;
  /// From this sample on the whole of least_gain is asked for where noise is small. Before, guides still
  /// learn. Sample i then asks for i / 16 of what least_gain exceeds 1 by.
  static constexpr std::uint32_t settled_samples = 16;
  /// Noise above which less is asked for, in inverse proportion. Bright paths then hold most of what there is
  /// to gain, and a few thousand do not measure it. The noise is the typical variance of unguided paths, over
  /// the square of their mean.
  static constexpr double much_noise = 1.25;
  /// Noise lowers what is asked for no further than by this, but to most_in_noise where that is less. It
  /// never goes below least_in_noise.
  static constexpr float hidden_in_noise = 0.3f;
  static constexpr float least_in_noise = 0.95f;  ///< least value of rest_schedule::enough()
  /// Above what guides reach where they cannot help: a gain of 1.05 where lights are chosen badly.
  static constexpr float most_in_noise = 1.15f;
  /// Noise above which no more than least_in_noise is asked for. Few paths then find light, and a few
  /// thousand do not measure a gain.
  static constexpr double little_light = 50.0;
  /// Paths that are made before a guide probes, where noise is less than much_noise. In a box probing takes
  /// the time of 150,000 paths or more, which few samples of a small picture do not repay.
  static constexpr std::size_t paths_before_probing = std::size_t(1) << 21;
  /// A guide probes after so many samples, however few paths they have.
  static constexpr std::uint32_t longest_wait = 28;
  /// Noise below which choices of lights rest while a guide waits. They would not repay their time.
  static constexpr double light_noise = 0.25;
  /// A guide rests in noise where its gain is so much less than what lets it take part.
  static constexpr float slack_in_noise = 0.05f;
  /// Standard error of a gain's logarithm for which the limits above are made.
  static constexpr double small_error = 0.15;
  /// The logarithm of a gain is lowered by so many times what its error exceeds small_error by. Where few
  /// bright paths decide, the error is often too small where the gain is too large.
  static constexpr double errors_of_doubt = 4.0;
  /// From this sample on a guide rests while its gain is in doubt. More unguided samples change little.
  static constexpr std::uint32_t last_doubt = 8;
  /// Most samples between two comparisons, a power of two: what the camera sees may change.
  static constexpr std::uint32_t longest_rest = 512;
  /// least_gain of policies whose blocks have several warps. On an H200 a guided vertex takes 1.3 times an
  /// unguided one's time.
  static constexpr float gpu_least_gain = 1.25f;
  /// least_gain of other policies, for a scene of `triangles`; 0: it is not known. What guiding costs does
  /// not depend on them, and a ray takes the longer, the more they are. On one thread a guided vertex
  /// takes 2.2 times an unguided one's time among 32 triangles, and 1.6 times among 600,000. Both are of
  /// waves; path tracing without them takes less. Among many triangles the gain of typical paths is less than
  /// that of all, so that less is asked for.
  static float cpu_least_gain(std::size_t triangles) {
    if (triangles == 0) return 1.75f;
    const int bits = bits_of(static_cast<std::uint32_t>(min<std::size_t>(triangles, 1u << 31)));
    return max(2.6f - 0.085f * static_cast<float>(bits), gpu_least_gain);
  }
  /// Most unguided samples whose paths are compared: of the ages 1, 2, 5 and 9.
  static constexpr std::uint32_t most_unguided = 4;
  /// Gain, at equal numbers of samples, below which choices of lights rest with the guide. Where lights are
  /// many, learnt choices take a third more time than others.
  static constexpr double light_gain = 1.25;
  /// Largest weight of a guided sample in the picture, over an unguided one's.
  static constexpr float largest_weight = 16.0f;
  /// Least weight where unguided paths find less than this part of the guided paths' light. The gain is
  /// larger than measured.
  static constexpr float weight_of_missed_light = 4.0f;
  /// That part. Few paths may miss some light by chance.
  static constexpr double much_missed_light = 0.8;
};

/// In which samples a guider guides. Ages count samples from the first one that is compared, which has age 1.
class rest_schedule {
 public:
  /// A guide that takes part in all paths, and is never compared.
  rest_schedule() = default;
  /// `least_gain`: gain below which the guide rests; 0: it never does. `unguided_samples`: samples at the
  /// beginning that are not guided. The last one of them is compared, and the one after it is not guided,
  /// too. Where there are none, the guide never rests.
  rest_schedule(float least_gain, std::uint32_t unguided_samples)
      : least_gain_(least_gain), unguided_(least_gain > 0.0f ? unguided_samples : 0) {
    if (unguided_ > 0) takes_part_ = part::in_few;
  }

  /// Whether the guide takes no part in a sample.
  bool rests(std::uint32_t sample) const { return resting() && !compares(sample) && !is_unguided(sample); }
  /// Whether no other paths than those that are compared are recorded and guided. From the unguided sample
  /// on.
  bool probes(std::uint32_t sample) const {
    return (takes_part_ == part::in_few && sample >= unguided_) ||
           (resting() && (compares(sample) || is_unguided(sample)));
  }
  /// Whether a sample guides few paths, or none.
  bool guides_few(std::uint32_t sample) const { return probes(sample) || rests(sample); }
  /// Whether a sample is not guided so that others can be compared with it. So are those of the ages 1 and 2,
  /// and of 5 and 9 while the guide takes part in few paths.
  bool is_unguided(std::uint32_t sample) const {
    return unguided_number(sample) < rest_constants::most_unguided;
  }
  /// Number of an unguided sample among those of its comparisons, from 0. Of others:
  /// rest_constants::most_unguided.
  std::uint32_t unguided_number(std::uint32_t sample) const {
    constexpr std::uint32_t ages[rest_constants::most_unguided] = {1, 2, 5, 9};
    // Those before a wait stay what they were.
    if (first_unguided_ > 0 && sample - first_unguided_ < 2) return sample - first_unguided_;
    if (unguided_ == 0 || sample < unguided_) return rest_constants::most_unguided;
    std::uint32_t number = 0;
    while (number < rest_constants::most_unguided && ages[number] != age_of(sample)) ++number;
    return number < 2 || takes_part_ == part::in_few ? number : rest_constants::most_unguided;
  }
  /// Whether a sample is guided, recorded, and measured: at the ages 3, 4, 8, ..., 512, 1024, 1536, ... Each
  /// is compared with the unguided samples, and with the one that was measured before.
  bool compares(std::uint32_t sample) const {
    if (unguided_ == 0 || sample <= unguided_) return false;
    const std::uint32_t age = age_of(sample), first = rest_constants::first_comparison;
    if (age > rest_constants::longest_rest) return age % rest_constants::longest_rest == 0;
    return age == first - 1 || (age >= first && (age & (age - 1)) == 0);
  }

  /// Least gain for which the guide goes on after a sample that is compared, where noise is small; at
  /// least 1.
  float threshold(std::uint32_t sample) const {
    const float part =
        static_cast<float>(age_of(sample)) / static_cast<float>(rest_constants::settled_samples);
    return 1.0f + (least_gain_ - 1.0f) * min(part, 1.0f);
  }
  /// Gain that lets the guide take part in all paths, at most least_gain. `noise`: of unguided paths, as
  /// rest_constants::much_noise has it.
  float enough(double noise) const {
    if (noise > rest_constants::little_light) return rest_constants::least_in_noise;
    const float least = clamp(least_gain_ - rest_constants::hidden_in_noise, rest_constants::least_in_noise,
                              rest_constants::most_in_noise);
    const double lowered = rest_constants::much_noise / max(noise, rest_constants::much_noise);
    return max(static_cast<float>(lowered) * least_gain_, least);
  }
  /// Takes what was measured in a sample, which decides from the next one on. The guide takes part in all
  /// paths where the gain is not known, or surely at least enough(). It rests where the gain is less than
  /// threshold(), from last_doubt on also where it is not surely as much. Between them it takes part in as
  /// many as before, and in few where it rested or the gain is in doubt. In noise it rests where the gain is
  /// less than enough() by slack_in_noise, if that is less than threshold(). Nothing is decided before the
  /// first comparison. Precondition: compares(sample).
  void decide(std::uint32_t sample, const guiding_gain& measured) {
    if (age_of(sample) < rest_constants::first_comparison) return;
    weight_ = weight_of(measured);
    const double gain = measured.typical_value(), noise = measured.noise();
    const double sure = noise > rest_constants::little_light ? gain : sure_gain(measured);
    const float all = enough(noise),
                slack = noise > rest_constants::much_noise ? rest_constants::slack_in_noise : 0.0f,
                least = min(threshold(sample), all - slack);
    if (!measured.is_known() || sure >= all)
      takes_part_ = part::in_all;
    else if ((age_of(sample) < rest_constants::last_doubt ? gain : sure) < least)
      takes_part_ = part::in_none;
    else if (resting() || sure < least)
      takes_part_ = part::in_few;
  }
  /// Takes what unguided paths showed in a sample of `paths`. After the second one, a guide of little noise
  /// waits until paths_before_probing have been made, or longest_wait samples. It rests meanwhile, and then
  /// is compared as at the beginning. It does not wait where so much was made already, or too few paths are
  /// known.
  void see_unguided(std::uint32_t sample, const guiding_gain& unguided, std::size_t paths) {
    if (unguided_number(sample) != 1 || unguided.paths < guiding_gain::least_paths) return;
    const auto noise = static_cast<float>(unguided.noise());
    if (!(unguided.unguided_mean > 0.0) || !is_finite(noise)) return;
    if (first_noise_ >= rest_constants::light_noise) light_gain_ = gain_of_lights(noise);
    if (noise >= rest_constants::much_noise) return;
    const std::size_t a_sample = max<std::size_t>(paths, 1),
                      samples = (rest_constants::paths_before_probing - 1) / a_sample + 1;
    const auto end = static_cast<std::uint32_t>(min<std::size_t>(samples, rest_constants::longest_wait));
    if (end <= sample) return;
    first_unguided_ = unguided_;
    first_noise_ = noise;
    unguided_ = end + 1;
    takes_part_ = part::in_none;
  }
  /// Whether choices of lights rest with the guide, whose comparisons gave `measured`. They do where they are
  /// known to gain little. While the guide waits, they rest in very little noise: light_noise.
  bool lights_rest(const guiding_gain& measured) const {
    if (measured.paths == 0) return first_noise_ < rest_constants::light_noise;
    return measured.value() * light_gain_ < rest_constants::light_gain;
  }
  /// Weight of a guided sample in the picture, over an unguided one's: the gain of the last comparison, from
  /// 1 to largest_weight.
  float weight() const { return weight_; }
  /// Counts a sample that has begun.
  void count(std::uint32_t sample) { rested_ += rests(sample) ? 1u : 0u; }
  /// Forgets what was measured, after `sample`: light or geometry moved. A guide that rests wakes up, and the
  /// next sample is the unguided one. Another guide takes part in all paths from then on, and is not compared
  /// again. Otherwise, a host that moves something after each sample would never know. Before the first
  /// unguided sample nothing changes.
  void restart(std::uint32_t sample) {
    if (unguided_ == 0 || (sample < unguided_ && !resting())) return;
    unguided_ = resting() ? sample + 1 : 0;
    takes_part_ = resting() ? part::in_few : part::in_all;
    weight_ = 1.0f;
    first_unguided_ = 0;
    first_noise_ = 0.0f;
    light_gain_ = 1.0f;
  }

  /// Number of samples so far that the guide rested in.
  std::uint32_t rested() const { return rested_; }
  /// Number of the sample that others are compared with, counted from 1; 0: there is none.
  std::uint32_t unguided_sample() const { return unguided_; }
  /// Whether samples rest, but for those that are compared, and those that these are compared with.
  bool resting() const { return takes_part_ == part::in_none; }

  /// A schedule as a guide file holds it.
  struct state {
    std::uint32_t unguided = 0;        ///< unguided_sample()
    std::uint32_t rested = 0;          ///< rested()
    std::uint32_t takes_part = 2;      ///< 0: in no path, 1: in few, 2: in all
    float weight = 1.0f;               ///< of guided samples in the picture
    float least_gain = 0.0f;           ///< below which it rests; 0: it never does
    std::uint32_t first_unguided = 0;  ///< unguided before it waited; 0: it did not
    float first_noise = 0.0f;          ///< in which it began to wait
    float light_gain = 1.0f;           ///< of choices of lights while it waited
  };
  /// The schedule's state.
  state saved() const {
    return {unguided_,    rested_,     static_cast<std::uint32_t>(takes_part_),
            weight_,      least_gain_, first_unguided_,
            first_noise_, light_gain_};
  }
  /// Takes the state of a guider that had made `samples` samples, under the same options. Returns false where
  /// it has no such state.
  bool restore(std::uint32_t samples, const state& from) {
    if (!has_wait(samples, from)) return false;
    if (from.rested > samples || from.takes_part > 2) return false;
    const auto takes_part = static_cast<part>(from.takes_part);
    // A guide that rests has seen its unguided sample, but for one that waits for the next.
    const bool is_to_come = takes_part == part::in_none
                                ? from.first_unguided > 0
                                : from.unguided == unguided_ || from.unguided == samples + 1;
    if (from.unguided > samples && !is_to_come) return false;
    if (takes_part != part::in_all && from.unguided == 0) return false;
    if (!is_finite(from.weight)) return false;
    if (from.weight < 1.0f || from.weight > rest_constants::largest_weight) return false;
    if (!is_finite(from.least_gain) || (from.least_gain != 0.0f && from.least_gain < 1.0f)) return false;
    least_gain_ = from.least_gain;
    first_unguided_ = from.first_unguided;
    first_noise_ = from.first_noise;
    light_gain_ = from.light_gain;
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

  // Gain of choices of lights during a wait, after which unguided paths have this noise. Those of sample 1
  // had learnt nothing, so that the noise before the wait is the mean of that without and with what they
  // learnt.
  float gain_of_lights(float noise) const {
    const float ratio = first_noise_ / max(noise, 1.0e-6f);
    return max(first_unguided_ == 1 ? 2.0f * ratio - 1.0f : ratio, 1.0f);
  }
  // Whether a state's numbers of a wait are those of a guider that had made `samples` samples.
  static bool has_wait(std::uint32_t samples, const state& from) {
    const float noise = from.first_noise, gain = from.light_gain;
    if (from.first_unguided == 0) return noise == 0.0f && gain == 1.0f;
    const bool follows = from.first_unguided < samples && from.first_unguided + 2 < from.unguided &&
                         from.unguided <= rest_constants::longest_wait + 1;
    return follows && is_finite(noise) && noise >= 0.0f && noise < rest_constants::much_noise &&
           is_finite(gain) && gain >= 1.0f;
  }
  // The gain of typical paths without what chance may have added.
  static double sure_gain(const guiding_gain& measured) {
    const double doubt = max(measured.typical_error - rest_constants::small_error, 0.0);
    return measured.typical_value() * std::exp(-rest_constants::errors_of_doubt * doubt);
  }
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
  std::uint32_t first_unguided_ = 0;  // unguided_ before it waited; 0: it did not
  float first_noise_ = 0.0f;          // in which it began to wait
  float light_gain_ = 1.0f;           // of choices of lights while it waited, which comparisons lack
  part takes_part_ = part::in_all;
  std::uint32_t unguided_ = 0;
  std::uint32_t rested_ = 0;
};

}  // namespace wfpg
