// The vertices of the paths in flight, and the radiance that leaves each of them, by back-propagation (paper,
// Eq. 5): what arrives at a path's origin, divided by the throughput up to a vertex, left that vertex. Of
// large waves a part is recorded, another in each sample, and not in all samples, which is wfpg's own: leaves
// need no more. So is that kept fields learn from paths what their directions found.
//
// Memory: 40 bytes a vertex, 48 where fields learn, recorded paths × depths of them, and 4 a recorded path.
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

/// Where the path goes from there, and the kept field that knew.
struct alignas(8) recorded_direction {
  std::uint32_t field;
  std::uint32_t direction;  // pack_direction
};

}  // namespace detail

/// What a kernel sees of the recorder; of a default one nothing, and all is forgotten. Calls for one path
/// come from one thread at a time, vertices in order of depth. A path or depth beyond the capacity, a vertex
/// that was not recorded, or a direction that is zero or not finite is dropped and counted; what comes for
/// paths that this sample does not record is not.
class path_recorder_view {
 public:
  /// Paths of a sample, recorded or not.
  WFPG_HD std::size_t paths() const { return paths_; }
  /// Vertices that a path can have.
  WFPG_HD std::uint32_t max_depth() const { return max_depth_; }

  /// Vertex `depth` (0: the first surface) of a path: where it is, the unit direction toward the vertex
  /// before it, and the path's throughput before this vertex's BSDF (1 at the camera's first hit), linear
  /// RGB.
  WFPG_HD void vertex(std::size_t path, std::uint32_t depth, vec3 position, vec3 outgoing,
                      vec3 throughput) const {
    std::uint32_t place;
    if (!find(path, place)) return;
    if (depth >= max_depth_ || depth != lengths_[place] || !leads_somewhere(outgoing)) return drop();
    const std::size_t slot = depth * recorded_ + place;
    places_[slot] = {position, pack_direction(outgoing)};
    light_[slot] = {throughput, vec3(0.0f)};
    if (learns()) directions_[slot] = {no_field, 0};
    lengths_[place] = depth + 1;
  }

  /// How the path goes on from vertex `depth`, its last so far, so that the guide learns what the direction
  /// finds. Not needed, and does nothing, where fields do not learn.
  WFPG_HD void scatter(std::size_t path, std::uint32_t depth, const sampled_direction& drawn) const {
    std::uint32_t place;
    if (!learns() || drawn.technique == sampling_technique::none || !find(path, place)) return;
    if (depth >= max_depth_ || depth + 1 != lengths_[place] || !leads_somewhere(drawn.direction))
      return drop();
    directions_[depth * recorded_ + place] = {drawn.field, pack_direction(drawn.direction)};
  }

