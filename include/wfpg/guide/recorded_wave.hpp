// The last vertex of each path in flight. A guide prepares a wave from it, so that the host gives no surfaces
// of its own. For hosts whose BSDFs exist only in their kernels, and whose hits lie in queues by material.
//
// Paths keep their index from depth to depth: the view of a prepared wave takes it for the ray's.
//
// Source: wfpg's own.
// Cost: a vertex writes 28 bytes. A wave reads 4 bytes a path and 24 a vertex, and writes 4 a path.
// Memory: 28 bytes a path.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

namespace detail {

/// Where a path is. 24 bytes.
struct alignas(8) wave_place {
  vec3 position;  ///< world space
  vec3 normal;    ///< shading normal on the side of the previous vertex
};

// A path's state is the depth of its vertex, with a flag where the surface transmits.
inline constexpr std::uint32_t wave_transmits = 0x80000000u;
inline constexpr std::uint32_t no_wave_vertex = 0xffffffffu;

/// Whether a state is that of a vertex of this depth.
WFPG_HD inline bool is_at_depth(std::uint32_t state, std::uint32_t depth) {
  return state != no_wave_vertex && (state & ~wave_transmits) == depth;
}

/// Kernel: a path whose vertex has the depth has none afterwards.
struct forget_vertex {
  std::uint32_t* states;
  std::uint32_t depth;
  WFPG_HD void operator()(std::size_t path) const {
    if (is_at_depth(states[path], depth)) states[path] = no_wave_vertex;
  }
};

}  // namespace detail

/// Records each path's last vertex. Trivially copyable.
/// A default view has no paths, and ignores all calls.
class wave_recorder_view {
 public:
  /// Replaces a path's vertex. `facing`: shading normal on the outgoing side, unit length. Paths out of range
  /// are ignored. Calls for one path come from one thread at a time.
  WFPG_HD void record(std::size_t path, std::uint32_t depth, vec3 position, vec3 facing,
                      bool transmits) const {
    if (path >= paths_ || depth >= detail::wave_transmits - 1u) return;
    states_[path] = depth | (transmits ? detail::wave_transmits : 0u);
    places_[path] = {position, facing};
  }

 private:
  // The owner of the memory, which sets what follows.
  template <class Exec>
  friend class wave_recorder;

  std::size_t paths_ = 0;
  std::uint32_t* states_ = nullptr;
  detail::wave_place* places_ = nullptr;
};

/// Owns the last vertices of all paths. A path_recorder has one, and hands out its view. All paths are
/// recorded here, also in samples that guides do not learn from. Movable, not copyable; the policy's memory
/// must outlive it.
template <class Exec>
class wave_recorder {
 public:
  /// A recorder of no paths. It may be assigned to.
  wave_recorder() = default;
  /// A recorder for `paths` paths, below 2^32 - 1. No path has a vertex. Throws out_of_memory.
  wave_recorder(const Exec& exec, std::size_t paths) : states_(exec, paths), places_(exec, paths) {
    view_.paths_ = paths;
    view_.states_ = states_.data();
    view_.places_ = places_.data();
    clear(exec);
  }

  /// View for kernels. Valid as long as this recorder.
  wave_recorder_view view() const { return view_; }
  /// Number of paths, which is the number of rays of each wave.
  /// 0 where waves are not recorded.
  std::size_t paths() const { return view_.paths_; }
  /// Bytes allocated, in the policy's memory.
  /// 28 a path.
  std::size_t bytes() const { return states_.bytes() + places_.bytes(); }

  /// State of each path: the depth of its vertex, with a flag; or none. For recorded_surfaces.
  array_view<const std::uint32_t> states() const { return {states_.data(), states_.size()}; }
  /// Place of each path. It is not written where the path has no vertex.
  array_view<const detail::wave_place> places() const { return {places_.data(), places_.size()}; }
  /// Forgets the vertices of one depth, so that a later wave of the same depth does not see them again.
  void forget(const Exec& exec, std::uint32_t depth) {
    exec.for_each(paths(), detail::forget_vertex{states_.data(), depth});
  }
  /// Forgets all vertices, as at the beginning of a sample.
  /// Writes 4 bytes a path.
  void clear(const Exec& exec) { exec.fill_bytes(states_.data(), 0xff, states_.bytes()); }

 private:
  // Apart, so that a wave reads places only where it has a ray.
  buffer<std::uint32_t, Exec> states_;
  buffer<detail::wave_place, Exec> places_;
  // What kernels see of both.
  wave_recorder_view view_;
};

}  // namespace wfpg
