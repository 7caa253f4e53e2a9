// How kernels of light paths record vertices and photon beams: the view that bidirectional::light_recorder()
// returns. A path adds a beam where it crosses a medium. It writes its new vertex, where it keeps one, after
// bidirectional::reserve().
//
// Cost: a vertex or a beam is written once; a beam is copied once more. Memory: that of
// light/bidirectional.hpp.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/light/light_vertices.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

namespace detail {

/// Beams that paths have left since the last reserve(). They have no place yet.
template <class Beam>
struct pending_beams {
  array_view<Beam> beams;            ///< `most` a path
  array_view<std::uint32_t> counts;  ///< by path
  array_view<std::uint32_t> lost;    ///< by path: beams of this iteration beyond `most`
  std::uint32_t most = 0;            ///< beams of a path between two calls of reserve()

  WFPG_HD std::size_t paths() const { return counts.size(); }
  WFPG_HD void add(std::size_t path, const Beam& beam) const {
    if (counts[path] < most)
      beams[path * most + counts[path]++] = beam;
    else
      ++lost[path];
  }
};

}  // namespace detail

/// Records light paths. Trivially copyable. Calls for one path come from one thread at a time.
template <class Vertex, class Beam>
class light_recorder_view {
 public:
  /// Records nothing.
  light_recorder_view() = default;
  /// For bidirectional. Not for hosts.
  light_recorder_view(const light_vertices_view<Vertex>& vertices, const detail::pending_beams<Beam>& beams)
      : vertices_(vertices), beams_(beams) {}

  /// Whether vertices are stored at all. False where no technique reads them.
  WFPG_HD bool stores_vertices() const { return vertices_.paths() > 0; }
  /// Whether a path's new vertex has a place, after bidirectional::reserve(). False where the path keeps
  /// none, and where memory was used up.
  WFPG_HD bool has_place(std::size_t path) const { return stores_vertices() && vertices_.has_place(path); }
  /// Stores a path's new vertex. O(1). Precondition: has_place(path). Then call it exactly once after each
  /// reserve(): the place counts as a vertex from then on.
  WFPG_HD void write(std::size_t path, const Vertex& vertex) const { vertices_.write(path, vertex); }

  /// Whether a path leaves beams: the first ones of an iteration do, as many as
  /// bidirectional_options::beam_paths says.
  WFPG_HD bool leaves_beams(std::size_t path) const { return path < beams_.paths(); }
  /// Adds a beam in a medium. O(1). The next reserve() or build() stores it. Precondition:
  /// leaves_beams(path).
  WFPG_HD void add_beam(std::size_t path, const Beam& beam) const { beams_.add(path, beam); }

 private:
  light_vertices_view<Vertex> vertices_;
  detail::pending_beams<Beam> beams_;
};

}  // namespace wfpg
