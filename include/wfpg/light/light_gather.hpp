// How kernels of camera paths find light: the view that bidirectional::gather() returns. It has the vertices
// of light paths, for connections, and finds the photons that merge with a camera path's vertices and
// segments.
//
//   gather.merge_on_surface(p, [&](const Photon& photon, const photon_merge& at) {
//     const float f = bsdf.eval(outgoing, photon.incident);    // with the cosine
//     radiance += throughput * photon.flux * at.scale * weight(photon) * f / cosine(photon.incident);
//   });
//
// Weights are those of light/path_weights.hpp, with the counts of bidirectional::techniques().
//
// Source: Krivanek et al. 2014, "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation".
// Kernels are constant at points and of Epanechnikov's shape along beams.
// Cost: that of photon_map and beam_map. Memory: that of light/bidirectional.hpp.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/light/beam_map.hpp>
#include <wfpg/light/light_vertices.hpp>
#include <wfpg/light/photon_estimators.hpp>
#include <wfpg/light/photon_map.hpp>

#include <cstdint>
#include <type_traits>

namespace wfpg {

/// How a photon counts where it merges with a camera path.
struct photon_merge {
  /// Factor of the photon's flux: the kernel over the number of light paths, and over the sine where beams
  /// merge. Of photons that do not carry it, also the number that they count for. Unit: scene units to the
  /// power of -2 on surfaces and along camera beams, -3 at points in media, and -1 where beams merge.
  float scale = 0.0f;
  float t_camera = 0.0f;    ///< where it is on the camera beam, scene units from its origin; 0 at points
  float t_light = 0.0f;     ///< where it is on the photon beam; 0 for points
  float sine = 1.0f;        ///< between two beams, in (0, 1]; 1 where one is a point
  std::uint32_t index = 0;  ///< of the photon in vertices(), of the beam in beams()
};

namespace detail {

/// Whether a photon takes the number that it counts for when it is made. If not, merges look it up.
template <class Vertex, class Photon>
inline constexpr bool carries_count = std::is_constructible_v<Photon, const Vertex&, float>;

/// A photon map, and its photons in the order of its places.
template <class Photon>
struct placed_photons {
  photon_map_view map;
  array_view<const Photon> photons;
  float scale = 0.0f;  ///< of merges: at points with the kernel
};

}  // namespace detail

/// Finds what an iteration's light paths have left. Trivially copyable. Valid until the next iteration
/// begins. Techniques that are off find nothing. The order of calls depends on light paths and the query
/// alone. Positions and beams that are not finite merge with nothing.
template <class Vertex, class Photon, class Beam>
class light_gather_view {
 public:
  /// Finds nothing.
  light_gather_view() = default;

  /// The stored vertices, for connections: those of a path from last(path) back by previous(i), to `none`.
  WFPG_HD const light_vertices_view<Vertex>& vertices() const { return vertices_; }
  /// The stored beams.
  WFPG_HD const light_vertices_view<Beam>& beams() const { return beams_; }

  /// Calls f(const Photon&, const photon_merge&) for each vertex on a surface that is within the radius of a
  /// point (P-P2D). A BSDF that includes the cosine is to be divided by it: that of the geometric normal and
  /// the photon's direction.
  template <class F>
  WFPG_HD void merge_on_surface(vec3 p, const F& f) const {
    merge_at(on_surfaces_, p, f);
  }
  /// Calls f(const Photon&, const photon_merge&) for each vertex in a medium that is within the radius of a
  /// point in one (P-P3D). The photon may lie in another medium. Where both paths have the scattering
  /// coefficient in what they carry, divide by it.
  template <class F>
  WFPG_HD void merge_in_medium(vec3 p, const F& f) const {
    merge_at(in_media_, p, f);
  }
  /// Calls f(const Photon&, const photon_merge&) for each vertex in a medium along a camera beam (P-B2D), of
  /// those paths that bidirectional_options::beam_point_paths says.
  /// `camera`: a part of the camera path in one medium, begin at least 0.
  template <class F>
  WFPG_HD void merge_points_along(const path_beam& camera, const F& f) const {
    const detail::placed_photons<Photon>& near = for_beams_;
    near.map.for_each_place_along(
        camera, merge_kernel::epanechnikov, [&](std::uint32_t place, const merge_geometry& at) {
          f(near.photons[place],
            photon_merge{at.kernel * near.scale, at.t_camera, 0.0f, 1.0f, near.map.index(place)});
        });
  }
  /// Calls f(const Beam&, const photon_merge&) for each stored beam along a camera beam (B-B1D).
  /// `camera`: a part of the camera path in one medium, begin at least 0.
  template <class F>
  WFPG_HD void merge_beams_along(const path_beam& camera, const F& f) const {
    beam_map_.for_each_beam_along(
        camera, merge_kernel::epanechnikov, [&](std::uint32_t beam, const merge_geometry& at) {
          f(beams_[beam],
            photon_merge{at.kernel * beam_scale_ / at.sine, at.t_camera, at.t_light, at.sine, beam});
        });
  }

 private:
  template <class E, class V, class P, class B>
  friend class bidirectional;

  /// Merges at a point: calls f for each photon within the radius. The kernel is constant.
  /// Most photons carry what they count for.
  template <class F>
  WFPG_HD static void merge_at(const detail::placed_photons<Photon>& near, vec3 p, const F& f) {
    near.map.for_each_place(p, [&](std::uint32_t place) {
      const float count = detail::carries_count<Vertex, Photon> ? 1.0f : near.map.weight(place);
      f(near.photons[place], photon_merge{near.scale * count, 0.0f, 0.0f, 1.0f, near.map.index(place)});
    });
  }

  light_vertices_view<Vertex> vertices_;
  // Empty where a technique is off, and before the maps are built.
  detail::placed_photons<Photon> on_surfaces_, in_media_, for_beams_;
  light_vertices_view<Beam> beams_;
  beam_map_view beam_map_;
  float beam_scale_ = 0.0f;  // 1 over the light paths that leave beams
};

}  // namespace wfpg
