// The vertices of the paths in flight, and the radiance that leaves each of them, by back-propagation (paper,
// Eq. 5): what arrives at a path's origin, divided by the throughput up to a vertex, left that vertex. Of
// large waves a part is recorded, another in each sample, which is wfpg's own: leaves need no more.
//
// Memory: 40 bytes a vertex, recorded paths × depths of them, and 4 a recorded path.
#pragma once

#include <wfpg/buffer.hpp>
#include <wfpg/detail/atomic.hpp>
#include <wfpg/detail/math.hpp>
#include <wfpg/exitance_cache.hpp>
#include <wfpg/octahedral_map.hpp>
#include <wfpg/types.hpp>

#include <thrust/fill.h>

namespace wfpg {

namespace detail {

/// Where a path's vertex is, in one store of a thread.
struct alignas(16) recorded_place {
  vec3 position;
  std::uint32_t outgoing;  // pack_direction
};

/// What the path carries there, and what it brought to its origin from there.
struct alignas(8) recorded_light {
  vec3 throughput;
  vec3 contribution;
};

/// Which paths are recorded: of each 2^shift runs of 32 paths one, drawn anew for each sample. Neighbours are
/// recorded together, since they share cache lines.
struct recorded_runs {
  static constexpr std::uint32_t run = 32;

  std::uint32_t shift = 0;
  std::uint32_t seed = 0;  // of the sample

  WFPG_HD std::size_t size(std::size_t paths) const {
    const std::size_t group = std::size_t(run) << shift;
    return shift == 0 ? paths : (paths + group - 1) / group * run;
  }
  /// Where a path, of less than 2^32, is among the recorded ones; false where it is not.
  WFPG_HD bool find(std::size_t path, std::uint32_t& place) const {
    place = static_cast<std::uint32_t>(path);
    if (shift == 0) return true;
    const std::uint32_t group = place / run >> shift, others = (1u << shift) - 1u;
    if ((place / run & others) != (hash32(seed, group) & others)) return false;
    place = group * run + place % run;
    return true;
  }
};

}  // namespace detail

/// What a kernel sees of the recorder. Calls for one path come from one thread at a time, vertices in order
/// of depth. A path or depth beyond the capacity, a vertex that was not recorded, or a direction that is not
/// finite is dropped and counted; what comes for paths that this sample does not record is not.
class path_recorder_view {
 public:
  WFPG_HD std::size_t paths() const { return paths_; }
  WFPG_HD std::uint32_t max_depth() const { return max_depth_; }

  /// Vertex `depth` (0: the first surface) of a path: where it is, the unit direction toward the vertex
  /// before it, and the path's throughput before this vertex's BSDF (1 at the camera's first hit), linear
  /// RGB.
  WFPG_HD void vertex(std::size_t path, std::uint32_t depth, vec3 position, vec3 outgoing,
                      vec3 throughput) const {
    std::uint32_t place;
    if (!find(path, place)) return;
    if (depth >= max_depth_ || depth != lengths_[place] || !detail::is_finite(outgoing)) return drop();
    const std::size_t slot = depth * recorded_ + place;
    places_[slot] = {position, pack_direction(outgoing)};
    light_[slot] = {throughput, vec3(0.0f)};
    lengths_[place] = depth + 1;
  }

  /// Radiance that vertex `depth` scatters toward the path's origin, as it arrives there: throughput, BSDF
  /// and MIS weight included, linear RGB. Next-event estimation reports with this.
  WFPG_HD void radiance(std::size_t path, std::uint32_t depth, vec3 contribution) const {
    std::uint32_t place;
    if (find(path, place)) add(place, depth, contribution);
  }

  /// Radiance of an emitter that the path hit as vertex `depth`, or of the environment that it left for after
  /// vertex `depth` - 1, as it arrives at the path's origin. Counts as scattered by the vertices before, and
  /// as leaving the emitter itself where emission is included and the emitter is a recorded vertex.
  WFPG_HD void emission(std::size_t path, std::uint32_t depth, vec3 contribution) const {
    std::uint32_t place;
    if (!find(path, place)) return;
    if (depth > lengths_[place]) return drop();
    if (include_emission_ && depth < lengths_[place])
      add(place, depth, contribution);
    else if (depth > 0)
      add(place, depth - 1, contribution);
  }

 private:
  template <class Exec>
  friend class path_recorder;
  friend struct deposit_paths;

  WFPG_HD void drop() const { detail::atomic_add(dropped_, 1); }
  /// Where a path is among the recorded ones; false where it is not, and dropped where there is no such path.
  WFPG_HD bool find(std::size_t path, std::uint32_t& place) const {
    if (path < paths_) return runs_.find(path, place);
    drop();
    return false;
  }
  /// `place`: of a path, among the recorded ones.
  WFPG_HD void add(std::uint32_t place, std::uint32_t depth, vec3 contribution) const {
    if (depth >= lengths_[place]) return drop();
    light_[depth * recorded_ + place].contribution += contribution;
  }

