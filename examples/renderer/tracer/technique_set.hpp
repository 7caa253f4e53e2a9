// Ways of bidirectional methods to find light.
#pragma once

namespace render {

/// Which ways to find light a rendering has. Each finds paths of its own; weights share the others.
struct technique_set {
  bool light_hits = true;   ///< camera paths hit lights
  bool next_event = true;   ///< light samples at vertices of camera paths
  bool connections = true;  ///< vertices of light and camera paths are connected
  bool splats = true;       ///< vertices of light paths are connected to the camera
  bool merges = false;      ///< vertices of all light paths are merged with near ones of camera paths

  bool needs_light_paths() const { return connections || splats || merges; }
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
