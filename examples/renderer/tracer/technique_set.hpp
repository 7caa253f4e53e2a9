// Ways of bidirectional methods to find light, and their options.
#pragma once

#include <wfpg/light/light_vertices.hpp>
#include <wfpg/light/photon_estimators.hpp>

#include <cstddef>

namespace render {

/// Which ways to find light a rendering has. Each finds paths of its own; weights share the others.
struct technique_set {
  bool light_hits = true;   ///< camera paths hit lights
  bool next_event = true;   ///< light samples at vertices of camera paths
  bool connections = true;  ///< vertices of light and camera paths are connected
  bool splats = true;       ///< vertices of light paths are connected to the camera
  bool merges = false;      ///< vertices of all light paths are merged with near ones of camera paths

  /// Whether camera paths read vertices of light paths.
  bool needs_light_vertices() const { return connections || merges; }
  bool needs_light_paths() const { return needs_light_vertices() || splats; }
};

/// Options of light paths and of merges.
struct light_path_options {
  std::size_t memory = wfpg::light_vertices_options().budget_bytes;  ///< bytes of vertices
  float merge_radius = 0.003f;  ///< of the first sample, over the scene's radius; above 0, at most 1
  float radius_alpha = wfpg::radius_schedule().alpha;  ///< as in radius_schedule
};

/// Vertex connection and merging.
constexpr technique_set connection_and_merging() {
  return {true, true, true, true, true};
}

/// Light tracing: the camera sees lights, and light paths find the rest.
constexpr technique_set light_tracing() {
  return {false, false, false, true, false};
}

}  // namespace render
