// Records the vertices of the paths in flight and the radiance that leaves each of them. The renderer's
// kernels write them during a sample; the guide reads them at its end.
//
// Radiance follows by back-propagation. What arrives at a path's origin, divided by the throughput up to a
// vertex, left that vertex. Large waves are recorded in part: a random part of the paths, in some of the
// samples. Leaves need no more values.
//
// Source: Yalçıner & Akyüz, "Path Guiding for Wavefront Path Tracing", 2024, Eq. 5. Recording in part, and
// recording directions so that kept fields learn from paths, are wfpg's own.
// Cost: a call writes at most 52 bytes, and uses an atomic only where it is dropped.
// Memory: 40 bytes a vertex, 48 with directions, and 4 a recorded path. A recorded path has room for
// max_depth vertices.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/guide/recorded_runs.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

#include <thrust/fill.h>

namespace wfpg {

namespace detail {

/// Position of a vertex. 16 bytes, so that a thread writes it with one store.
struct alignas(16) recorded_place {
  vec3 position;           ///< world space
  std::uint32_t outgoing;  ///< pack_direction() of the direction toward the previous vertex
};

/// Light of a vertex, linear RGB. 24 bytes.
struct alignas(8) recorded_light {
  vec3 throughput;    ///< of the path, before this vertex scatters
  vec3 contribution;  ///< sum of what this vertex itself brought to the path's origin
};

/// Sampled direction at a vertex. 8 bytes, stored only where directions are recorded.
struct alignas(8) recorded_direction {
  std::uint32_t field;      ///< sampled_direction::field of scatter(), or no_field
  std::uint32_t direction;  ///< pack_direction() of it; 0 where scatter() was not called
};

}  // namespace detail

/// View of the recorder for kernels. Trivially copyable. A default-constructed view ignores all calls.
/// Precondition: calls for one path come from one thread at a time, with vertices in order of depth. A call
/// is dropped and counted in these cases:
/// - The path or the depth is beyond the capacity.
/// - The vertex is not recorded, or comes out of order.
/// - The direction is zero or not finite.
///
/// Calls for paths that this sample does not record are ignored. They do not count as dropped. O(1) a call.
class path_recorder_view {
 public:
  /// Capacity in paths: valid path indices are [0, paths()), recorded or not.
  WFPG_HD std::size_t paths() const { return paths_; }
  /// Capacity in vertices of one path: valid depths are [0, max_depth()).
  WFPG_HD std::uint32_t max_depth() const { return max_depth_; }

  /// Records vertex `depth` of a path; 0 is the first surface. `position` is in world space. `outgoing` is
  /// the unit direction toward the previous vertex. `throughput` is the path's before this vertex's BSDF,
  /// linear RGB: 1 at the camera's first hit.
  WFPG_HD void vertex(std::size_t path, std::uint32_t depth, vec3 position, vec3 outgoing,
                      vec3 throughput) const {
    std::uint32_t place;
    if (!find(path, place)) return;
    if (depth >= max_depth_ || depth != lengths_[place] || !is_direction(outgoing)) return drop();
    const std::size_t slot = depth * recorded_ + place;
    places_[slot] = {position, pack_direction(outgoing)};
    light_[slot] = {throughput, vec3(0.0f)};
    if (learns()) directions_[slot] = {no_field, 0};
    lengths_[place] = depth + 1;
  }

  /// Records the direction in which the path leaves vertex `depth`, which must be its last so far. The guide
  /// learns from it what the direction finds. Ignored where directions are not recorded, and for technique
  /// `none`.
  WFPG_HD void scatter(std::size_t path, std::uint32_t depth, const sampled_direction& drawn) const {
    std::uint32_t place;
    if (!learns() || drawn.technique == sampling_technique::none || !find(path, place)) return;
    if (depth >= max_depth_ || depth + 1 != lengths_[place] || !is_direction(drawn.direction)) return drop();
    directions_[depth * recorded_ + place] = {drawn.field, pack_direction(drawn.direction)};
  }

