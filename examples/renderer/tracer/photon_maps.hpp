// The vertices and beams that a sample's light paths leave, and the maps that find them.
#pragma once

#include "tracer/light_kernels.hpp"
#include "tracer/merge_kernels.hpp"
#include "tracer/wavefront.hpp"

#include <wfpg/exec/buffer.hpp>
#include <wfpg/light/beam_map.hpp>
#include <wfpg/light/photon_estimators.hpp>
#include <wfpg/light/photon_map.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace render {

/// Radii of a sample's merges, scene units.
struct merge_radii {
  float on_surfaces, in_media, for_beams, of_beams;

  /// `extent`: radius of the scene. `sample`: from 0. `least`: photon_map's smallest radius.
  merge_radii(const light_path_options& options, float extent, std::uint32_t sample, float least) {
    const auto radius = [&](float first, int dimension) {
      const wfpg::radius_schedule schedule{first * extent, options.radius_alpha, dimension};
      return glm::max(schedule(sample + 1), least);
    };
    on_surfaces = radius(options.merge_radius, 2);
    in_media = radius(options.volume_radius, 3);
    for_beams = radius(options.volume_radius, 2);
    of_beams = radius(options.volume_radius, 1);
  }
};

/// Owns what light paths leave in a sample, in a policy's memory.
template <class Exec>
class photon_maps {
 public:
  /// A light path a pixel.
  photon_maps(const Exec& exec, const tracer_settings& settings)
      : exec_(exec),
        techniques_(settings.techniques),
        beam_paths_(techniques_.has(technique::bb1d) ? settings.light.beam_paths_of(settings.pixels()) : 0),
        stored_(exec, {techniques_.needs_light_vertices() ? settings.pixels() : 0, settings.light.memory,
                       std::max(settings.max_depth, 2u) - 1}),
        beams_(exec, {beam_paths_, settings.light.memory, 2 * settings.max_depth}),
        pending_(exec, beam_paths_ * most_beams),
        pending_counts_(exec, beam_paths_) {}

  /// Number of light paths that leave beams.
  std::size_t beam_paths() const { return beam_paths_; }

  /// Forgets all of the sample before.
  void begin() {
    stored_.begin(exec_);
    beams_.begin(exec_);
  }
  /// Finds places for the vertices that paths keep and for the beams that they have left. Stores the beams.
  void reserve(wfpg::array_view<const std::uint32_t> keeps) {
    if (techniques_.needs_light_vertices()) stored_.reserve(exec_, keeps);
    if (beam_paths_ == 0) return;
    beams_.reserve(exec_, pending_counts_.view());
    exec_.for_each(beam_paths_, store_beams{pending(), beams_.view()});
  }
  pending_beams pending() { return {pending_.view(), pending_counts_.view()}; }
  wfpg::light_vertices_view<subpath_vertex> stored() { return stored_.view(); }

  /// Builds the maps that merges need, and waits.
  void build(const merge_radii& radii) {
    if (techniques_.has(technique::surf))
      on_surfaces_.build(exec_, positions(false), radii.on_surfaces, stored());
    if (techniques_.has(technique::pp3d)) in_media_.build(exec_, positions(true), radii.in_media, stored());
    if (techniques_.has(technique::pb2d)) for_beams_.build(exec_, positions(true), radii.for_beams, stored());
    if (beam_paths_ > 0) build_beams(radii.of_beams);
  }

  photon_view view() {
    return {on_surfaces_.view(), in_media_.view(), for_beams_.view(), beams_.view(), beam_map_.view()};
  }

  /// Vertices and beams of this sample that had no memory. Waits.
  std::uint64_t dropped() const { return std::uint64_t(stored_.dropped(exec_)) + beams_.dropped(exec_); }
  /// Bytes of all vertices and beams, and of the maps of the largest sample so far.
  std::size_t bytes() const {
    return stored_.bytes() + beams_.bytes() + pending_.bytes() + positions_.bytes() + on_surfaces_.bytes() +
           in_media_.bytes() + for_beams_.bytes() + copied_beams_.bytes() + beam_map_.bytes();
  }

 private:
  /// A map of stored vertices, and what merges read of them.
  struct placed_map {
    wfpg::photon_map<Exec> map;
    wfpg::buffer<photon, Exec> photons;

    void build(const Exec& exec, wfpg::array_view<const vec3> positions, float radius,
               const wfpg::light_vertices_view<subpath_vertex>& stored) {
      map.build(exec, positions, radius);
      const std::uint32_t size = map.view().size();
      if (photons.size() < size) photons = wfpg::buffer<photon, Exec>(exec, size);
      exec.for_each(size, place_photons{stored, map.view(), photons.view()});
    }
    placed_photons view() const { return {map.view(), photons.view()}; }
    std::size_t bytes() const { return map.bytes() + photons.bytes(); }
  };

  /// The positions of the stored vertices in media, or on surfaces.
  wfpg::array_view<const vec3> positions(bool in_media) {
    const std::uint32_t photons = stored_.size(exec_);
    if (positions_.size() < photons) positions_ = wfpg::buffer<vec3, Exec>(exec_, stored_.capacity());
    exec_.for_each(photons, copy_positions{stored_.view(), in_media, positions_.view()});
    return {positions_.data(), photons};
  }

  void build_beams(float radius) {
    const std::uint32_t beams = beams_.size(exec_);
    if (copied_beams_.size() < beams)
      copied_beams_ = wfpg::buffer<wfpg::path_beam, Exec>(exec_, beams_.capacity());
    exec_.for_each(beams, copy_beams{beams_.view(), copied_beams_.view()});
    wfpg::beam_map_options options;
    options.radius = radius;
    options.max_pieces = std::max<std::size_t>(pieces_a_beam * beams, 1);
    beam_map_.build(exec_, {copied_beams_.data(), beams}, options);
  }

  // Fewer leave boxes empty: 6 took up to 1.3 of the time on a GPU, and 2 took 2.8. 48 took up to 1.2.
  static constexpr std::size_t pieces_a_beam = 16;

  Exec exec_;
  technique_set techniques_;
  std::size_t beam_paths_;
  wfpg::light_vertices<Exec, subpath_vertex> stored_;
  wfpg::light_vertices<Exec, light_beam> beams_;
  wfpg::buffer<light_beam, Exec> pending_;
  wfpg::buffer<std::uint32_t, Exec> pending_counts_;
  wfpg::buffer<vec3, Exec> positions_;  // of stored vertices
  wfpg::buffer<wfpg::path_beam, Exec> copied_beams_;
  placed_map on_surfaces_, in_media_, for_beams_;
  wfpg::beam_map<Exec> beam_map_;
};

}  // namespace render
