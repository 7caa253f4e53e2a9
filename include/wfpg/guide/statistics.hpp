// What a guider tells of itself: bins, cones, dropped deposits, time by stage, memory by part.
#pragma once

#include <wfpg/octree/statistics.hpp>

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace wfpg {

/// Time of one stage, in all.
struct stage_time {
  const char* name;  ///< bin, fields, serve (where a wave makes no fields, finding them too), record or cache
  double seconds;    ///< of the host: on a device that of launching, unless a call waits
};

/// What guiding did for the waves of one depth: sums over the guided samples so far; 0 beyond guided_depths.
struct depth_statistics {
  std::uint64_t bins = 0;  ///< whose fields were made; of kept fields, made or refreshed
  std::uint64_t rays = 0;  ///< in bins
  /// Active rays outside every voxel, with a normal that is not of about unit length, or without room for a
  /// field: their BSDF alone.
  std::uint64_t unbinned = 0;
  std::uint64_t cones = 0;  ///< cast for them
};

/// What a field store tells of itself, since it was made.
struct kept_field_statistics {
  std::uint32_t capacity = 0;    ///< slots that the budget holds
  std::uint32_t live = 0;        ///< slots in use
  std::size_t bytes_a_slot = 0;  ///< of the budget
  std::uint64_t born = 0;        ///< slots taken
  std::uint64_t freed = 0;       ///< slots given back
  std::uint64_t refreshed = 0;   ///< builds that cast a part of a field's cones
  std::uint32_t refused = 0;  ///< births refused in the last sample, for want of a slot or by max_wave_cones
};

/// What path_guider::statistics() tells.
struct guider_statistics {
  std::uint32_t samples = 0;             ///< begun
  std::uint32_t guided_samples = 0;      ///< of them, with fields
  std::vector<depth_statistics> depths;  ///< a depth: what guiding did
  kept_field_statistics kept;            ///< zero where fields are transient
  dropped_deposits deposits;             ///< that the cache dropped
  std::uint32_t dropped_vertices = 0;    ///< recorder calls with a path, depth or order out of range
  build_report build;                    ///< what of the geometry was left out
  std::vector<stage_time> seconds;       ///< stages, in order
};

/// Bytes of one part of a guider.
struct memory_part {
  const char* name;   ///< what it holds
  std::size_t bytes;  ///< of the policy's memory
  bool persistent;    ///< kept across samples for guiding; else needed while a sample is in flight
};

/// What path_guider::memory() tells.
struct memory_report {
  std::vector<memory_part> parts;  ///< all that a guider holds

  /// Bytes kept across samples.
  std::size_t persistent() const { return sum(true); }
  /// Bytes needed while a sample is in flight.
  std::size_t transient() const { return sum(false); }

 private:
  std::size_t sum(bool persistent) const {
    std::size_t bytes = 0;
    for (const memory_part& part : parts)
      if (part.persistent == persistent) bytes += part.bytes;
    return bytes;
  }
};

/// The stages that a guider times.
enum class stage : std::uint32_t { bin, fields, serve, record, cache, count };

/// Accumulates the host's time by stage.
class stage_clock {
 public:
  /// Adds the time until it goes out of scope to a stage, and what a scope inside it takes to that one's
  /// alone.
  class scope {
   public:
    scope(stage_clock& clock, stage s) : clock_(clock), outer_(clock.go_on_with(s)) {}
    scope(const scope&) = delete;
    ~scope() { clock_.go_on_with(outer_); }

   private:
    stage_clock& clock_;
    stage outer_;
  };

  scope time(stage s) { return scope(*this, s); }

  std::vector<stage_time> report() const {
    static constexpr const char* names[] = {"bin", "fields", "serve", "record", "cache"};
    std::vector<stage_time> result;
    for (int i = 0; i < static_cast<int>(stage::count); ++i) result.push_back({names[i], seconds_[i]});
    return result;
  }

 private:
  static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  /// Ends the stage that is timed, and begins another; which one that was.
  stage go_on_with(stage next) {
    const double time = now();
    seconds_[static_cast<int>(current_)] += time - since_;
    since_ = time;
    return std::exchange(current_, next);
  }

  double seconds_[static_cast<int>(stage::count) + 1] = {};  // the last: between stages
  stage current_ = stage::count;
  double since_ = now();
};

}  // namespace wfpg
