// The progress bar.
#include "app/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace render {
namespace {

constexpr int columns = 40;
constexpr double terminal_interval = 0.1;  // seconds
constexpr double line_interval = 5.0;

}  // namespace

progress_bar::progress_bar() : terminal_(isatty(STDERR_FILENO) != 0) {}

void progress_bar::show(const render_progress& progress) {
  const bool complete = progress.fraction >= 1.0;
  const double interval = terminal_ ? terminal_interval : line_interval;
  const double since = last_shown_ < 0.0 ? progress.seconds : progress.seconds - last_shown_;
  if (since < interval && !(complete && terminal_)) return;
  last_shown_ = progress.seconds;
  const double done = progress.fraction - progress.begun;
  const double left = progress.seconds * (1.0 - progress.fraction) / std::max(1e-6, done);
  if (terminal_) {
    const auto full = static_cast<std::size_t>(columns * progress.fraction);
    const std::string bar = std::string(full, '#') + std::string(columns - full, '.');
    std::fprintf(stderr, "\r[%s] %3.0f%%  %d spp  %.1f s, %.1f s left   ", bar.c_str(),
                 100.0 * progress.fraction, progress.samples, progress.seconds, left);
    drawn_ = true;
  } else {
    std::fprintf(stderr, "%3.0f%%  %d spp  %.1f s, %.1f s left\n", 100.0 * progress.fraction,
                 progress.samples, progress.seconds, left);
  }
  std::fflush(stderr);
}

void progress_bar::finish() {
  if (drawn_) std::fputc('\n', stderr);
}

}  // namespace render
