// Decides when kept fields are built: which waves build, and which fields are due. Also decides which rays
// are counted for bins, and when bins are chosen anew. Pure functions of counters; every constant is here.
// wfpg's own.
//
// Cost: O(1) a call. Memory: seven counters.
#pragma once

#include <wfpg/base/config.hpp>
#include <wfpg/base/math.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

/// Constants of the schedule, with what was measured of them. Times are of one guided sample, relative to
/// path tracing's, a segment. The scene is veach-ajar on an H200 (docs/performance.md).
struct build_schedule_constants {
  /// Samples at the beginning in which every wave builds. Later, fields change little, and one field keeps a
  /// GPU busy as long as a hundred.
  static constexpr std::uint32_t warm_up_samples = 32;
  /// After warm-up, one wave of this many builds. 4: 1.296 to 1.300; 8: 1.289; 16: no faster than 8.
  static constexpr std::uint32_t wave_period = 8;
  /// After bins were chosen anew, every wave builds for this many samples. 8: 1.289; 4: 1.282, with equal
  /// errors.
  static constexpr std::uint32_t busy_samples = 4;
  /// After geometry or lights moved, every wave builds for this many samples, as at the beginning.
  static constexpr std::uint32_t invalidated_samples = 32;
  /// During warm-up a field is due once 1 / 8 of the samples passed since its last build, ...
  static constexpr std::uint32_t warm_up_builds = 8;
  /// ... and later once 1 / 4 did: means of many samples change as slowly as that.
  static constexpr std::uint32_t later_builds = 4;
  /// Samples at the beginning whose rays are all counted for bins. Each count is an atomic. The nodes'
  /// fractions of rays converge within these samples.
  static constexpr std::uint32_t counted_samples = 8;
  /// During the rest of warm-up, rays are counted in one sample of this many, ...
  static constexpr std::uint32_t warm_up_count_period = 4;
  /// ... and later in one sample of this many.
  static constexpr std::uint32_t later_count_period = 16;
  /// Where a wave has more rays than this per leaf of the octree, only one ray of a stride is counted, ...
  static constexpr std::uint32_t counted_rays_a_leaf = 8;
  /// ... and the stride is at most this.
  static constexpr std::uint32_t max_count_stride = 32;
  /// log2 of the rays of a bin over rays_per_bin, while few paths are guided. Bins are also a level larger at
  /// least. Making fields is most of what probing costs.
  static constexpr std::uint32_t larger_probing_bins = 2;
  /// Slots that one wave allocates at most: one block handles this many in microseconds.
  static constexpr std::uint32_t max_allocations = 1u << 12;
  /// Before this sample bins may become smaller. Later, fields have learnt, and smaller bins would learn
  /// again from nothing.
  static constexpr std::uint32_t last_refinement = 16;
  /// Pressure of 1. Bins are then large enough that their fields fit the slots, if all have as many rays.
  static constexpr std::uint32_t pressure_unit = 64;
  /// Pressure before any sample was made: 2.
  static constexpr std::uint32_t first_pressure = 2 * pressure_unit;
  /// Lower bound of the pressure: 1 / 4.
  static constexpr std::uint32_t least_pressure = pressure_unit / 4;
  /// Upper bound of the pressure: 2^15.
  static constexpr std::uint32_t largest_pressure = pressure_unit << 15;
  /// One slot of this many is left free, for fields that are seldom asked for.
  static constexpr std::uint32_t spare_slots = 8;
};

/// Which rays of a wave are counted: those with `ray % stride == first`; none where the stride is 0.
struct counted_rays {
  std::uint32_t stride = 1;  ///< one ray of this many; each then counts as that many
  std::uint32_t first = 0;   ///< in [0, stride)

  /// Whether the ray of this number in its wave is counted.
  WFPG_HD bool includes(std::size_t ray) const { return stride > 0 && ray % stride == first; }
};

/// Counters that the schedule depends on. A sample calls begin_sample() and count_sample(), then end_wave()
/// after each wave.
class build_schedule {
 public:
  /// A schedule that counts every ray.
  build_schedule() = default;
  /// Sets the stride of counted rays, for waves of up to `max_rays` rays over an octree of `leaves` leaves.
  /// The stride doubles while more than counted_rays_a_leaf rays a leaf are counted.
  build_schedule(std::size_t max_rays, std::uint32_t leaves) {
    while (max_rays / stride_ > constants::counted_rays_a_leaf * std::size_t(leaves) &&
           stride_ < constants::max_count_stride)
      stride_ *= 2;
  }

  /// Begins a sample, counted from 1; its waves are numbered from 0. `light_age`: the sample's number since
  /// light was last forgotten.
  void begin_sample(std::uint32_t sample, std::uint32_t light_age) {
    sample_ = sample;
    light_age_ = light_age;
    wave_ = 0;
  }
  /// Notes that the sample's rays are counted, if they are. Call it once a sample.
  void count_sample() {
    if (counts_rays()) ++counted_;
  }
  /// Moves to the sample's next wave.
  void end_wave() { ++wave_; }
  /// Makes every wave build in the next `samples` samples.
  void expect_builds(std::uint32_t samples) { busy_until_ = max(busy_until_, sample_ + samples); }

