// Options, radii, statistics and memory of light/bidirectional.hpp. Cheap to include.
//
// Cost: none. Memory: that of a few numbers.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/light/photon_estimators.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace wfpg {

/// Options of bidirectional. Techniques are as in path_techniques. By default they are those of vertex
/// connection and merging. The host must sample each technique that is on: weights leave a share of the
/// light to it. Splats need a wfpg::splats of the host's own.
struct bidirectional_options {
  std::size_t paths = 0;  ///< light paths of an iteration, at least 1, below 2^32 - 1
  /// Vertices a path for which memory is allocated at most, at least 1. A path may have more where others
  /// have fewer.
  std::uint32_t max_vertices = 8;
  std::uint32_t max_beams = 16;  ///< likewise of beams, a path that leaves any
  /// Most beams that a path leaves between two calls of reserve(), at least 1: media on one segment. Each
  /// takes sizeof(Beam) bytes for each path that leaves beams, beside the budget.
  std::uint32_t segment_beams = 8;
  /// Most memory for vertices, and as much for beams, bytes: room for one at least. No more is allocated than
  /// max_vertices and max_beams need. What paths take, and maps, is not counted.
  std::size_t budget_bytes = std::size_t(4) << 30;

  bool light_hits = true;      ///< camera paths hit lights
  bool next_event = true;      ///< a light sample at each vertex of a camera path
  bool connections = true;     ///< vertices of a light and a camera path are connected
  bool splats = true;          ///< vertices of light paths are connected to the camera
  bool stored_splats = false;  ///< that is done with stored vertices, which are kept for that alone, too
  bool surface_points = true;  ///< merges on surfaces (P-P2D)
  bool volume_points = false;  ///< merges of points in media (P-P3D)
  bool beam_points = false;    ///< merges of points with camera beams in media (P-B2D)
  bool beams = false;          ///< merges of beams in media (B-B1D)

  // Radii of the first iteration's merges, over the scene's radius, in (0, 1].
  float surface_radius = 0.003f;                 ///< on surfaces
  float volume_radius = 0.002f;                  ///< in media
  float radius_alpha = radius_schedule().alpha;  ///< how radii shrink, in (0, 1], as in radius_schedule
  /// About how many photons a merge at a point finds at most, at least 1. Where they are denser, some are
  /// left out and others count for them. Fewer take less time, and add noise to caustics.
  std::uint32_t dense_photons = 64;
  // Merges along segments take the longer, the more photons there are, and soon remove no more noise than
  // their time is worth. docs/bidirectional.md has the error with more of them.
  /// Light paths that leave beams, at least 1. More than there are paths means all. Unset: one in 64, at most
  /// 512.
  std::optional<std::size_t> beam_paths;
  /// Light paths whose vertices merge along camera beams, likewise. Unset: all, at most 16384.
  std::optional<std::size_t> beam_point_paths;

  /// Whether stored vertices of light paths are read.
  bool reads_vertices() const {
    return connections || surface_points || volume_points || beam_points || (splats && stored_splats);
  }
  /// Whether photons are merged.
  bool merges() const { return surface_points || volume_points || beam_points || beams; }
  /// Number of light paths that leave beams. 0 where beams are off.
  std::size_t count_beam_paths() const {
    if (!beams) return {};
    return std::min(beam_paths.value_or(std::min<std::size_t>((paths + 63) / 64, 512)), paths);
  }
  /// Number of light paths whose vertices merge along camera beams. 0 where these merges are off.
  std::size_t count_beam_point_paths() const {
    if (!beam_points) return {};
    return std::min<std::size_t>(beam_point_paths.value_or(16384), paths);
  }
};

/// Throws std::invalid_argument that names the option out of range. bidirectional's constructor calls it.
inline void require_in_range(const bidirectional_options& options) {
  const auto require_fraction = [](float value, const char* name) {
    require(value > 0.0f && value <= 1.0f, name, value, "above 0, at most 1");
  };
  const auto require_some = [](std::size_t value, const char* name) {
    require(value > 0, name, value, "at least 1");
  };
  require(options.paths > 0 && options.paths < 0xffffffffu, "bidirectional_options.paths", options.paths,
          "at least 1, less than 2^32 - 1");
  require_some(options.max_vertices, "bidirectional_options.max_vertices");
  require_some(options.max_beams, "bidirectional_options.max_beams");
  require_some(options.segment_beams, "bidirectional_options.segment_beams");
  require_some(options.dense_photons, "bidirectional_options.dense_photons");
  require_some(options.beam_paths.value_or(1), "bidirectional_options.beam_paths");
  require_some(options.beam_point_paths.value_or(1), "bidirectional_options.beam_point_paths");
  require_fraction(options.surface_radius, "bidirectional_options.surface_radius");
  require_fraction(options.volume_radius, "bidirectional_options.volume_radius");
  require_fraction(options.radius_alpha, "bidirectional_options.radius_alpha");
}

/// Radii of an iteration's merges, scene units. 0 where a technique is off.
struct merge_radii {
  float surface = 0.0f;      ///< on surfaces
  float volume = 0.0f;       ///< of points in media
  float beam_points = 0.0f;  ///< of points with camera beams
  float beams = 0.0f;        ///< of beams with camera beams
};

/// Returns the radii of an iteration. They are kept above 1e-15 scene units, and above 1e-12 for points in
/// media, so that their volumes are normal floats.
/// `iteration`: from 1. `scene_radius`: as bidirectional::begin_iteration() takes it.
inline merge_radii radii_of(const bidirectional_options& options, std::uint32_t iteration,
                            float scene_radius) {
  const auto radius = [&](bool is_on, float first, int dimension) {
    const radius_schedule schedule{first * scene_radius, options.radius_alpha, dimension};
    return is_on ? std::max(schedule(iteration), dimension == 3 ? 1.0e-12f : least_merge_radius) : 0.0f;
  };
  merge_radii radii;
  radii.surface = radius(options.surface_points, options.surface_radius, 2);
  radii.volume = radius(options.volume_points, options.volume_radius, 3);
  radii.beam_points = radius(options.beam_points, options.volume_radius, 2);
  radii.beams = radius(options.beams, options.volume_radius, 1);
  return radii;
}

/// Numbers of an iteration's vertices, beams and photons, and its radii. A technique that is off has no
/// photons.
struct bidirectional_statistics {
  std::uint32_t vertices = 0;            ///< stored
  std::uint32_t dropped_vertices = 0;    ///< without memory: their light is missing
  std::uint32_t beams = 0;               ///< stored
  std::uint32_t dropped_beams = 0;       ///< without memory: their light is missing
  std::uint32_t surplus_beams = 0;       ///< beyond segment_beams: their light is missing
  std::uint32_t surface_photons = 0;     ///< of merges on surfaces, without those left out as dense
  std::uint32_t volume_photons = 0;      ///< of merges at points in media, likewise
  std::uint32_t beam_point_photons = 0;  ///< of merges along camera beams
  std::uint32_t beam_pieces = 0;         ///< of all beams
  merge_radii radii;                     ///< of the iteration
};

/// Bytes that bidirectional holds.
struct bidirectional_memory {
  std::size_t vertices = 0;  ///< of the store of vertices
  std::size_t beams = 0;     ///< of the store of beams, and of those without a place yet
  /// Of trees, photons in their order, and copied positions and beams: those of the largest iteration so far.
  std::size_t maps = 0;

  std::size_t total() const { return vertices + beams + maps; }  ///< of all three
};

}  // namespace wfpg