  std::size_t paths_ = 0;
  std::size_t recorded_ = 0;  // of them
  detail::recorded_runs runs_;
  std::uint32_t max_depth_ = 0;
  bool include_emission_ = true;
  std::uint32_t* lengths_ = nullptr;          // a recorded path: its vertices
  detail::recorded_place* places_ = nullptr;  // a vertex, all recorded paths of a depth together
  detail::recorded_light* light_ = nullptr;
  std::uint32_t* dropped_ = nullptr;
};

/// Deposits one path's vertices: L(k) = (sum of contributions at k and after) / throughput(k), Eq. 5.
struct deposit_paths {
  path_recorder_view paths;
  exitance_cache_view cache;
  WFPG_HD void operator()(std::size_t path) const {
    const std::uint32_t length = paths.lengths_[path];
    if (length == 0) return;
    const std::uint32_t first = cache.reserve(length);
    vec3 arriving(0.0f);
    for (std::uint32_t depth = length; depth-- > 0;) {
      const std::size_t slot = depth * paths.recorded_ + path;
      const detail::recorded_light light = paths.light_[slot];
      arriving += light.contribution;
      const vec3 t = light.throughput;
      const vec3 leaving{divided(arriving.x, t.x), divided(arriving.y, t.y), divided(arriving.z, t.z)};
      const detail::recorded_place place = paths.places_[slot];
      cache.write(first + depth, place.position, unpack_direction(place.outgoing), luminance(leaving));
    }
    for (std::uint32_t depth = 0; depth < length; ++depth) cache.count(first + depth);
  }

 private:
  /// Nothing leaves where nothing can arrive from; a throughput that is not finite stays so, and the cache
  /// drops it.
  WFPG_HD static float divided(float arriving, float throughput) {
    if (throughput > 0.0f) return arriving / throughput;
    return detail::is_finite(throughput) ? 0.0f : throughput;
  }
};

/// Owns the vertices of those that are recorded of `paths` paths of at most `max_depth` vertices.
template <class Exec>
class path_recorder {
 public:
  path_recorder() = default;
  /// `include_emission`: emitters' own radiance is cached too, so that guiding looks for them; false where
  /// next-event estimation does that. Of 2^`share_shift` paths one is recorded. Throws out_of_memory.
  path_recorder(const Exec& exec, std::size_t paths, std::uint32_t max_depth, bool include_emission,
                std::uint32_t share_shift = 0)
      : lengths_(exec, detail::recorded_runs{share_shift}.size(paths)),
        places_(exec, lengths_.size() * max_depth),
        light_(exec, lengths_.size() * max_depth),
        dropped_(exec, 1) {
    view_.paths_ = paths;
    view_.recorded_ = lengths_.size();
    view_.runs_.shift = share_shift;
    view_.max_depth_ = max_depth;
    view_.include_emission_ = include_emission;
    view_.lengths_ = lengths_.data();
    view_.places_ = places_.data();
    view_.light_ = light_.data();
    view_.dropped_ = dropped_.data();
    ::thrust::fill_n(exec.thrust(), dropped_.data(), 1, 0u);
    clear(exec);
  }

  path_recorder_view view() const { return view_; }
  std::size_t bytes() const { return lengths_.bytes() + places_.bytes() + light_.bytes() + dropped_.bytes(); }

  /// Paths that one sample records, at most.
  std::size_t recorded() const { return view_.recorded_; }

  /// Forgets all paths. Views from then on record the paths of a sample of this seed.
  void begin_sample(const Exec& exec, std::uint32_t seed) {
    view_.runs_.seed = seed;
    clear(exec);
  }
  /// Forgets all paths.
  void clear(const Exec& exec) { exec.fill_bytes(lengths_.data(), 0, lengths_.bytes()); }

  /// Queues the radiance of every recorded vertex in the cache and forgets the paths. O(paths · depth).
  void deposit(const Exec& exec, const exitance_cache_view& cache) {
    exec.for_each(view_.recorded_, deposit_paths{view_, cache});
    clear(exec);
  }

  /// Calls dropped for a path, depth or order out of range, in all; waits for the work before it.
  std::uint32_t dropped(const Exec& exec) const { return read_element(exec, dropped_.data()); }

 private:
  buffer<std::uint32_t, Exec> lengths_;
  buffer<detail::recorded_place, Exec> places_;
  buffer<detail::recorded_light, Exec> light_;
  buffer<std::uint32_t, Exec> dropped_;
  path_recorder_view view_;
};

}  // namespace wfpg
