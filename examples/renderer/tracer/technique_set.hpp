// Ways of bidirectional methods to find light, and their options.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/light/bidirectional_options.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

namespace render {

/// A way to find light.
enum class technique : std::uint8_t {
  hits,     ///< camera paths hit lights
  nee,      ///< light samples at vertices of camera paths
  connect,  ///< vertices of light and camera paths are connected
  splat,    ///< vertices of light paths are connected to the camera
  surf,     ///< vertices of all light paths are merged with near ones of camera paths, on surfaces
  pp3d,     ///< the same in media
  pb2d,     ///< vertices of some light paths in media are merged with near segments of camera paths
  bb1d,     ///< segments of some light paths in media are merged with near segments of camera paths
};
inline constexpr int technique_count = 8;

/// Which ways to find light a rendering has. Each finds paths of its own; weights share the others.
class technique_set {
 public:
  /// Bidirectional path tracing: without merges.
  constexpr technique_set()
      : technique_set({technique::hits, technique::nee, technique::connect, technique::splat}) {}
  constexpr technique_set(std::initializer_list<technique> all) {
    for (const technique t : all) add(t);
  }

  WFPG_HD constexpr bool has(technique t) const { return (on_ & bit(t)) != 0; }
  constexpr void add(technique t) { on_ |= bit(t); }
  constexpr void add(const technique_set& others) { on_ |= others.on_; }

  /// Whether vertices are merged on surfaces or in media.
  constexpr bool merges() const { return has(technique::surf) || merges_in_media(); }
  constexpr bool merges_in_media() const {
    return has(technique::pp3d) || has(technique::pb2d) || has(technique::bb1d);
  }
  constexpr bool merges_at_points() const { return has(technique::surf) || has(technique::pp3d); }
  /// Whether anything is found behind the first vertex of a camera path, or at it.
  constexpr bool needs_camera_paths() const { return (on_ & ~bit(technique::splat)) != 0; }
  /// Whether camera paths are joined with light paths.
  constexpr bool joins_light_paths() const { return has(technique::connect) || merges(); }
  constexpr bool needs_light_paths() const { return has(technique::splat) || joins_light_paths(); }

 private:
  WFPG_HD static constexpr std::uint32_t bit(technique t) { return 1u << static_cast<int>(t); }

  std::uint32_t on_ = 0;
};

/// Techniques that have a picture of their own. Lights that the camera sees count as hits, whatever is on.
constexpr technique_set pictured(technique_set on) {
  on.add(technique::hits);
  return on;
}

/// Options of light paths: `given`, with a set of techniques, for as many paths of up to `max_depth`
/// segments.
inline wfpg::bidirectional_options light_options(wfpg::bidirectional_options given, const technique_set& set,
                                                 std::size_t paths, std::uint32_t max_depth) {
  given.paths = paths;
  given.max_vertices = std::max(max_depth, 2u) - 1;
  // Splats alone are made after every few depths, and vertices are then forgotten.
  if (!set.joins_light_paths()) given.max_vertices = std::min(given.max_vertices, 4u);
  given.max_beams = 2 * max_depth;
  given.light_hits = set.has(technique::hits);
  given.next_event = set.has(technique::nee);
  given.connections = set.has(technique::connect);
  given.splats = given.stored_splats = set.has(technique::splat);
  given.surface_points = set.has(technique::surf);
  given.volume_points = set.has(technique::pp3d);
  given.beam_points = set.has(technique::pb2d);
  given.beams = set.has(technique::bb1d);
  return given;
}

/// Vertex connection and merging.
constexpr technique_set connection_and_merging() {
  technique_set set;
  set.add(technique::surf);
  return set;
}

/// Unified points, beams and paths.
constexpr technique_set points_beams_and_paths() {
  technique_set set = connection_and_merging();
  set.add({technique::pp3d, technique::pb2d, technique::bb1d});
  return set;
}

/// Light tracing: the camera sees lights, and light paths find the rest.
constexpr technique_set light_tracing() {
  return {technique::splat};
}

}  // namespace render
