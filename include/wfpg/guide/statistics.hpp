// What path_guider::statistics() and path_guider::memory() return, and the clock behind the former: bins,
// cones, dropped deposits, time by stage, bytes by part.
//
// Source: wfpg's own. Cost: the clock is read twice a stage and call, on the host. Memory: host structs; a
// guider holds one depth_statistics a depth on the device.
#pragma once

#include <wfpg/octree/statistics.hpp>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace wfpg {

/// Total time of one stage since the guider was made.
struct stage_time {
  const char* name;  ///< one of namespace `stage`, or a name of the guide
  double seconds;    ///< host time. On a device it covers launches, and kernels only where a call waits
};

/// Counts of one depth of the paths, summed over the guided samples so far. All 0 beyond guided_depths.
struct depth_statistics {
  std::uint64_t bins = 0;  ///< bins whose field was made; kept fields count when made or refreshed
  std::uint64_t rays = 0;  ///< rays that had a bin
  /// Active rays without a bin, which sample their BSDF alone. They lie outside every voxel, their normal is
  /// not of about unit length, or there was no room for a field.
  std::uint64_t unbinned = 0;
  std::uint64_t cones = 0;  ///< cones cast for the bins' fields
};

/// Counts of the kept fields' store since it was made.
struct kept_field_statistics {
  std::uint32_t capacity = 0;    ///< slots that fit kept.budget_bytes
  std::uint32_t live = 0;        ///< slots that hold a field now
  std::size_t bytes_a_slot = 0;  ///< bytes of the budget that one slot takes
  std::uint64_t allocated = 0;   ///< slots allocated
  std::uint64_t freed = 0;       ///< slots freed, to be allocated again
  std::uint64_t refreshed = 0;   ///< builds that cast a part of a field's cones
  /// Fields of the last sample that got no slot: none was free, or max_wave_cones was reached.
  std::uint32_t refused = 0;
};

/// Gain of guiding at equal numbers of samples, measured over pixels whose paths were recorded. Radiance
/// and variances are relative to what the cache expects of a pixel.
struct guiding_gain {
  /// Paths that are needed, for a variance to about a third.
  static constexpr std::uint64_t least_paths = 2048;
  /// Part of the guided paths' light that unguided paths have to find. Where they miss more, their variance
  /// is not known: it lies in the paths that they seldom find.
  static constexpr double least_light = 0.95;
  /// Difference of two paths up to which its square counts, relative to what the cache expects. Beyond, it
  /// counts linearly (Huber's loss), so that a few bright paths do not decide alone; and no more beyond 64.
  static constexpr double most_square = 8.0;
  /// That difference for the variance of typical paths; beyond 16 it counts no more. A few thousand paths
  /// measure it to a tenth, where bright paths leave the other one uncertain.
  static constexpr double most_typical = 2.0;

  std::uint64_t paths = 0;     ///< pixels with paths in all samples that were compared
  double unguided_mean = 0.0;  ///< mean radiance of paths that sample their BSDFs; a path counts 8 at most
  double guided_mean = 0.0;    ///< mean radiance of guided paths; a path counts 8 at most
  double unguided_variance = 0.0;  ///< variance of a path that samples its BSDFs, by Huber's loss
  double guided_variance = 0.0;    ///< variance of a guided path, by Huber's loss
  double typical_unguided = 0.0;   ///< unguided_variance without bright paths: of most_typical
  double typical_guided = 0.0;     ///< guided_variance without bright paths
  double unguided_vertices = 0.0;  ///< mean surfaces of a path that samples its BSDFs
  double guided_vertices = 0.0;    ///< mean surfaces of a guided path
  double typical_error = 0.0;      ///< standard error of the logarithm of the ratio of typical variances

  /// Whether value() means something: paths are enough, and unguided ones miss no light but by chance.
  bool is_known() const {
    if (paths < least_paths) return false;
    const double chance = std::sqrt((unguided_variance + guided_variance) / static_cast<double>(paths));
    return unguided_mean >= least_light * guided_mean - chance;
  }
  /// Variance of typical unguided paths, over the square of their mean. A few thousand paths
  /// measure it.
  double noise() const { return typical_unguided / std::fmax(unguided_mean * unguided_mean, 1.0e-30); }
  /// Unguided variance over guided variance, at most 1e6; 1 where both are 0.
  double value() const { return ratio(unguided_variance, guided_variance); }
  /// Ratio of the variances of typical paths at equal numbers of surfaces: guided paths may be longer, since
  /// fewer of them leave the scene. It decides whether guiding pays.
  double typical_value() const {
    const double gain = ratio(typical_unguided, typical_guided);
    return guided_vertices > 0.0 ? gain * unguided_vertices / guided_vertices : gain;
  }
  /// Mean with an earlier comparison, if it had paths: few bright paths decide less. The error
  /// is then an upper bound, since comparisons share unguided paths.
  guiding_gain mean_with(const guiding_gain& before) const {
    if (before.paths == 0) return *this;
    const auto mean = [](double a, double b) { return 0.5 * (a + b); };
    return {paths,
            mean(unguided_mean, before.unguided_mean),
            mean(guided_mean, before.guided_mean),
            mean(unguided_variance, before.unguided_variance),
            mean(guided_variance, before.guided_variance),
            mean(typical_unguided, before.typical_unguided),
            mean(typical_guided, before.typical_guided),
            mean(unguided_vertices, before.unguided_vertices),
            mean(guided_vertices, before.guided_vertices),
            mean(typical_error, before.typical_error)};
  }

