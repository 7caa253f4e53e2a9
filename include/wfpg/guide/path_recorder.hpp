// Records the vertices of the paths in flight and the radiance that leaves each of them. The renderer's
// kernels write them during a sample; the guide reads them at its end.
//
// Radiance follows by back-propagation. What arrives at a path's origin, divided by the throughput up to a
// vertex, left that vertex. Large waves are recorded in part: a random part of the paths, in some of the
// samples. Leaves need no more values.
//
// Source: Yalçıner & Akyüz, "Path Guiding for Wavefront Path Tracing", 2024, Eq. 5. Recording in part, and
// recording directions so that kept fields learn from paths, are wfpg's own.
// Cost: a call writes at most 80 bytes, and 48 for each depth that is left out. It uses an atomic only where
// it is dropped or follows a gap.
// Memory: 40 bytes a vertex, 49 with directions, and 4 a recorded path. A recorded path has room for
// max_depth vertices.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/support/atomic.hpp>
#include <wfpg/guide/recorded_wave.hpp>
#include <wfpg/host/recorded_runs.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

namespace wfpg {

namespace detail {

struct close_path;

/// Position of a vertex. 16 bytes, so that a GPU's thread writes it with one store.
struct alignas(16) recorded_place {
  vec3 position;           ///< world space
  std::uint32_t outgoing;  ///< pack_direction() of the direction toward the previous vertex; 0: a gap
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

/// Throughput or radiance of a path: linear RGB, or a number where a host has no colours. The guide uses its
/// luminance alone. A spectral host gives the mean of its wavelengths' values, or the luminance. A path uses
/// one of the two forms throughout.
struct path_light {
  vec3 rgb;  ///< linear RGB

  /// A colour, linear RGB.
  WFPG_HD path_light(vec3 colour) : rgb(colour) {}
  /// A luminance: the grey of that number.
  WFPG_HD path_light(float number) : rgb(number) {}
};

/// View of the recorder for kernels. Trivially copyable. A default-constructed view ignores all calls.
/// Precondition: calls for one path come from one thread at a time, with vertices in order of depth. A call
/// is dropped and counted in these cases:
/// - The path or the depth is beyond the capacity.
/// - The vertex is not recorded, or comes out of order.
/// - The direction is zero or not finite.
///
/// **Gaps.** Depths may be left out, at the beginning of a path too. Media, subsurface scattering and split
/// paths need it. The direction that led to a gap teaches nothing. All else is learnt as without it. Gaps are
/// counted.
///
/// A split path divides its light: add what branches of other indices find to the parent with radiance().
///
/// **Passes.** A sample may have several passes of the host, if no path index is used twice before
/// end_sample(). Where the host begins a sample again without end_sample(), its paths teach nothing.
///
/// Calls for paths that this sample does not record are ignored. They do not count as dropped. O(1) a call.
class path_recorder_view {
 public:
  /// Capacity in paths: valid path indices are [0, paths()), recorded or not.
  WFPG_HD std::size_t paths() const { return paths_; }
  /// Capacity in vertices of one path: valid depths are [0, max_depth()).
  WFPG_HD std::uint32_t max_depth() const { return max_depth_; }
  /// Number of places for recorded paths: recorded_path takes those below it. 0 in a sample that records
  /// nothing.
  WFPG_HD std::size_t recorded() const { return recorded_; }
  /// Whether scatter() and escape() are recorded. Without it, recorded_path knows no directions.
  WFPG_HD bool records_directions() const { return directions_ != nullptr; }
  /// Whether a direction of which nothing more is heard has found no light: path_recorder::close_paths().
  WFPG_HD bool silent_escapes() const { return silent_escapes_; }
  /// Writes the place of a path among the recorded ones. False where this sample does not record the path.
  WFPG_HD bool has_place(std::size_t path, std::uint32_t& place) const {
    return path < paths_ && recorded_ > 0 && runs_.find(path, place);
  }

