// Recorded paths into the cache and into fields that learn, by back-propagation (paper, Eq. 5).
#pragma once

#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guides/octree/learnt_radiance.hpp>
#include <wfpg/octree/exitance_cache.hpp>

namespace wfpg {

/// Deposits one path's vertices: L(k) = (sum of contributions at k and after) / throughput(k), Eq. 5. It is
/// what leaves a vertex, for the cache, and what arrives along the direction before it, for kept fields.
struct deposit_path {
  path_recorder_view paths;     ///< what was recorded
  exitance_cache_view cache;    ///< where it goes
  learnt_radiance_view learnt;  ///< where it goes too, unless empty

  /// Path `place` of those recorded.
  WFPG_HD void operator()(std::size_t place) const {
    const recorded_path path(paths, place);
    const std::uint32_t vertices = path.vertices(), surfaces = path.surfaces();
    if (surfaces == 0) return;
    const std::uint32_t first = cache.reserve(surfaces);
    const std::uint32_t found = learnt.empty() || vertices < 2 ? 0 : vertices - 1;
    const std::uint32_t first_found = found > 0 ? learnt.reserve(found) : 0;
    vec3 arriving(0.0f);
    for (std::uint32_t depth = vertices; depth-- > 0;) {
      arriving += path.contribution(depth);
      const float leaving = leaving_luminance(arriving, path.throughput(depth));
      if (depth < surfaces) cache.write(first + depth, path.position(depth), path.outgoing(depth), leaving);
      if (found > 0 && depth > 0)
        learnt.write(first_found + depth - 1, path.field(depth - 1), path.direction(depth - 1), leaving);
    }
    for (std::uint32_t depth = 0; depth < surfaces; ++depth) cache.count(first + depth);
    for (std::uint32_t i = 0; i < found; ++i) learnt.count(first_found + i);
  }
};

/// Queues the radiance of every recorded vertex in the cache, tells fields what their directions found unless
/// `learnt` is empty, and forgets the paths. O(paths * depth).
template <class Exec>
void deposit_paths(const Exec& exec, path_recorder<Exec>& recorder, const exitance_cache_view& cache,
                   const learnt_radiance_view& learnt = {}) {
  exec.for_each(
      recorder.recorded(),
      deposit_path{recorder.view(), cache, recorder.records_directions() ? learnt : learnt_radiance_view()});
  recorder.clear(exec);
}

}  // namespace wfpg
