// Deposits recorded paths into the exitance cache, and into fields that learn, by back-propagation. Each
// vertex gets the light that the rest of its path brought to it.
//
// Source: Yalciner and Akyuz (2024), Eq. 5. Learning fields are wfpg's own.
//
// Depths that the host left out are skipped: what leaves them is not known.
//
// Fractions of guided directions learn from the same light, over the throughput before the direction was
// sampled. That has BSDF, cosine and density in it.
//
// Cost: O(paths * depth), one thread a path. Memory: none beside the queues of the cache and of the fields.
#pragma once

#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/recorded_path.hpp>
#include <wfpg/guides/octree/learnt_radiance.hpp>
#include <wfpg/octree/exitance_cache.hpp>

namespace wfpg {

/// Kernel: deposits one path's vertices. L(k) = (sum of contributions at k and after) / throughput(k), Eq. 5.
/// L(k) is the radiance that leaves vertex k, for the cache. It also arrives along the direction that led
/// there, for kept fields.
struct deposit_path {
  path_recorder_view paths;     ///< recorded paths
  exitance_cache_view cache;    ///< receives what leaves each surface
  learnt_radiance_view learnt;  ///< receives what arrives along directions; may be empty

  /// Deposits path `place` of those recorded. O(vertices). It begins at the last vertex, since what leaves a
  /// surface is the sum of all that arrives after it.
  WFPG_HD WFPG_FLATTEN void operator()(std::size_t place) const {
    const recorded_path path(paths, place);
    const std::uint32_t vertices = path.vertices(), surfaces = path.surfaces();
    if (surfaces == 0) return;
    const std::uint32_t known = path.known_surfaces(), first = cache.reserve(known);
    // Fields learn along the directions between vertices, of which there is one fewer.
    const std::uint32_t found = learnt.empty() ? 0 : vertices - 1;
    const std::uint32_t first_found = found > 0 ? learnt.reserve(found) : 0;
    vec3 arriving(0.0f);
    std::uint32_t entry = first + known;
    // From the last vertex back: `arriving` sums the contributions at this vertex and after.
    for (std::uint32_t depth = vertices; depth-- > 0;) {
      arriving += path.contribution(depth);
      const float leaving = leaving_luminance(arriving, path.throughput(depth));
      const bool gap = depth < surfaces && path.is_gap(depth);
      if (depth < surfaces && !gap) cache.write(--entry, path.position(depth), path.outgoing(depth), leaving);
      // Radiance that leaves a gap is not known, so the direction toward it teaches nothing.
      if (found > 0 && depth > 0)
        learnt.write(first_found + depth - 1, gap ? no_field : path.field(depth - 1),
                     path.direction(depth - 1), leaving);
    }
    if (found > 0 && learnt.learns_fractions()) weigh(path, vertices);
  }

 private:
  /// Fields learn their fractions of guided directions from what each direction brought, over its density.
  /// From the last vertex back, as above. The light is in a cache by now, and the atomics of learning would
  /// order the look-ups above.
  WFPG_HD void weigh(const recorded_path& path, std::uint32_t vertices) const {
    vec3 brought(0.0f);
    for (std::uint32_t depth = vertices; depth-- > 1;) {
      brought += path.contribution(depth);
      // Of a direction to a gap it is not known what it found. Delta lobes have no field.
      const std::uint32_t field = path.field(depth - 1);
      if (field == no_field || (depth < path.surfaces() && path.is_gap(depth))) continue;
      learnt.weigh(field, leaving_luminance(brought, path.throughput(depth - 1)), path.share(depth - 1));
    }
  }
};

/// Deposits every recorded path, then clears the recorder. Fields learn where `learnt` is not empty and the
/// recorder has directions. Whatever exceeds the queues' capacity is dropped.
///
/// Depths that the host left out have no entry. The cache and the fields change when they are updated. On a
/// GPU the call returns before its kernel has run.
template <class Exec>
void deposit_paths(const Exec& exec, path_recorder<Exec>& recorder, const exitance_cache_view& cache,
                   const learnt_radiance_view& learnt = {}) {
  exec.for_each(
      recorder.recorded(),
      deposit_path{recorder.view(), cache, recorder.records_directions() ? learnt : learnt_radiance_view()});
  recorder.clear(exec);
}

}  // namespace wfpg