  /// The environment as vertex `depth`, with the throughput that the path leaves the scene with; also where
  /// it is dark. What it sends is then its emission(). Not needed where fields do not learn.
  WFPG_HD void escape(std::size_t path, std::uint32_t depth, vec3 throughput) const {
    std::uint32_t place;
    if (!learns() || depth == 0 || !find(path, place)) return;
    if (depth != lengths_[place]) return drop();
    if (depth >= max_depth_) return;
    light_[depth * recorded_ + place] = {throughput, vec3(0.0f)};
    lengths_[place] = (depth + 1) | escaped;
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

  static constexpr std::uint32_t escaped = 0x80000000u;  // of a length: its last vertex is the environment

  WFPG_HD bool learns() const { return directions_ != nullptr; }
  WFPG_HD static bool leads_somewhere(vec3 direction) {
    return is_finite(direction) && direction != vec3(0.0f);
  }
  WFPG_HD void drop() const {
    if (dropped_) atomic_add(dropped_, 1);
  }
  /// Where a path is among the recorded ones; false where it is not, and dropped where there is no such path.
  WFPG_HD bool find(std::size_t path, std::uint32_t& place) const {
    if (path < paths_) return recorded_ > 0 && runs_.find(path, place);
    drop();
    return false;
  }
  /// `place`: of a path, among the recorded ones.
  WFPG_HD void add(std::uint32_t place, std::uint32_t depth, vec3 contribution) const {
    if (depth >= (lengths_[place] & ~escaped)) return drop();
    light_[depth * recorded_ + place].contribution += contribution;
  }

  std::size_t paths_ = 0;
  std::size_t recorded_ = 0;  // of them
  detail::recorded_runs runs_;
  std::uint32_t max_depth_ = 0;
  bool include_emission_ = true;
  std::uint32_t* lengths_ = nullptr;          // a recorded path: its vertices, and `escaped`
  detail::recorded_place* places_ = nullptr;  // a vertex, all recorded paths of a depth together
  detail::recorded_light* light_ = nullptr;
  detail::recorded_direction* directions_ = nullptr;  // null: fields do not learn
  std::uint32_t* dropped_ = nullptr;
};

/// In its place where a guide records no paths: the same calls, which cost nothing.
struct no_path_recorder {
  /// None.
  WFPG_HD std::size_t paths() const { return 0; }
  /// None.
  WFPG_HD std::uint32_t max_depth() const { return 0; }
  /// Forgotten.
  WFPG_HD void vertex(std::size_t, std::uint32_t, vec3, vec3, vec3) const {}
  /// Forgotten.
  WFPG_HD void scatter(std::size_t, std::uint32_t, const sampled_direction&) const {}
  /// Forgotten.
  WFPG_HD void escape(std::size_t, std::uint32_t, vec3) const {}
  /// Forgotten.
  WFPG_HD void radiance(std::size_t, std::uint32_t, vec3) const {}
  /// Forgotten.
  WFPG_HD void emission(std::size_t, std::uint32_t, vec3) const {}

  /// For kernels that are written for the other: one that forgets everything.
  WFPG_HD operator path_recorder_view() const { return {}; }
};

/// One path as it was recorded: the surfaces that it met in order, and behind the last of them the
/// environment where it told of that with escape(). Valid until the recorder forgets it.
class recorded_path {
 public:
  /// `place`: of the path among the recorded ones.
  WFPG_HD recorded_path(const path_recorder_view& paths, std::size_t place)
      : paths_(paths),
        place_(place),
        surfaces_(paths.lengths_[place] & ~path_recorder_view::escaped),
        vertices_(surfaces_) {
    if (paths.lengths_[place] & path_recorder_view::escaped) --surfaces_;
  }

  /// Vertices, the environment among them.
  WFPG_HD std::uint32_t vertices() const { return vertices_; }
  /// Vertices that are surfaces: [0, surfaces()).
  WFPG_HD std::uint32_t surfaces() const { return surfaces_; }

  /// Where a surface is, world space.
  WFPG_HD vec3 position(std::uint32_t depth) const { return paths_.places_[slot(depth)].position; }
  /// The unit direction from a surface toward the vertex before it.
  WFPG_HD vec3 outgoing(std::uint32_t depth) const {
    return unpack_direction(paths_.places_[slot(depth)].outgoing);
  }
  /// The path's throughput before a vertex scatters, linear RGB.
  WFPG_HD vec3 throughput(std::uint32_t depth) const { return paths_.light_[slot(depth)].throughput; }
  /// What a vertex itself brought to the path's origin: what it emits, and what it scatters of light that was
  /// sampled there; linear RGB.
  WFPG_HD vec3 contribution(std::uint32_t depth) const { return paths_.light_[slot(depth)].contribution; }
  /// The number that the guide gave to the direction of scatter(), or no_field. Precondition: directions are
  /// recorded.
  WFPG_HD std::uint32_t field(std::uint32_t depth) const { return paths_.directions_[slot(depth)].field; }
  /// Where the path went on from a surface, a unit direction: toward the next surface, or where scatter()
  /// told. False where nothing tells. Precondition: directions are recorded.
  WFPG_HD bool leads(std::uint32_t depth, vec3& direction) const {
    if (depth + 1 < surfaces_) {
      direction = -outgoing(depth + 1);
      return true;
    }
    direction = this->direction(depth);
    return paths_.directions_[slot(depth)].direction != 0;
  }
  /// The unit direction of scatter(). Precondition: it was told.
  WFPG_HD vec3 direction(std::uint32_t depth) const {
    return unpack_direction(paths_.directions_[slot(depth)].direction);
  }