  /// Records vertex `depth` of a path; 0 is the first surface. `position` is in world space. `outgoing` is
  /// the unit direction toward the previous vertex. `throughput` is the path's before this vertex's BSDF,
  /// linear RGB: 1 at the camera's first hit.
  WFPG_HD void vertex(std::size_t path, std::uint32_t depth, vec3 position, vec3 outgoing,
                      path_light throughput) const {
    std::uint32_t place;
    if (!find(path, place)) return;
    const std::uint32_t flags = lengths_[place], length = flags & length_mask;
    const bool in_order = (flags & escaped) == 0 && depth >= length && depth < max_depth_;
    if (!in_order || !is_direction(outgoing)) return drop();
    for (std::uint32_t gap = length; gap < depth; ++gap) write_vertex(place, gap, vec3(0.0f), 0, vec3(0.0f));
    if (depth > length) atomic_add(counters_ + counter_gaps, 1);
    write_vertex(place, depth, position, pack_marked(outgoing), throughput.rgb);
    lengths_[place] = (depth + 1) | (depth > length ? gaps : flags & gaps);
  }
  /// Records a vertex for path_guider::prepare(depth, caster) as well: all that a host says of a hit.
  /// `normal`: shading normal on either side, unit length. `transmits`: light can come from below it. Leave
  /// it out for surfaces whose BSDF is delta in all lobes: they are not guided.
  WFPG_HD void vertex(std::size_t path, std::uint32_t depth, vec3 position, vec3 outgoing, vec3 normal,
                      bool transmits, path_light throughput) const {
    wave_.record(path, depth, position, glm::dot(normal, outgoing) >= 0.0f ? normal : -normal, transmits);
    vertex(path, depth, position, outgoing, throughput);
  }

  /// Records the unit direction in which the path leaves vertex `depth`, which must be its last so far. The
  /// guide learns from it what the direction finds. `field`: number of the field in the mixture that drew it,
  /// or no_field, as for delta lobes. `share`: the guide's in the density of the direction. Ignored where
  /// directions are not recorded.
  WFPG_HD void scatter(std::size_t path, std::uint32_t depth, vec3 direction, std::uint32_t field,
                       guide_share share = {}) const {
    std::uint32_t place;
    if (!records_directions() || !find(path, place)) return;
    if (depth >= max_depth_ || depth + 1 != length_of_surfaces(place) || !is_direction(direction))
      return drop();
    directions_[depth * recorded_ + place] = {field, pack_marked(direction)};
    shares_[depth * recorded_ + place] = static_cast<std::uint8_t>(share.code);
  }
  /// Records a direction that the guider sampled, with its field.
  /// Ignored for technique `none`: the path ends there.
  WFPG_HD void scatter(std::size_t path, std::uint32_t depth, const sampled_direction& drawn) const {
    if (drawn.technique != sampling_technique::none)
      scatter(path, depth, drawn.direction, drawn.field, drawn.share);
  }

  /// Records that the path left the scene: the environment becomes its vertex `depth`, the last one. Call it
  /// for dark environments too, so that guides learn that no light comes from there. A host without such an
  /// event sets sampling_options::silent_escapes instead. `throughput` is the
  /// path's as it leaves the scene. Report the environment's radiance with emission(). Ignored where
  /// directions are not recorded, and at the depth max_depth().
  WFPG_HD void escape(std::size_t path, std::uint32_t depth, path_light throughput) const {
    std::uint32_t place;
    if (!records_directions() || depth == 0 || !find(path, place)) return;
    const std::uint32_t length = length_of_surfaces(place);
    if (length == ~0u || depth < length) return drop();
    // From a medium: what the last direction finds is not known.
    if (depth > length || depth >= max_depth_) return;
    write_light(place, depth, throughput.rgb);
    lengths_[place] = (depth + 1) | escaped | (lengths_[place] & gaps);
  }

  /// Adds radiance that vertex `depth` scatters toward the path's origin. Next-event estimation reports its
  /// result with it. `contribution` is the radiance as it arrives at the origin, linear RGB: it includes
  /// throughput, BSDF and MIS weight. May be called several times a vertex.
  WFPG_HD void radiance(std::size_t path, std::uint32_t depth, path_light contribution) const {
    std::uint32_t place;
    if (find(path, place)) add(place, depth, contribution.rgb);
  }

  /// Adds what the path's radiance has grown by since what is recorded of it, as scattered by vertex `depth`.
  /// For hosts that add light to their paths in other kernels. `sum` is all radiance that the path has
  /// brought to its origin so far, without what came before its first recorded vertex. O(depth). The sum may
  /// shrink by rounding, and a difference below 0 counts as 0.
  WFPG_HD void total(std::size_t path, std::uint32_t depth, path_light sum) const {
    std::uint32_t place;
    if (!find(path, place)) return;
    vec3 known(0.0f);
    const std::uint32_t length = lengths_[place] & length_mask;
    for (std::uint32_t i = 0; i < length; ++i) known += light_[i * recorded_ + place].contribution;
    const vec3 found = glm::max(sum.rgb - known, vec3(0.0f));
    if (depth >= length && found != vec3(0.0f)) hear(place);
    // Light of a medium counts for the surface before.
    if (length > 0) add(place, min(depth, length - 1u), found);
  }