  /// Records that the path left the scene: the environment becomes its vertex `depth`, the last one. Call it
  /// for dark environments too, so that guides learn that no light comes from there. `throughput` is the
  /// path's as it leaves the scene. Report the environment's radiance with emission(). Ignored where
  /// directions are not recorded, and at the depth max_depth().
  WFPG_HD void escape(std::size_t path, std::uint32_t depth, vec3 throughput) const {
    std::uint32_t place;
    if (!learns() || depth == 0 || !find(path, place)) return;
    if (depth != lengths_[place]) return drop();
    if (depth >= max_depth_) return;
    light_[depth * recorded_ + place] = {throughput, vec3(0.0f)};
    lengths_[place] = (depth + 1) | escaped;
  }

  /// Adds radiance that vertex `depth` scatters toward the path's origin. Next-event estimation reports its
  /// result with it. `contribution` is the radiance as it arrives at the origin, linear RGB: it includes
  /// throughput, BSDF and MIS weight. May be called several times a vertex.
  WFPG_HD void radiance(std::size_t path, std::uint32_t depth, vec3 contribution) const {
    std::uint32_t place;
    if (find(path, place)) add(place, depth, contribution);
  }

  /// Adds the radiance of an emitter that the path hit as vertex `depth`. Also that of the environment, where
  /// the path left the scene after vertex `depth` - 1. `contribution` is the radiance as it arrives at the
  /// path's origin, linear RGB. It counts as scattered by the vertices before. It counts as leaving the
  /// emitter itself too, if sampling_options::include_emission is set and the emitter is a recorded vertex.
  WFPG_HD void emission(std::size_t path, std::uint32_t depth, vec3 contribution) const {
    std::uint32_t place;
    if (!find(path, place)) return;
    const std::uint32_t length = lengths_[place] & ~escaped;
    if (depth > length) return drop();
    if (include_emission_ && depth < length)
      add(place, depth, contribution);
    else if (depth > 0)
      add(place, depth - 1, contribution);
  }

 private:
  template <class Exec>
  friend class path_recorder;
  friend class recorded_path;

  // Flag in a path's length: its last vertex is the environment.
  static constexpr std::uint32_t escaped = 0x80000000u;

  /// Whether directions are recorded.
  WFPG_HD bool learns() const { return directions_ != nullptr; }
  /// Whether pack_direction() can store it.
  WFPG_HD static bool is_direction(vec3 direction) { return is_finite(direction) && direction != vec3(0.0f); }
  /// Counts a dropped call; a default view has no counter.
  WFPG_HD void drop() const {
    if (dropped_) atomic_add(dropped_, 1);
  }
  /// Index of a path among the recorded ones. False where it is not recorded; counts a drop where it is not
  /// in [0, paths()).
  WFPG_HD bool find(std::size_t path, std::uint32_t& place) const {
    if (path < paths_) return recorded_ > 0 && runs_.find(path, place);
    drop();
    return false;
  }
  /// Adds to a recorded surface or environment. `place` is what find() wrote. Needs no atomic, since a path's
  /// calls come from one thread.
  WFPG_HD void add(std::uint32_t place, std::uint32_t depth, vec3 contribution) const {
    if (depth >= (lengths_[place] & ~escaped)) return drop();
    light_[depth * recorded_ + place].contribution += contribution;
  }

  std::size_t paths_ = 0;
  std::size_t recorded_ = 0;  // 0 in a sample that records nothing
  detail::recorded_runs runs_;
  std::uint32_t max_depth_ = 0;
  bool include_emission_ = true;
  // A length for each recorded path: its number of vertices, with the flag `escaped`.
  std::uint32_t* lengths_ = nullptr;
  // Vertices, at depth * recorded_ + place: neighbouring threads write neighbouring elements.
  detail::recorded_place* places_ = nullptr;
  detail::recorded_light* light_ = nullptr;
  detail::recorded_direction* directions_ = nullptr;  // null where directions are not recorded
  std::uint32_t* dropped_ = nullptr;
};

/// Stands in for path_recorder_view where a guide reads no paths. An empty class with empty members, so that
/// kernels compile for both and the compiler removes the calls.
struct no_path_recorder {
  /// Returns 0: there is room for no path.
  WFPG_HD std::size_t paths() const { return 0; }
  /// Returns 0: a path has no vertices.
  WFPG_HD std::uint32_t max_depth() const { return 0; }
  /// Does nothing; see path_recorder_view::vertex().
  WFPG_HD void vertex(std::size_t, std::uint32_t, vec3, vec3, vec3) const {}
  /// Does nothing; see path_recorder_view::scatter().
  WFPG_HD void scatter(std::size_t, std::uint32_t, const sampled_direction&) const {}
  /// Does nothing; see path_recorder_view::escape().
  WFPG_HD void escape(std::size_t, std::uint32_t, vec3) const {}
  /// Does nothing; see path_recorder_view::radiance().
  WFPG_HD void radiance(std::size_t, std::uint32_t, vec3) const {}
  /// Does nothing; see path_recorder_view::emission().
  WFPG_HD void emission(std::size_t, std::uint32_t, vec3) const {}

