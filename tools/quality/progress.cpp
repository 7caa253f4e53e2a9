// Estimates times from renderings of the same scene and method, or from all.
#include "progress.hpp"

#include <cmath>
#include <cstdio>
#include <ostream>

namespace quality {
namespace {

double work_of(const render::render_options& options) {
  return options.seconds > 0.0 ? 0.0 : double(options.spp) * options.width * options.height;
}

}  // namespace

std::string title_of_seconds(double seconds) {
  char text[32];
  if (seconds < 90.0)
    std::snprintf(text, sizeof text, "%.0f s", std::ceil(seconds));
  else if (seconds < 5400.0)
    std::snprintf(text, sizeof text, "%.0f min", seconds / 60.0);
  else
    std::snprintf(text, sizeof text, "%.1f h", seconds / 3600.0);
  return text;
}

run_progress::run_progress(const std::vector<planned_run>& planned, const run_cache& cache, std::ostream& log)
    : count_(planned.size()), log_(log) {
  for (const planned_run& run : planned) {
    const bool is_cached = cache.contains(run.key);
    was_cached_[run.key.hash()] = is_cached;
    if (is_cached) continue;
    rates_[run.rate].work += work_of(run.options);
    rates_[run.rate].seconds += run.options.seconds;
  }
}

std::optional<double> run_progress::seconds_left() const {
  double done_work = 0.0, done_seconds = 0.0, left = 0.0;
  for (const auto& [name, rate] : rates_) {
    done_work += rate.done_work;
    done_seconds += rate.done_seconds;
  }
  for (const auto& [name, rate] : rates_) {
    left += rate.seconds;
    if (rate.work <= 0.0) continue;
    if (done_work <= 0.0) return std::nullopt;
    left +=
        rate.work * (rate.done_work > 0.0 ? rate.done_seconds / rate.done_work : done_seconds / done_work);
  }
  return left;
}

void run_progress::begin(const planned_run& run) {
  ++begun_;
  log_ << '[' << begun_ << '/' << count_ << "] " << run.title << std::flush;
}

void run_progress::found(const planned_run& run) {
  log_ << ": in the cache" << std::endl;
  if (!was_cached_[run.key.hash()]) take(run);
}

void run_progress::done(const planned_run& run, double seconds) {
  if (!was_cached_[run.key.hash()]) take(run);
  remaining& rate = rates_[run.rate];
  rate.done_work += work_of(run.options);
  if (work_of(run.options) > 0.0) rate.done_seconds += seconds;
  char text[32];
  std::snprintf(text, sizeof text, ": %.1f s; ", seconds);
  log_ << text << count_ - begun_ << " left";
  if (const std::optional<double> left = seconds_left()) log_ << ", about " << title_of_seconds(*left);
  log_ << std::endl;
}

void run_progress::take(const planned_run& run) {
  rates_[run.rate].work -= work_of(run.options);
  rates_[run.rate].seconds -= run.options.seconds;
}

}  // namespace quality