  /// Adds the radiance of an emitter that the path hit as vertex `depth`. Also that of the environment, where
  /// the path left the scene after vertex `depth` - 1. `contribution` is the radiance as it arrives at the
  /// path's origin, linear RGB. It counts as scattered by the vertices before. It counts as leaving the
  /// emitter itself too, if sampling_options::include_emission is set and the emitter is a recorded vertex.
  /// Light of a medium may be told so, at any depth beyond the last vertex.
  WFPG_HD void emission(std::size_t path, std::uint32_t depth, path_light contribution) const {
    std::uint32_t place;
    if (!find(path, place)) return;
    const std::uint32_t length = lengths_[place] & length_mask;
    if (include_emission_ && depth < length) return add(place, depth, contribution.rgb);
    if (depth >= length) hear(place);
    const std::uint32_t before = min(depth, length);
    if (before > 0) add(place, before - 1, contribution.rgb);
  }

 private:
  template <class Exec>
  friend class path_recorder;
  friend class recorded_path;
  friend struct detail::close_path;

  // Flags in a path's length: its last vertex is the environment; some of its vertices are gaps; light came
  // from beyond its last vertex.
  static constexpr std::uint32_t escaped = 0x80000000u, gaps = 0x40000000u, heard = 0x20000000u,
                                 length_mask = heard - 1u;
  // Indices of counters_.
  enum : std::uint32_t { counter_dropped, counter_gaps, counters };

  /// Whether pack_direction() can store it.
  WFPG_HD static bool is_direction(vec3 direction) { return is_finite(direction) && direction != vec3(0.0f); }
  /// Packs a direction so that it is never 0, which marks that there is none.
  WFPG_HD static std::uint32_t pack_marked(vec3 direction) { return max(pack_direction(direction), 1u); }
  /// Counts a dropped call; a default view has no counter.
  WFPG_HD void drop() const {
    if (counters_) atomic_add(counters_ + counter_dropped, 1);
  }
  /// Index of a path among the recorded ones. False where it is not recorded; counts a drop where it is not
  /// in [0, paths()).
  WFPG_HD bool find(std::size_t path, std::uint32_t& place) const {
    if (path >= paths_) drop();
    return has_place(path, place);
  }
  /// Number of a path's vertices, or one that no depth follows where the path has left the scene.
  WFPG_HD std::uint32_t length_of_surfaces(std::uint32_t place) const {
    return lengths_[place] & escaped ? ~0u : lengths_[place] & length_mask;
  }
  /// Lets a path escape into the dark, if nothing was heard of its last direction. There is no throughput
  /// beyond, since nothing is to be attenuated.
  WFPG_HD void close(std::uint32_t place) const {
    const std::uint32_t flags = lengths_[place], length = flags & length_mask;
    if ((flags & (escaped | heard)) != 0 || length == 0 || length >= max_depth_) return;
    if (directions_[(length - 1) * recorded_ + place].direction == 0) return;
    write_light(place, length, vec3(0.0f));
    lengths_[place] = (length + 1) | escaped | (flags & gaps);
  }
  /// Writes one vertex, without a direction yet. By members, which a compiler for GPUs joins. Copies would be
  /// made on the stack and read back in wider pieces, which waits for all earlier stores.
  WFPG_HD void write_vertex(std::uint32_t place, std::uint32_t depth, vec3 position, std::uint32_t outgoing,
                            vec3 throughput) const {
    const std::size_t slot = depth * recorded_ + place;
    places_[slot].position = position;
    places_[slot].outgoing = outgoing;
    write_light(place, depth, throughput);
    if (records_directions()) directions_[slot] = {no_field, 0};
  }
  /// Writes the light of a vertex that has brought nothing yet.
  WFPG_HD void write_light(std::uint32_t place, std::uint32_t depth, vec3 throughput) const {
    detail::recorded_light& light = light_[depth * recorded_ + place];
    light.throughput = throughput;
    light.contribution = vec3(0.0f);
  }
  /// Notes that the last direction has found something. Only silent escapes ask for it.
  WFPG_HD void hear(std::uint32_t place) const {
    if (silent_escapes_) lengths_[place] |= heard;
  }
  /// Adds to a recorded surface or environment. `place` is what find() wrote. Needs no atomic, since a path's
  /// calls come from one thread.
  WFPG_HD void add(std::uint32_t place, std::uint32_t depth, vec3 contribution) const {
    if (depth >= (lengths_[place] & length_mask)) return drop();
    light_[depth * recorded_ + place].contribution += contribution;
  }