 private:
  WFPG_HD std::size_t slot(std::uint32_t depth) const { return depth * paths_.recorded_ + place_; }

  path_recorder_view paths_;
  std::size_t place_;
  std::uint32_t surfaces_, vertices_;
};

/// Luminance that left a vertex and arrived as `arriving` along a path of throughput `throughput`, linear
/// RGB. Nothing leaves where nothing can arrive from; a throughput that is not finite stays so, for who drops
/// it.
WFPG_HD inline float leaving_luminance(vec3 arriving, vec3 throughput) {
  const auto divided = [](float a, float t) {
    if (t > 0.0f) return a / t;
    return is_finite(t) ? 0.0f : t;
  };
  return luminance({divided(arriving.x, throughput.x), divided(arriving.y, throughput.y),
                    divided(arriving.z, throughput.z)});
}

/// Owns the vertices of those that are recorded of `paths` paths of at most `max_depth` vertices.
template <class Exec>
class path_recorder {
 public:
  path_recorder() = default;
  /// `include_emission`: emitters' own radiance is cached too, so that guiding looks for them; false where
  /// next-event estimation does that. Of 2^`share_shift` paths one is recorded. `fields_learn`: directions
  /// are recorded too. Throws out_of_memory.
  path_recorder(const Exec& exec, std::size_t paths, std::uint32_t max_depth, bool include_emission,
                std::uint32_t share_shift = 0, bool fields_learn = false)
      : lengths_(exec, detail::recorded_runs{share_shift}.size(paths)),
        places_(exec, lengths_.size() * max_depth),
        light_(exec, lengths_.size() * max_depth),
        directions_(exec, fields_learn ? lengths_.size() * max_depth : 0),
        dropped_(exec, 1) {
    view_.paths_ = paths;
    view_.recorded_ = lengths_.size();
    view_.runs_.shift = share_shift;
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

  /// What kernels see; valid until begin_sample().
  path_recorder_view view() const { return view_; }
  /// Of all that it allocated.
  std::size_t bytes() const {
    return lengths_.bytes() + places_.bytes() + light_.bytes() + directions_.bytes() + dropped_.bytes();
  }

  /// Whether vertices have the directions that scatter() tells.
  bool records_directions() const { return view_.learns(); }
  /// Paths that this sample records, at most.
  std::size_t recorded() const { return view_.recorded_; }

  /// Forgets all paths. Views from then on record the paths of a sample of this seed, or none.
  void begin_sample(const Exec& exec, std::uint32_t seed, bool records = true) {
    view_.runs_.seed = seed;
    view_.recorded_ = records ? lengths_.size() : 0;
    clear(exec);
  }
  /// Forgets all paths.
  void clear(const Exec& exec) {
    exec.fill_bytes(lengths_.data(), 0, view_.recorded_ * sizeof(std::uint32_t));
  }

  /// Calls dropped for a path, depth or order out of range, in all; waits for the work before it.
  std::uint32_t dropped(const Exec& exec) const { return read_element(exec, dropped_.data()); }

 private:
  friend struct detail::state_access;

  buffer<std::uint32_t, Exec> lengths_;
  buffer<detail::recorded_place, Exec> places_;
  buffer<detail::recorded_light, Exec> light_;
  buffer<detail::recorded_direction, Exec> directions_;
  buffer<std::uint32_t, Exec> dropped_;
  path_recorder_view view_;
};

}  // namespace wfpg
