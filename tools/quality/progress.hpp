// How many renderings are left, and about how long they take.
#pragma once

#include "cache.hpp"
#include "runs.hpp"

#include <iosfwd>
#include <map>
#include <optional>
#include <vector>

namespace quality {

/// "45 s", "3 min", "2.5 h".
std::string title_of_seconds(double seconds);

/// Counts planned renderings down in the order of work. Writes a line to `log` for each.
class run_progress {
 public:
  /// Renderings in the cache take no time. `log` must outlive this.
  run_progress(const std::vector<planned_run>& planned, const run_cache& cache, std::ostream& log);

  /// Call it when the next rendering begins.
  void begin(const planned_run& run);
  /// Call it if the rendering was in the cache.
  void found(const planned_run& run);
  /// Call it when the rendering has taken `seconds`.
  void done(const planned_run& run, double seconds);

 private:
  /// Remaining work of one rate.
  struct remaining {
    double work = 0.0;     ///< samples of pixels
    double seconds = 0.0;  ///< of renderings with a budget in seconds
    double done_work = 0.0, done_seconds = 0.0;
  };

  std::optional<double> seconds_left() const;
  void take(const planned_run& run);

  std::map<std::string, remaining> rates_;
  std::map<std::string, bool> was_cached_;
  std::size_t count_, begun_ = 0;
  std::ostream& log_;
};

}  // namespace quality