 private:
  static double ratio(double unguided, double guided) {
    if (!(guided > 1.0e-6 * unguided)) return unguided > 0.0 ? 1.0e6 : 1.0;
    return unguided / guided;
  }
};

/// Returned by path_guider::statistics(). A guide that makes no fields leaves theirs at 0.
struct guider_statistics {
  std::uint32_t samples = 0;  ///< samples begun
  /// Samples begun after the first unguided_samples, where the guide can guide and did not rest. Of these,
  /// samples that are compared, or begin after light was forgotten, may be unguided.
  std::uint32_t guided_samples = 0;
  /// Samples begun in which the guide rested, since guiding gained too little, or noise was little.
  std::uint32_t rested_samples = 0;
  /// Mean of the comparisons of guided samples with an unguided one. Each weighs half of the one after it.
  guiding_gain gain;
  std::vector<depth_statistics> depths;  ///< one element a depth, max_depth of them; empty without fields
  kept_field_statistics kept;            ///< all 0 where fields are transient
  dropped_deposits deposits;             ///< deposits that the exitance cache dropped, by reason
  std::uint32_t dropped_vertices = 0;    ///< recorder calls that were dropped; see path_recorder_view
  std::uint32_t path_gaps = 0;  ///< recorded vertices after depths that were left out; a guide file has none
  build_report build;           ///< triangles that were left out of the octree, by reason
  std::vector<stage_time> seconds;  ///< times by stage, as stage_clock::report() orders them
};

/// Bytes of one part of a guider.
struct memory_part {
  const char* name;   ///< what the part holds, a string literal
  std::size_t bytes;  ///< allocated in the policy's memory
  bool persistent;    ///< true: kept across samples for guiding. False: needed only while a sample runs
};

/// Returned by path_guider::memory().
struct memory_report {
  std::vector<memory_part> parts;  ///< together, all that a guider holds in the policy's memory

  /// Bytes that guiding keeps across samples.
  std::size_t persistent() const { return sum(true); }
  /// Bytes that only a running sample needs. They stay allocated between samples.
  std::size_t transient() const { return sum(false); }

 private:
  std::size_t sum(bool persistent) const {
    std::size_t bytes = 0;
    for (const memory_part& part : parts)
      if (part.persistent == persistent) bytes += part.bytes;
    return bytes;
  }
};

/// Names of the stages that path_guider and wfpg's guides time. A guide may time stages of other names.
namespace stage {
inline constexpr const char* bin = "bin";        ///< assigning rays to bins
inline constexpr const char* fields = "fields";  ///< making and refreshing fields
/// Sampling directions. In waves that make no fields, also looking up fields.
inline constexpr const char* sample = "sample";
inline constexpr const char* record = "record";  ///< Guide::learn(): depositing recorded paths
inline constexpr const char* cache = "cache";    ///< Guide::update(): updating what was learnt
}  // namespace stage

/// Accumulates host time by stage. One thread uses it at a time.
class stage_clock {
 public:
  /// Times a stage during its lifetime. Time inside a nested scope counts for the nested stage alone.
  class scope {
   public:
    /// Starts timing `name` and pauses the stage around it. The string and the clock must outlive the scope,
    /// and the string the clock.
    scope(stage_clock& clock, const char* name) : clock_(clock), outer_(clock.begin(clock.find(name))) {}
    scope(const scope&) = delete;
    /// Stops timing and resumes the stage around it.
    ~scope() { clock_.begin(outer_); }

   private:
    stage_clock& clock_;
    std::size_t outer_;
  };

  /// Times a stage while the result lives: `const auto timed = clock.time(stage::bin);`. O(stages).
  scope time(const char* name) { return scope(*this, name); }

  /// Returns the time of each stage: those of namespace `stage` first, then others by first use. A stage that
  /// still runs lacks its time since the last change of stage.
  std::vector<stage_time> report() const { return {stages_.begin() + 1, stages_.end()}; }

 private:
  /// Seconds of a clock that never goes back.
  static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  /// Index of a stage, which is added if there is none of that name.
  std::size_t find(const char* name) {
    for (std::size_t i = 1; i < stages_.size(); ++i)
      if (std::strcmp(stages_[i].name, name) == 0) return i;
    stages_.push_back({name, 0.0});
    return stages_.size() - 1;
  }

  /// Adds the time since the last call to the current stage and makes `next` current. Returns the former.
  std::size_t begin(std::size_t next) {
    const double time = now();
    stages_[current_].seconds += time - since_;
    since_ = time;
    return std::exchange(current_, next);
  }

  std::vector<stage_time> stages_{
      {"", 0.0},          {stage::bin, 0.0}, {stage::fields, 0.0}, {stage::sample, 0.0}, {stage::record, 0.0},
      {stage::cache, 0.0}};  // the first: between stages
  std::size_t current_ = 0;
  double since_ = now();
};

}  // namespace wfpg