  std::size_t paths_ = 0;
  std::size_t recorded_ = 0;  // 0 in a sample that records nothing
  recorded_runs runs_;
  std::uint32_t max_depth_ = 0;
  bool include_emission_ = true;
  bool silent_escapes_ = false;
  // A length for each recorded path: its number of vertices, with the flags above.
  std::uint32_t* lengths_ = nullptr;
  // Vertices, at depth * recorded_ + place: neighbouring threads write neighbouring elements.
  detail::recorded_place* places_ = nullptr;
  detail::recorded_light* light_ = nullptr;
  detail::recorded_direction* directions_ = nullptr;  // null where directions are not recorded
  std::uint8_t* shares_ = nullptr;                    // guide_share::code of each, as it is for a field
  std::uint32_t* counters_ = nullptr;
  wave_recorder_view wave_;
};

/// Stands in for path_recorder_view where a guide reads no paths.
/// An empty class with empty members, so that kernels compile for both and the compiler removes the calls.
struct no_path_recorder {
  /// Returns 0: there is room for no path.
  WFPG_HD std::size_t paths() const { return 0; }
  /// Returns 0: a path has no vertices.
  WFPG_HD std::uint32_t max_depth() const { return 0; }
  /// Does nothing; see path_recorder_view::vertex().
  WFPG_HD void vertex(std::size_t, std::uint32_t, vec3, vec3, path_light) const {}
  /// Does nothing; see path_recorder_view::vertex().
  WFPG_HD void vertex(std::size_t, std::uint32_t, vec3, vec3, vec3, bool, path_light) const {}
  /// Does nothing; see path_recorder_view::scatter().
  WFPG_HD void scatter(std::size_t, std::uint32_t, const sampled_direction&) const {}
  /// Does nothing; see path_recorder_view::scatter().
  WFPG_HD void scatter(std::size_t, std::uint32_t, vec3, std::uint32_t, guide_share = {}) const {}
  /// Does nothing; see path_recorder_view::escape().
  WFPG_HD void escape(std::size_t, std::uint32_t, path_light) const {}
  /// Does nothing; see path_recorder_view::radiance().
  WFPG_HD void radiance(std::size_t, std::uint32_t, path_light) const {}
  /// Does nothing; see path_recorder_view::total().
  WFPG_HD void total(std::size_t, std::uint32_t, path_light) const {}
  /// Does nothing; see path_recorder_view::emission().
  WFPG_HD void emission(std::size_t, std::uint32_t, path_light) const {}

  /// Returns a default view, which ignores all calls, for kernels that take that type.
  WFPG_HD operator path_recorder_view() const { return {}; }
};

/// Size of a path_recorder, and which parts of paths it stores.
struct path_recorder_settings {
  std::size_t paths = 0;        ///< most paths of a sample, below 2^32 - 1
  std::uint32_t max_depth = 8;  ///< most vertices of a path, at least 1
  /// Emitters' own radiance counts as leaving them, so that guiding looks for emitters. Unset it where
  /// next-event estimation finds them.
  bool include_emission = true;
  std::uint32_t fraction_shift = 0;  ///< one path in 2^fraction_shift is recorded
  bool directions = false;           ///< scatter() and escape() are recorded, for guides that learn from them
  bool waves = false;                ///< the last vertex of every path is recorded too, recorded or not
  bool silent_escapes = false;       ///< close_paths() lets paths escape of which nothing more was heard
  std::uint32_t first_path = 0;      ///< index of path 0 among the paths of all ranks
};

namespace detail {

/// Kernel: lets a path escape if nothing was heard of its last direction.
struct close_path {
  path_recorder_view paths;
  WFPG_HD void operator()(std::size_t place) const { paths.close(static_cast<std::uint32_t>(place)); }
};

}  // namespace detail

/// Owns the memory of recorded paths. Movable, not copyable; the policy's memory must outlive it.
template <class Exec>
class path_recorder {
 public:
  /// A recorder of no paths. It may be assigned to.
  path_recorder() = default;
  /// A recorder without paths yet. Until the first begin_sample() it records all of `settings`' paths. Throws
  /// out_of_memory.
  path_recorder(const Exec& exec, const path_recorder_settings& settings)
      : lengths_(exec, runs_of(settings).capacity(settings.paths)),
        places_(exec, lengths_.size() * settings.max_depth),
        light_(exec, lengths_.size() * settings.max_depth),
        directions_(exec, settings.directions ? lengths_.size() * settings.max_depth : 0),
        shares_(exec, directions_.size()),
        counters_(exec, path_recorder_view::counters),
        wave_(exec, settings.waves ? settings.paths : 0) {
    view_.paths_ = settings.paths;
    view_.runs_ = runs_of(settings);
    view_.recorded_ = view_.runs_.size(settings.paths);
    view_.max_depth_ = settings.max_depth;
    view_.include_emission_ = settings.include_emission;
    view_.silent_escapes_ = settings.silent_escapes;
    view_.lengths_ = lengths_.data();
    view_.places_ = places_.data();
    view_.light_ = light_.data();
    view_.directions_ = directions_.data();
    view_.shares_ = shares_.data();
    view_.counters_ = counters_.data();
    view_.wave_ = wave_.view();
    exec.fill_bytes(counters_.data(), 0, counters_.bytes());
    clear(exec);
  }

