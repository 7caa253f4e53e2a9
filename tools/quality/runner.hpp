// Takes renderings from the cache, or renders and caches them.
#pragma once

#include "cache.hpp"
#include "progress.hpp"
#include "runs.hpp"

#include <chrono>

namespace quality {

class runner {
 public:
  /// Both must outlive the runner.
  runner(const run_cache& cache, run_progress& progress) : cache_(cache), progress_(progress) {}

  /// Returns `read` of the run's cache entry. If there is none, stores the result of `make` first.
  template <class Make, class Read>
  auto get(const planned_run& run, const Make& make, const Read& read)
      -> decltype(read(std::declval<cache_entry&>())) {
    auto kept = cache_.find(run.key, read);
    progress_.begin(run);
    if (kept) {
      progress_.found(run);
      return std::move(*kept);
    }
    const auto start = std::chrono::steady_clock::now();
    cache_entry entry = make();
    cache_.store(run.key, entry);
    progress_.done(run, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    return read(entry);
  }

  const run_cache& cache() const { return cache_; }

 private:
  const run_cache& cache_;
  run_progress& progress_;
};

/// The picture of a cache entry. Throws if the entry lacks it or has another size.
inline render::image& picture_of(cache_entry& entry, const render::render_options& options) {
  if (!entry.picture || entry.picture->width != options.width || entry.picture->height != options.height)
    throw std::runtime_error("its picture is missing or of another size");
  return *entry.picture;
}

}  // namespace quality
