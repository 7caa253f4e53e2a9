// A recorded path as guides read it at the end of a sample, and the radiance that left its vertices.
//
// Source: Yalçıner & Akyüz, "Path Guiding for Wavefront Path Tracing", 2024, Eq. 5.
// Cost: a call reads one value of a vertex. Memory: none; it reads the recorder's.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/guide/path_recorder.hpp>

namespace wfpg {

/// One recorded path, for guides to read. Its vertices are the surfaces that it met, in order, and gaps where
/// depths were left out. Position, outgoing direction and direction of a gap mean nothing. The environment is
/// the last vertex if escape() recorded it. Valid until the recorder's begin_sample() or clear().
/// Precondition of members with a `depth`: it is below vertices(), or surfaces() where they say "surface".
class recorded_path {
 public:
  /// Reads path `place` of the recorded ones, in [0, path_recorder::recorded()).
  WFPG_HD recorded_path(const path_recorder_view& paths, std::size_t place)
      : paths_(paths),
        place_(place),
        surfaces_(paths.lengths_[place] & path_recorder_view::length_mask),
        vertices_(surfaces_),
        flags_(paths.lengths_[place] & ~path_recorder_view::length_mask) {
    if (flags_ & path_recorder_view::escaped) --surfaces_;
  }

  /// Number of vertices, including the environment; 0 for a path that recorded none.
  WFPG_HD std::uint32_t vertices() const { return vertices_; }
  /// Number of vertices that are surfaces or gaps: depths [0, surfaces()).
  WFPG_HD std::uint32_t surfaces() const { return surfaces_; }
  /// Whether a depth below surfaces() was left out. Nothing else is known of such a vertex.
  /// A path without gaps answers without reading the vertex.
  WFPG_HD bool is_gap(std::uint32_t depth) const {
    return (flags_ & path_recorder_view::gaps) != 0 && paths_.places_[slot(depth)].outgoing == 0;
  }
  /// Number of surfaces that are not gaps.
  /// O(1) for a path without gaps, else it reads all vertices.
  WFPG_HD std::uint32_t known_surfaces() const {
    if ((flags_ & path_recorder_view::gaps) == 0) return surfaces_;
    std::uint32_t n = 0;
    for (std::uint32_t depth = 0; depth < surfaces_; ++depth) n += is_gap(depth) ? 0u : 1u;
    return n;
  }

  /// Position of a surface, world space. It is what the renderer recorded, so it may be not finite.
  WFPG_HD vec3 position(std::uint32_t depth) const { return paths_.places_[slot(depth)].position; }
  /// Unit direction from a surface toward the previous vertex, as pack_direction() rounds it.
  WFPG_HD vec3 outgoing(std::uint32_t depth) const {
    return unpack_direction(paths_.places_[slot(depth)].outgoing);
  }
  /// Throughput of the path before a vertex scatters, linear RGB.
  /// Grey where the host gave a number.
  WFPG_HD vec3 throughput(std::uint32_t depth) const { return paths_.light_[slot(depth)].throughput; }
  /// What a vertex itself brought to the path's origin, linear RGB: its emission, and the light that
  /// next-event estimation sampled there. Sum the vertices from `depth` on for all that arrives from there.
  WFPG_HD vec3 contribution(std::uint32_t depth) const { return paths_.light_[slot(depth)].contribution; }
  /// sampled_direction::field of the direction that scatter() recorded, or no_field. Precondition: the
  /// recorder records directions.
  WFPG_HD std::uint32_t field(std::uint32_t depth) const { return paths_.directions_[slot(depth)].field; }
  /// Share of the guide in the density of the direction that scatter() recorded. It is unknown where the host
  /// did not say, as for delta lobes. Preconditions: the recorder records directions, and the direction has a
  /// field.
  WFPG_HD guide_share share(std::uint32_t depth) const { return guide_share(paths_.shares_[slot(depth)]); }
  /// Writes the unit direction in which the path left a surface. It is the direction toward the next surface,
  /// or else that of scatter(). False where neither is known. Precondition: the recorder records directions.
  WFPG_HD bool has_direction(std::uint32_t depth, vec3& direction) const {
    if (depth + 1 < surfaces_) {
      direction = -outgoing(depth + 1);
      return true;
    }
    direction = this->direction(depth);
    return has_scattered(depth);
  }
  /// Whether scatter() recorded a direction at a surface or a gap.
  /// False where the host never told of one. Where it is true, direction() may be called.
  /// Precondition: records_directions() of the recorder.
  WFPG_HD bool has_scattered(std::uint32_t depth) const {
    return paths_.directions_[slot(depth)].direction != 0;
  }
  /// Unit direction that scatter() recorded. Precondition: directions are recorded, and scatter() was called.
  WFPG_HD vec3 direction(std::uint32_t depth) const {
    return unpack_direction(paths_.directions_[slot(depth)].direction);
  }

 private:
  /// Index of a vertex in the recorder's arrays. Vertices of one depth lie side by side.
  WFPG_HD std::size_t slot(std::uint32_t depth) const { return depth * paths_.recorded_ + place_; }

  // The recorder's arrays, and the path's place in them.
  path_recorder_view paths_;
  std::size_t place_;
  // These differ by one where the last vertex is the environment, which is no surface.
  std::uint32_t surfaces_, vertices_;
  std::uint32_t flags_;  // of path_recorder_view, in the path's length
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

}  // namespace wfpg
