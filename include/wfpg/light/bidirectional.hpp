// The facade of light from both ends: an iteration's light paths, and the photon maps over them. The host
// traces all paths. Vertices, photons and beams are of its own types.
//
//   bidirectional<Exec, vertex, photon, beam> light(exec, options);
//   for (std::uint32_t iteration = 1; ...; ++iteration) {
//     light.begin_iteration(iteration, scene_radius);
//     for (each depth) {
//       exec.for_each(paths, trace);   // keeps[path] = 1 where its vertex is stored; leaves beams
//       light.reserve(keeps);
//       exec.for_each(paths, scatter); // recorder.write(path, vertex) where recorder.has_place(path)
//     }
//     light.build();
//     exec.for_each(pixels, camera);   // reads light.gather(), weights by light.techniques()
//   }
//
// Each part has a header of its own, for hosts that put it together in another way.
//
// Source: Krivanek et al. 2014, "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation".
// On GPUs: Moonen & Jalba 2023, "Efficient Hardware Acceleration of Robust Volumetric Light Transport
// Simulation", section 5.
//
// Cost: a scan of paths a depth, and a tree for each photon technique.
//
// Memory: sizeof(Vertex) + 8 bytes a vertex, 12 more where photons are merged, and for each technique of
// points sizeof(Photon) + 27 a photon. A beam takes sizeof(Beam) + 40 bytes, and 46 for each of its 16
// pieces. While a tree is built, it takes 164 bytes a photon or piece. A path takes 8 bytes.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/light/beam_map.hpp>
#include <wfpg/light/bidirectional_options.hpp>
#include <wfpg/light/detail/bidirectional_kernels.hpp>
#include <wfpg/light/light_gather.hpp>
#include <wfpg/light/light_recorder.hpp>
#include <wfpg/light/light_vertices.hpp>
#include <wfpg/light/path_weights.hpp>
#include <wfpg/light/photon_estimators.hpp>
#include <wfpg/light/photon_map.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg {

/// The Beam of a host without photon beams.
struct no_beam {
  path_beam beam;  ///< never read
};

/// Owns the light paths of an iteration, and the maps over them. Movable, not copyable; the policy's memory
/// must outlive it. One thread at a time may call it. The same light paths give the same photons in the same
/// order on every policy.
///
/// Vertex: what connections and Photon read of a light path's vertex. It has two members:
///   WFPG_HD vec3 position() const;    world space, scene units
///   WFPG_HD bool in_medium() const;   the path has scattered in a medium there
/// Photon: what merges read of a vertex. It has a WFPG_HD constructor from a Vertex, or one from a Vertex and
///   a float, by which it multiplies the flux that it carries: how many photons it counts for where they are
///   dense. With the first, merges look that number up, and take up to a fifth more time on a GPU.
/// Beam: what merges read of a photon beam. It has a member `path_beam beam`.
/// All are trivially copyable, have a default constructor and can be assigned. Where a part is missing, the
/// compiler's message says which.
template <class Exec, class Vertex, class Photon = Vertex, class Beam = no_beam>
class bidirectional {
  static_assert(exec::detail::require_policy<Exec>());
  static_assert(detail::require_light_types<Vertex, Photon, Beam>());

 public:
  using light_recorder_type = light_recorder_view<Vertex, Beam>;  ///< for kernels of light paths
  using gather_type = light_gather_view<Vertex, Photon, Beam>;    ///< for kernels of camera paths

  /// Allocates stores of vertices and beams. Maps are allocated by build(). Where photons are merged, at most
  /// 2^28 - 1 vertices and 2^24 - 1 beams are stored. Call begin_iteration() before all else. Throws
  /// std::invalid_argument that names the option out of range, and out_of_memory.
  bidirectional(const Exec& exec, const bidirectional_options& options)
      : exec_(exec),
        options_(checked(options)),
        vertices_(exec, {options.reads_vertices() ? options.paths : 0,
                         budget_for<Vertex>(options, options.merges() ? most_photons : ~std::size_t(0)),
                         options.max_vertices}),
        beams_(exec, {options.count_beam_paths(), budget_for<Beam>(options, most_photons / pieces_a_beam),
                      options.max_beams}),
        pending_(exec, options.count_beam_paths() * options.segment_beams),
        pending_counts_(exec, options.count_beam_paths()),
        lost_(exec, options.count_beam_paths()) {
    begin_iteration(1, 1.0f);
  }

  /// Forgets all light paths, and sets the radii of an iteration. Writes 8 bytes a path.
  /// `iteration`: from 1. Radii shrink with it.
  /// `scene_radius`: of a ball around what the camera sees, scene units. Radii are fractions of it. Above 0
  /// and at most 1e9 where photons are merged.
  /// Throws std::invalid_argument where either is out of range.
  void begin_iteration(std::uint32_t iteration, float scene_radius);

  /// How many samples a camera path has of each technique in this iteration, for weights.
  const path_techniques& techniques() const { return techniques_; }

  /// Returns the view with which kernels record light paths. It is valid for this iteration, before and after
  /// reserve().
  light_recorder_type light_recorder() { return {vertices_.view(), pending()}; }