  /// Returns a default view, which ignores all calls, for kernels that take that type.
  WFPG_HD operator path_recorder_view() const { return {}; }
};

/// One recorded path, for guides to read. Its vertices are the surfaces that it met, in order. The
/// environment is the last vertex if escape() recorded it. Valid until the recorder's begin_sample() or
/// clear(). Precondition of members with a `depth`: it is below vertices(), or surfaces() where they say
/// "surface".
class recorded_path {
 public:
  /// Reads path `place` of the recorded ones, in [0, path_recorder::recorded()).
  WFPG_HD recorded_path(const path_recorder_view& paths, std::size_t place)
      : paths_(paths),
        place_(place),
        surfaces_(paths.lengths_[place] & ~path_recorder_view::escaped),
        vertices_(surfaces_) {
    if (paths.lengths_[place] & path_recorder_view::escaped) --surfaces_;
  }

  /// Number of vertices, including the environment; 0 for a path that recorded none.
  WFPG_HD std::uint32_t vertices() const { return vertices_; }
  /// Number of vertices that are surfaces: depths [0, surfaces()).
  WFPG_HD std::uint32_t surfaces() const { return surfaces_; }

  /// Position of a surface, world space. It is what the renderer recorded, so it may be not finite.
  WFPG_HD vec3 position(std::uint32_t depth) const { return paths_.places_[slot(depth)].position; }
  /// Unit direction from a surface toward the previous vertex, as pack_direction() rounds it.
  WFPG_HD vec3 outgoing(std::uint32_t depth) const {
    return unpack_direction(paths_.places_[slot(depth)].outgoing);
  }
  /// Throughput of the path before a vertex scatters, linear RGB.
  WFPG_HD vec3 throughput(std::uint32_t depth) const { return paths_.light_[slot(depth)].throughput; }
  /// What a vertex itself brought to the path's origin, linear RGB: its emission, and the light that
  /// next-event estimation sampled there. Sum the vertices from `depth` on for all that arrives from there.
  WFPG_HD vec3 contribution(std::uint32_t depth) const { return paths_.light_[slot(depth)].contribution; }
  /// sampled_direction::field of the direction that scatter() recorded, or no_field. Precondition: the
  /// recorder records directions.
  WFPG_HD std::uint32_t field(std::uint32_t depth) const { return paths_.directions_[slot(depth)].field; }
  /// Writes the unit direction in which the path left a surface. It is the direction toward the next surface,
  /// or else that of scatter(). False where neither is known. Precondition: the recorder records directions.
  WFPG_HD bool has_direction(std::uint32_t depth, vec3& direction) const {
    if (depth + 1 < surfaces_) {
      direction = -outgoing(depth + 1);
      return true;
    }
    direction = this->direction(depth);
    return paths_.directions_[slot(depth)].direction != 0;
  }
  /// Unit direction that scatter() recorded. Precondition: directions are recorded, and scatter() was called.
  WFPG_HD vec3 direction(std::uint32_t depth) const {
    return unpack_direction(paths_.directions_[slot(depth)].direction);
  }

 private:
  /// Index of a vertex in the recorder's arrays.
  WFPG_HD std::size_t slot(std::uint32_t depth) const { return depth * paths_.recorded_ + place_; }

