// Ways of bidirectional methods to find light, and their options.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/light/light_vertices.hpp>
#include <wfpg/light/photon_estimators.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>

namespace render {

/// A way to find light.
enum class technique : std::uint8_t {
  hits,     ///< camera paths hit lights
  nee,      ///< light samples at vertices of camera paths
  connect,  ///< vertices of light and camera paths are connected
  splat,    ///< vertices of light paths are connected to the camera
  surf,     ///< vertices of all light paths are merged with near ones of camera paths, on surfaces
  pp3d,     ///< the same in media
  pb2d,     ///< vertices of all light paths in media are merged with near segments of camera paths
  bb1d,     ///< segments of light paths in media are merged with near segments of camera paths
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
  /// Whether camera paths read vertices of light paths.
  constexpr bool needs_light_vertices() const {
    return has(technique::connect) || has(technique::surf) || has(technique::pp3d) || has(technique::pb2d);
  }
  constexpr bool needs_light_paths() const {
    return needs_light_vertices() || has(technique::splat) || has(technique::bb1d);
  }

 private:
  WFPG_HD static constexpr std::uint32_t bit(technique t) { return 1u << static_cast<int>(t); }

  std::uint32_t on_ = 0;
};

/// Techniques that have a picture of their own. Lights that the camera sees count as hits, whatever is on.
constexpr technique_set pictured(technique_set on) {
  on.add(technique::hits);
  return on;
}

/// Options of light paths and of merges. Radii are of the first sample, over the scene's radius; above 0, at
/// most 1.
struct light_path_options {
  std::size_t memory = wfpg::light_vertices_options().budget_bytes;  ///< bytes of vertices, and of beams
  float merge_radius = 0.003f;                                       ///< on surfaces
  float volume_radius = 0.002f;                                      ///< in media
  float radius_alpha = wfpg::radius_schedule().alpha;                ///< as in radius_schedule
  /// Light paths of a sample that leave beams, at least 1. Unset: one in 64, at most 8192.
  std::optional<std::uint32_t> beam_paths;

  /// Light paths that leave beams, of as many.
  std::size_t beam_paths_of(std::size_t paths) const {
    const std::size_t own = std::min<std::size_t>((paths + 63) / 64, 8192);
    return std::min<std::size_t>(beam_paths ? *beam_paths : own, paths);
  }
};

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
