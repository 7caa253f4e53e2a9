// The kernels and requirements of light/bidirectional.hpp.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/light/light_gather.hpp>
#include <wfpg/light/light_recorder.hpp>
#include <wfpg/light/light_vertices.hpp>
#include <wfpg/light/photon_estimators.hpp>
#include <wfpg/light/photon_map.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace wfpg::detail {

/// Detects position() and in_medium() of a vertex.
template <class V, class = void>
struct is_light_vertex : std::false_type {};
template <class V>
struct is_light_vertex<V, std::void_t<decltype(vec3(std::declval<const V&>().position())),
                                      decltype(bool(std::declval<const V&>().in_medium()))>>
    : std::is_trivially_copyable<V> {};

/// Detects the member `beam`.
template <class B, class = void>
struct is_photon_beam : std::false_type {};
template <class B>
struct is_photon_beam<B, std::void_t<decltype(path_beam(std::declval<const B&>().beam))>>
    : std::is_trivially_copyable<B> {};

/// Asserts that a host's types are as bidirectional takes them. Each that is not is an error of one sentence.
/// Returns true, so that it can stand in a static_assert.
template <class Vertex, class Photon, class Beam>
constexpr bool require_light_types() {
  static_assert(
      is_light_vertex<Vertex>::value,
      "Vertex: needs vec3 position() const and bool in_medium() const, and to be trivially copyable");
  static_assert(std::is_default_constructible_v<Vertex> && std::is_default_constructible_v<Photon> &&
                    std::is_default_constructible_v<Beam>,
                "Vertex, Photon and Beam: need a default constructor");
  static_assert(std::is_copy_assignable_v<Photon> && std::is_copy_assignable_v<Beam>,
                "Photon and Beam: need to be assignable");
  constexpr bool is_made = std::is_constructible_v<Photon, const Vertex&> || carries_count<Vertex, Photon>;
  static_assert(is_made && std::is_trivially_copyable_v<Photon>,
                "Photon: needs a constructor from a Vertex, and to be trivially copyable");
  static_assert(is_photon_beam<Beam>::value,
                "Beam: needs a member path_beam beam, and to be trivially copyable");
  return true;
}

/// Kernel: copies the positions of vertices on surfaces or in media, for a photon map. The map skips others,
/// and those of paths from `paths` on.
template <class Vertex>
struct copy_photon_positions {
  light_vertices_view<Vertex> vertices;
  bool in_media;
  std::size_t paths;
  array_view<vec3> positions;
  WFPG_HD void operator()(std::size_t i) const {
    const auto k = static_cast<std::uint32_t>(i);
    positions[i] = vec3(2.0f * largest_coordinate);
    if (vertices.path(k) >= paths) return;
    const Vertex& vertex = vertices[k];
    if (vertex.in_medium() == in_media) positions[i] = vertex.position();
  }
};

/// Kernel: makes photons in the order of a map's places.
template <class Vertex, class Photon>
struct place_photons {
  light_vertices_view<Vertex> vertices;
  photon_map_view map;
  array_view<Photon> photons;
  WFPG_HD void operator()(std::size_t place) const {
    const auto k = static_cast<std::uint32_t>(place);
    const Vertex& vertex = vertices[map.index(k)];
    if constexpr (carries_count<Vertex, Photon>)
      photons[place] = Photon(vertex, map.weight(k));
    else
      photons[place] = Photon(vertex);
  }
};

/// Kernel: stores the beams of a path that have a place, and forgets all that it left.
template <class Beam>
struct store_beams {
  pending_beams<Beam> pending;
  light_vertices_view<Beam> stored;
  WFPG_HD void operator()(std::size_t path) const {
    for (std::uint32_t k = 0; k < pending.counts[path] && stored.has_place(path, k); ++k)
      stored.write(path, pending.beams[path * pending.most + k], k);
    pending.counts[path] = 0;
  }
};

/// Kernel: copies the geometry of stored beams, for a beam map.
template <class Beam>
struct copy_beams {
  light_vertices_view<Beam> stored;
  array_view<path_beam> beams;
  WFPG_HD void operator()(std::size_t i) const { beams[i] = stored[static_cast<std::uint32_t>(i)].beam; }
};

}  // namespace wfpg::detail