  path_recorder_view paths_;
  std::size_t place_;
  // These differ by one where the last vertex is the environment.
  std::uint32_t surfaces_, vertices_;
};

/// Returns the luminance that left a vertex: `arriving` divided by `throughput`, both linear RGB (Eq. 5).
/// `arriving` is what came to the path's origin, `throughput` the path's up to the vertex. A channel without
/// throughput counts as 0, since nothing can arrive through it. A throughput that is not finite gives a
/// result that is not finite, for the caller to drop.
WFPG_HD inline float leaving_luminance(vec3 arriving, vec3 throughput) {
  // A NaN in `t` fails t > 0, too, and is handed on.
  const auto divided = [](float a, float t) {
    if (t > 0.0f) return a / t;
    return is_finite(t) ? 0.0f : t;
  };
  return luminance({divided(arriving.x, throughput.x), divided(arriving.y, throughput.y),
                    divided(arriving.z, throughput.z)});
}

/// Owns the memory of recorded paths. Movable, not copyable; the policy's memory must outlive it.
template <class Exec>
class path_recorder {
 public:
  /// A recorder of no paths. It may be assigned to.
  path_recorder() = default;
  /// A recorder for samples of `paths` paths with at most `max_depth` vertices each. It records one path in
  /// 2^`fraction_shift`, and directions too where `fields_learn` is set. `include_emission` counts emitters'
  /// own radiance as leaving them, so that guiding looks for emitters. Unset it where next-event estimation
  /// finds them. Precondition: `paths` is below 2^32 - 1. Throws out_of_memory.
  path_recorder(const Exec& exec, std::size_t paths, std::uint32_t max_depth, bool include_emission,
                std::uint32_t fraction_shift = 0, bool fields_learn = false)
      : lengths_(exec, detail::recorded_runs{fraction_shift}.size(paths)),
        places_(exec, lengths_.size() * max_depth),
        light_(exec, lengths_.size() * max_depth),
        directions_(exec, fields_learn ? lengths_.size() * max_depth : 0),
        dropped_(exec, 1) {
    // Everything is recorded until the first begin_sample().
    view_.paths_ = paths;
    view_.recorded_ = lengths_.size();
    view_.runs_.shift = fraction_shift;
    view_.max_depth_ = max_depth;
    view_.include_emission_ = include_emission;
    view_.lengths_ = lengths_.data();
    view_.places_ = places_.data();
    view_.light_ = light_.data();
    view_.directions_ = directions_.data();
    view_.dropped_ = dropped_.data();
    ::thrust::fill_n(exec.thrust(), dropped_.data(), 1, 0u);
    clear(exec);
  }

  /// View for kernels, of the current sample: valid until begin_sample().
  path_recorder_view view() const { return view_; }
  /// Bytes allocated, in the policy's memory.
  std::size_t bytes() const {
    return lengths_.bytes() + places_.bytes() + light_.bytes() + directions_.bytes() + dropped_.bytes();
  }

  /// Whether scatter() and escape() are recorded.
  bool records_directions() const { return view_.learns(); }
  /// Size of the recorded part of this sample: recorded_path takes places in [0, recorded()). 0 in a sample
  /// that is not recorded. Some of these paths may have no vertices.
  std::size_t recorded() const { return view_.recorded_; }

  /// Begins a sample: clears all paths and chooses by `seed` which ones are recorded, or none if `records` is
  /// false. Views made before are invalid. O(recorded()).
  void begin_sample(const Exec& exec, std::uint32_t seed, bool records = true) {
    view_.runs_.seed = seed;
    view_.recorded_ = records ? lengths_.size() : 0;
    clear(exec);
  }
  /// Clears the recorded paths: each has no vertices then. Writes 4 bytes a path.
  void clear(const Exec& exec) {
    exec.fill_bytes(lengths_.data(), 0, view_.recorded_ * sizeof(std::uint32_t));
  }

  /// Number of dropped calls since construction, modulo 2^32; path_recorder_view lists the cases. Waits for
  /// the work before it.
  std::uint32_t dropped(const Exec& exec) const { return read_element(exec, dropped_.data()); }

 private:
  friend struct detail::state_access;

  // What the view's pointers of these names point to, and the view itself.
  buffer<std::uint32_t, Exec> lengths_;
  buffer<detail::recorded_place, Exec> places_;
  buffer<detail::recorded_light, Exec> light_;
  buffer<detail::recorded_direction, Exec> directions_;
  buffer<std::uint32_t, Exec> dropped_;
  path_recorder_view view_;
};

}  // namespace wfpg
