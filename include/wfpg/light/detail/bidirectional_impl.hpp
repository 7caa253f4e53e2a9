// Members of bidirectional: radii, counts, and the maps of an iteration.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/exec/support/thrust.hpp>
#include <wfpg/light/bidirectional.hpp>

#include <thrust/reduce.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

namespace wfpg {

template <class Exec, class Vertex, class Photon, class Beam>
const bidirectional_options& bidirectional<Exec, Vertex, Photon, Beam>::checked(
    const bidirectional_options& options) {
  require_in_range(options);
  require(!options.beams || !std::is_same_v<Beam, no_beam>, "bidirectional_options.beams",
          std::string("true"), "false, since the host has no type of beams");
  const std::size_t largest = options.beams ? std::max(sizeof(Vertex), sizeof(Beam)) : sizeof(Vertex);
  require(options.budget_bytes >= largest + 2 * sizeof(std::uint32_t), "bidirectional_options.budget_bytes",
          options.budget_bytes, "room for a vertex and for a beam");
  return options;
}

template <class Exec, class Vertex, class Photon, class Beam>
path_techniques bidirectional<Exec, Vertex, Photon, Beam>::counts_of(const merge_radii& radii) const {
  const auto on = [](bool is_on) { return is_on ? 1.0f : 0.0f; };
  const auto disc = [](float r) { return pi * r * r; };
  const auto paths = static_cast<float>(options_.paths);
  path_techniques counts;
  counts.light_hits = on(options_.light_hits);
  counts.next_event = on(options_.next_event);
  counts.connections = on(options_.connections);
  counts.splats = on(options_.splats) * paths;
  counts.surface_points = paths * disc(radii.surface);
  counts.volume_points = paths * disc(radii.volume) * (4.0f / 3.0f) * radii.volume;
  counts.beam_points = static_cast<float>(options_.count_beam_point_paths()) * disc(radii.beam_points);
  counts.beams = static_cast<float>(beam_paths()) * 2.0f * radii.beams;
  return counts;
}

template <class Exec, class Vertex, class Photon, class Beam>
void bidirectional<Exec, Vertex, Photon, Beam>::begin_iteration(std::uint32_t iteration, float scene_radius) {
  require(iteration > 0, "iteration", iteration, "at least 1");
  require(!options_.merges() || (scene_radius > 0.0f && scene_radius <= 1.0e9f), "scene_radius", scene_radius,
          "above 0, at most 1e9");
  iteration_ = iteration;
  radii_ = radii_of(options_, iteration, scene_radius);
  techniques_ = counts_of(radii_);
  is_built_ = false;
  vertices_.begin(exec_);
  beams_.begin(exec_);
  exec_.fill_bytes(pending_counts_.data(), 0, pending_counts_.bytes());
  exec_.fill_bytes(lost_.data(), 0, lost_.bytes());
}

template <class Exec, class Vertex, class Photon, class Beam>
void bidirectional<Exec, Vertex, Photon, Beam>::build() {
  is_built_ = false;
  store_beams();
  const light_vertices_view<Vertex> stored = vertices_.view();
  const std::uint32_t vertices = options_.reads_vertices() ? vertices_.size(exec_) : 0;
  const auto build = [&](placed_map& map, bool in_media, std::size_t paths, float radius,
                         const photon_thinning& thinning) {
    map.build(exec_, positions(vertices, in_media, paths), radius, thinning, stored);
  };
  const photon_thinning dense{options_.dense_photons, iteration_};
  if (options_.surface_points) build(on_surfaces_, false, options_.paths, radii_.surface, dense);
  if (options_.volume_points) build(in_media_, true, options_.paths, radii_.volume, dense);
  // These are few already.
  if (options_.beam_points)
    build(for_beams_, true, options_.count_beam_point_paths(), radii_.beam_points, {});
  if (beam_paths() > 0) build_beams();
  is_built_ = true;
}

template <class Exec, class Vertex, class Photon, class Beam>
void bidirectional<Exec, Vertex, Photon, Beam>::build_beams() {
  const std::uint32_t beams = beams_.size(exec_);
  if (copied_beams_.size() < beams) copied_beams_ = buffer<path_beam, Exec>(exec_, beams_.capacity());
  exec_.for_each(beams, detail::copy_beams<Beam>{beams_.view(), copied_beams_.view()});
  beam_map_options map;
  map.radius = radii_.beams;
  map.max_pieces = std::max<std::size_t>(pieces_a_beam * beams, 1);
  beam_map_.build(exec_, {copied_beams_.data(), beams}, map);
}

template <class Exec, class Vertex, class Photon, class Beam>
auto bidirectional<Exec, Vertex, Photon, Beam>::gather() -> gather_type {
  gather_type found;
  found.vertices_ = vertices_.view();
  if (!is_built_) return found;
  found.on_surfaces_ = on_surfaces_.view(1.0f / techniques_.surface_points);
  found.in_media_ = in_media_.view(1.0f / techniques_.volume_points);
  found.for_beams_ = for_beams_.view(1.0f / static_cast<float>(options_.count_beam_point_paths()));
  found.beams_ = beams_.view();
  found.beam_map_ = beam_map_.view();
  found.beam_scale_ = 1.0f / static_cast<float>(beam_paths());
  return found;
}

template <class Exec, class Vertex, class Photon, class Beam>
bidirectional_statistics bidirectional<Exec, Vertex, Photon, Beam>::statistics() const {
  bidirectional_statistics s;
  s.vertices = vertices_.size(exec_);
  s.dropped_vertices = vertices_.dropped(exec_);
  s.beams = beams_.size(exec_);
  s.dropped_beams = beams_.dropped(exec_);
  const array_view<const std::uint32_t> lost = lost_.view();
  s.surplus_beams = ::thrust::reduce(exec_.thrust(), lost.begin(), lost.end(), 0u);
  s.radii = radii_;
  if (!is_built_) return s;
  s.surface_photons = on_surfaces_.map.view().size();
  s.volume_photons = in_media_.map.view().size();
  s.beam_point_photons = for_beams_.map.view().size();
  s.beam_pieces = beam_map_.view().pieces();
  return s;
}

}  // namespace wfpg