  /// The sample that has begun; 0 before the first.
  std::uint32_t sample() const { return sample_; }
  /// Number of the sample since light was last forgotten, with this one.
  std::uint32_t light_age() const { return light_age_; }
  /// Number of waves of the sample that have ended.
  std::uint32_t wave() const { return wave_; }
  /// Whether the next wave builds fields. After the busy samples, each depth builds in another sample.
  bool builds_in_wave() const {
    return sample_ <= busy_until_ || (sample_ + wave_) % constants::wave_period == 0;
  }
  /// Whether the sample's rays are counted.
  bool counts_rays() const {
    const std::uint32_t period = sample_ <= constants::warm_up_samples ? constants::warm_up_count_period
                                                                       : constants::later_count_period;
    return age() <= constants::counted_samples || sample_ % period == 0;
  }
  /// Which of the sample's rays are counted, where one path in 2^log2_divisor takes part. With a stride above
  /// 1, successive samples count different rays.
  counted_rays counted(std::uint32_t log2_divisor = 0) const {
    if (!counts_rays()) return {0, 0};
    const std::uint32_t stride = max(stride_ >> min(log2_divisor, 31u), 1u);
    return {stride, sample_ % stride};
  }
  /// Begins choosing bins anew after this sample: from the next one on, as many paths are guided as ever.
  void begin_anew() { before_ = sample_; }
  /// Number of samples since all paths are guided, with this one; 0 before the first.
  std::uint32_t age() const { return sample_ - before_; }
  /// Number of samples before all paths were guided.
  std::uint32_t before() const { return before_; }
  /// Number of samples whose rays were counted.
  std::uint32_t counted_samples() const { return counted_; }
  /// Whether bins are chosen anew at the end of the sample: at the ages 1, 2, 4, 8, ...
  bool chooses_bins() const { return age() > 0 && (age() & (age() - 1)) == 0; }
  /// The last sample in which every wave builds.
  std::uint32_t busy_until() const { return busy_until_; }

  /// Takes a saved state. Returns false where it cannot have come from `sample` samples.
  bool restore(std::uint32_t sample, std::uint32_t counted, std::uint32_t busy_until, std::uint32_t before) {
    sample_ = sample;
    counted_ = counted;
    busy_until_ = busy_until;
    before_ = before;
    return counted <= sample && busy_until <= sample + constants::invalidated_samples && before <= sample;
  }

  /// Whether a field is due in a sample of this light_age(). `builds`: how often it was built; 0 is always
  /// due. `last_built`: sample of the last build, at most `sample`. A field is built once a sample at most.
  WFPG_HD static bool is_due(std::uint32_t sample, std::uint32_t light_age, std::uint32_t builds,
                             std::uint32_t last_built) {
    const std::uint64_t passed = sample - last_built;
    const std::uint64_t builds_a_doubling =
        light_age <= constants::warm_up_samples ? constants::warm_up_builds : constants::later_builds;
    return builds == 0 || (passed >= 1 && builds_a_doubling * passed >= light_age);
  }

  /// Returns the pressure on the size of bins, after a sample in which rays asked for `asked` fields. Bins
  /// shrink or grow so that their fields fill the slots but for the spare ones. One step at most halves or
  /// doubles the pressure.
  ///
  /// From last_refinement on bins only grow, and only where slots were `refused`. Shrinking stops that early,
  /// so that a later sample shows whether it went too far. Where all nodes have as many rays, a little less
  /// pressure makes four times the bins. A sample that asked for no field changes nothing.
  WFPG_HD static std::uint32_t next_pressure(std::uint32_t pressure, std::uint64_t asked, std::uint64_t slots,
                                             std::uint32_t sample, bool refused) {
    const bool shrinks = sample < constants::last_refinement;
    if (asked == 0 || !(shrinks || refused)) return pressure;
    const std::uint64_t now = pressure;
    const std::uint64_t next = now * asked / max<std::uint64_t>(slots - slots / constants::spare_slots, 1);
    const std::uint64_t low = shrinks ? now / 2 : now;
    return static_cast<std::uint32_t>(clamp(clamp(next, low, 2 * now),
                                            std::uint64_t(constants::least_pressure),
                                            std::uint64_t(constants::largest_pressure)));
  }

 private:
  using constants = build_schedule_constants;

  std::uint32_t sample_ = 0;
  std::uint32_t light_age_ = 0;
  std::uint32_t wave_ = 0;
  std::uint32_t counted_ = 0;
  std::uint32_t stride_ = 1;
  std::uint32_t busy_until_ = constants::warm_up_samples;
  std::uint32_t before_ = 0;
};

}  // namespace wfpg