  /// View for kernels, of the current sample: valid until begin_sample().
  path_recorder_view view() const { return view_; }
  /// Bytes allocated, in the policy's memory.
  std::size_t bytes() const {
    return lengths_.bytes() + places_.bytes() + light_.bytes() + directions_.bytes() + shares_.bytes() +
           counters_.bytes() + wave_.bytes();
  }

  /// Whether scatter() and escape() are recorded.
  bool records_directions() const { return view_.records_directions(); }
  /// Which paths this sample records, if it records any.
  const recorded_runs& runs() const { return view_.runs_; }
  /// Size of the recorded part of this sample: recorded_path takes places in [0, recorded()). 0 in a sample
  /// that is not recorded. Some of these paths may have no vertices.
  std::size_t recorded() const { return view_.recorded(); }

  /// Begins a sample: clears all paths and chooses by `seed` which ones are recorded, or none if `records` is
  /// false. Of those that the settings record, one in 2^rarer is. Views made before are invalid.
  /// O(recorded()).
  void begin_sample(const Exec& exec, std::uint32_t seed, bool records = true, std::uint32_t rarer = 0) {
    view_.runs_.seed = seed;
    view_.runs_.rarer = rarer;
    view_.recorded_ = records ? view_.runs_.size(view_.paths_) : 0;
    clear(exec);
    wave_.clear(exec);
  }
  /// Clears the recorded paths: each has no vertices then. Writes 4 bytes a path.
  void clear(const Exec& exec) {
    exec.fill_bytes(lengths_.data(), 0, view_.recorded_ * sizeof(std::uint32_t));
  }

  /// Ends the paths of hosts that do not call escape(). Where nothing was heard after the last scatter(), the
  /// path left the scene and found no light. Does nothing without path_recorder_settings::silent_escapes, or
  /// without directions. Call it after the sample's waves, before a guide reads the paths. O(recorded()).
  void close_paths(const Exec& exec) {
    if (view_.silent_escapes() && records_directions()) exec.for_each(recorded(), detail::close_path{view_});
  }

  /// Number of dropped calls since construction, modulo 2^32; path_recorder_view lists the cases. Waits for
  /// the work before it.
  std::uint32_t dropped(const Exec& exec) const {
    return read_element(exec, counters_.data() + path_recorder_view::counter_dropped);
  }
  /// Number of recorded vertices that came after a gap, since construction, modulo 2^32. Waits for the work
  /// before it.
  std::uint32_t gaps(const Exec& exec) const {
    return read_element(exec, counters_.data() + path_recorder_view::counter_gaps);
  }

  /// The counters of dropped() and gaps(), in the policy's memory, for ranks to add up.
  array_view<std::uint32_t> counters() const { return counters_.view(); }

  /// The last vertices of all paths; of no paths where the settings leave waves out.
  wave_recorder<Exec>& wave() { return wave_; }

 private:
  friend struct detail::state_access;

  // All paths that may be recorded.
  static recorded_runs runs_of(const path_recorder_settings& settings) {
    return {settings.fraction_shift, 0, 0, settings.first_path};
  }

  // What the view's pointers of these names point to, and the view itself.
  buffer<std::uint32_t, Exec> lengths_;
  buffer<detail::recorded_place, Exec> places_;
  buffer<detail::recorded_light, Exec> light_;
  buffer<detail::recorded_direction, Exec> directions_;
  buffer<std::uint8_t, Exec> shares_;
  buffer<std::uint32_t, Exec> counters_;
  wave_recorder<Exec> wave_;
  path_recorder_view view_;
};

}  // namespace wfpg