  /// Finds places for the paths' new vertices, and stores the beams that they have left. Call it once a
  /// depth. On a GPU it returns before the work is done. O(paths).
  /// `keeps`: for each path 1 where its new vertex is to be stored, else 0. It is not read where no technique
  /// reads vertices.
  /// Throws as light_vertices::reserve(). After out_of_memory, begin the iteration again.
  void reserve(array_view<const std::uint32_t> keeps) {
    store_beams();
    if (options_.reads_vertices()) vertices_.reserve(exec_, keeps);
  }

  /// Stores beams that were added since the last reserve(), builds the maps of all photon techniques, and
  /// waits. Throws out_of_memory, after which there are no photons: begin the iteration again.
  void build();

  /// Returns the view with which kernels find light, valid for this iteration. Before build() it finds no
  /// photons, and vertices alone.
  gather_type gather();

  /// Numbers of vertices, beams and photons so far, and radii. build() counts photons. Waits for the work
  /// before it.
  bidirectional_statistics statistics() const;
  /// Bytes held, without scratch memory of sorts and scans.
  bidirectional_memory memory() const {
    bidirectional_memory held;
    held.vertices = vertices_.bytes();
    held.beams = beams_.bytes() + pending_.bytes() + pending_counts_.bytes() + lost_.bytes();
    held.maps = positions_.bytes() + on_surfaces_.bytes() + in_media_.bytes() + for_beams_.bytes() +
                copied_beams_.bytes() + beam_map_.bytes();
    return held;
  }
  /// The options that it was made with.
  const bidirectional_options& options() const { return options_; }

 private:
  /// A map over vertices, and photons in the order of its places.
  struct placed_map {
    photon_map<Exec> map;
    buffer<Photon, Exec> photons;

    void build(const Exec& exec, array_view<const vec3> positions, float radius,
               const photon_thinning& thinning, const light_vertices_view<Vertex>& vertices) {
      map.build(exec, positions, radius, thinning);
      const std::uint32_t size = map.view().size();
      if (photons.size() < size) photons = buffer<Photon, Exec>(exec, size);
      exec.for_each(size, detail::place_photons<Vertex, Photon>{vertices, map.view(), photons.view()});
    }
    detail::placed_photons<Photon> view(float scale) const { return {map.view(), photons.view(), scale}; }
    std::size_t bytes() const { return map.bytes() + photons.bytes(); }
  };

  /// Samples a camera path, with the volumes of merges.
  path_techniques counts_of(const merge_radii& radii) const;
  /// Builds the map of beams.
  void build_beams();

  std::size_t beam_paths() const { return pending_counts_.size(); }
  detail::pending_beams<Beam> pending() {
    return {pending_.view(), pending_counts_.view(), lost_.view(), options_.segment_beams};
  }
  /// Stores the beams that have no place yet.
  void store_beams() {
    if (beam_paths() == 0) return;
    beams_.reserve(exec_, pending_counts_.view());
    exec_.for_each(beam_paths(), detail::store_beams<Beam>{pending(), beams_.view()});
  }
  /// The positions of the stored vertices, as many, in media or on surfaces, of the first paths.
  array_view<const vec3> positions(std::uint32_t vertices, bool in_media, std::size_t paths) {
    if (positions_.size() < vertices) positions_ = buffer<vec3, Exec>(exec_, vertices_.capacity());
    exec_.for_each(vertices, detail::copy_photon_positions<Vertex>{vertices_.view(), in_media, paths,
                                                                   positions_.view()});
    return {positions_.data(), vertices};
  }

  // Fewer leave boxes empty: 6 took up to 1.3 of the time on a GPU, and 2 took 2.8. 48 took up to 1.2.
  static constexpr std::size_t pieces_a_beam = 16;
  // A map takes as many photons, or pieces of beams.
  static constexpr std::size_t most_photons = (std::size_t(1) << 28) - 1;

  // Before memory is asked for.
  static const bidirectional_options& checked(const bidirectional_options& options);
  /// The budget, or what `most` of T take where that is less.
  template <class T>
  static std::size_t budget_for(const bidirectional_options& options, std::size_t most) {
    constexpr std::size_t each = sizeof(T) + 2 * sizeof(std::uint32_t);
    return options.budget_bytes / each < most ? options.budget_bytes : most * each;
  }

  Exec exec_;
  bidirectional_options options_;
  light_vertices<Exec, Vertex> vertices_;
  light_vertices<Exec, Beam> beams_;
  // By path that leaves beams: those without a place yet, their number, and those beyond segment_beams.
  buffer<Beam, Exec> pending_;
  buffer<std::uint32_t, Exec> pending_counts_, lost_;
  buffer<vec3, Exec> positions_;  // of vertices
  buffer<path_beam, Exec> copied_beams_;
  placed_map on_surfaces_, in_media_, for_beams_;
  beam_map<Exec> beam_map_;
  std::uint32_t iteration_ = 0;
  merge_radii radii_;
  path_techniques techniques_;
  bool is_built_ = false;
};

}  // namespace wfpg

#include <wfpg/light/detail/bidirectional_impl.hpp>
