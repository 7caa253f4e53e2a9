// The bidirectional path tracer. In one sample each pixel has a light path and a camera path. All paths go
// from vertex to vertex as a wave. Light comes from hits of lights, from light samples, from connections of
// the two paths, and from connections of light paths to the camera. Vertices of camera paths can be merged
// with those of all light paths, too.
//
// Sources: Veach 1997, chapter 10; Georgiev et al. 2012, "Light Transport Simulation with Vertex Connection
// and Merging"; weights as in <wfpg/light/path_weights.hpp>.
#pragma once

#include "tracer/camera_kernels.hpp"
#include "tracer/join_list.hpp"
#include "tracer/light_kernels.hpp"
#include "tracer/merge_kernels.hpp"
#include "tracer/path_film.hpp"
#include "tracer/stage_clock.hpp"
#include "tracer/stored_sizes.hpp"
#include "tracer/technique_film.hpp"
#include "tracer/unguided.hpp"
#include "tracer/wavefront.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/exec/index_list.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/light/bidirectional.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace render {

/// Renders samples of a scene. Caster: an inline caster as path_tracer's.
///
/// One seed gives one picture on any number of threads: splats are added in the order of stored vertices.
/// Observer: as no_observer.
template <class Exec, class Caster, class Observer>
class observed_bidirectional_tracer {
  static_assert(wfpg::is_inline_caster_v<Caster>);
  using world_type = bidirectional_world<Caster, Observer>;

 public:
  observed_bidirectional_tracer(const Exec& exec, const tracer_settings& settings, const path_lights& world,
                                const Caster& caster, const Observer& observer = {})
      : exec_(exec),
        settings_(settings),
        count_(settings.pixels()),
        world_(world_of(settings, world, caster)),
        paths_(exec, count_),
        vertices_(exec, count_),
        keeps_(exec, count_),
        active_(exec, count_),
        joined_(exec, count_),
        radiance_(exec, count_),
        light_(exec, light_of(settings, world.next_event)),
        splats_(exec, splats_at_a_time(), count_),
        in_view_(exec, splats_at_a_time()),
        sizes_(exec, settings.max_depth),
        joins_(exec, light_.options().next_event ? count_ : 0,
               settings.techniques.has(technique::connect) ? stored().capacity() : 0),
        around_camera_(exec, std::vector<solid_stack>(1)),
        around_lights_(exec,
                       std::vector<solid_stack>(world.scene.has_solids ? world.lights.lights.size() : 0)),
        film_(exec, count_),
        by_technique_(exec, count_, settings.technique_pictures, splats_at_a_time()),
        clock_(exec) {
    world_.observer = observer;
    exec_.for_each(around_lights_.size(), find_light_solids<world_type>{world_, around_lights_.view()});
  }

  /// Renders sample number `sample` (from 0) of each pixel with `weight` >= 0 in the picture, and waits.
  void render_sample(no_guide, const pinhole& camera, std::uint32_t sample, float weight) {
    world_.random = {settings_.seed, sample};
    exec_.fill_bytes(radiance_.data(), 0, radiance_.bytes());
    begin_light(camera, sample);
    world_.techniques = light_.techniques();
    by_technique_.begin();
    if (settings_.techniques.needs_light_paths()) follow_light(camera, sample);
    if (settings_.techniques.merges()) clock_.measure("photon map", [&] { light_.build(); });
    follow_camera(camera);
    clock_.measure("film", [&] {
      film_.add(radiance_.view(), weight);
      by_technique_.add(weight);
    });
    // It waits, so that a look at the time sees the whole sample.
    count_dropped();
    clock_.resolve();
  }

  /// The samples so far.
  const path_film<Exec>& film() const { return film_; }
  path_film<Exec>& film() { return film_; }

  /// What each technique found. Empty where settings do not ask for it.
  std::vector<technique_picture> technique_pictures() const {
    return by_technique_.pictures(pictured(settings_.techniques));
  }
  /// What one technique found for a pixel in the last sample. Precondition: settings ask for pictures.
  technique_sum found_by(technique by, std::size_t pixel) const { return by_technique_.of_sample(by, pixel); }
  /// Radii of a sample's merges, from 0.
  wfpg::merge_radii radii_of(const pinhole& camera, std::uint32_t sample) const {
    return wfpg::radii_of(light_.options(), sample + 1, extent(camera));
  }
  /// What light paths left in the last sample.
  photon_gather photons() { return light_.gather(); }
  /// Vertices and beams of light paths that had no memory, over all samples. Their light is missing.
  std::uint64_t dropped() const { return dropped_; }
  /// Photon beams beyond the most that a segment leaves, over all samples. Their light is missing.
  std::uint64_t surplus_beams() const { return surplus_beams_; }
  /// Bytes of the vertices and beams of light paths, of the maps over them, of joins and of splats.
  std::size_t light_bytes() const {
    return light_.memory().total() + joins_.bytes() + splats_.bytes() + in_view_.bytes();
  }
  const named_seconds& seconds() const { return clock_.seconds(); }

 private:
  static world_type world_of(const tracer_settings& settings, const path_lights& given,
                             const Caster& caster) {
    wfpg::require(settings.max_depth <= photon::most_segments, "max_depth", settings.max_depth,
                  "at most 2047 with paths from lights");
    wfpg::require(given.scene.materials.size() <= photon::most_solids, "number of materials",
                  given.scene.materials.size(), "at most 2097151 with paths from lights");
    world_type world{given.scene, given.lights, caster};
    world.max_depth = settings.max_depth;
    world.roulette_depth = settings.roulette_depth;
    return world;
  }

  /// A light path a pixel.
  static wfpg::bidirectional_options light_of(const tracer_settings& settings, bool next_event) {
    wfpg::bidirectional_options options =
        light_options(settings.light, settings.techniques, settings.pixels(), settings.max_depth);
    options.next_event = options.next_event && next_event;
    return options;
  }

  /// Radius of the scene. A scene without extent has the camera's distance, or 1.
  float extent(const pinhole& camera) const {
    const float radius = world_.lights.scene_radius;
    if (radius > 0.0f) return radius;
    const float distance = glm::length(camera.position() - world_.lights.scene_centre);
    return distance > 0.0f ? distance : 1.0f;
  }

  /// Most stored vertices that are connected to the camera at a time.
  std::size_t splats_at_a_time() {
    if (!settings_.techniques.has(technique::splat)) return 0;
    return std::min(std::max(count_, settings_.least_splats), stored().capacity());
  }
  wfpg::light_vertices_view<subpath_vertex> stored() { return light_.gather().vertices(); }
  found_light found() { return by_technique_.found(radiance_.view()); }

  void begin_light(const pinhole& camera, std::uint32_t sample) {
    light_.begin_iteration(sample + 1, extent(camera));
    sizes_.begin();
  }
  void count_dropped() {
    const wfpg::bidirectional_statistics left = light_.statistics();
    dropped_ += std::uint64_t(left.dropped_vertices) + left.dropped_beams;
    surplus_beams_ += left.surplus_beams;
  }

  void follow_light(const pinhole& camera, std::uint32_t sample) {
    clock_.measure("light paths", [&] {
      exec_.for_each(count_, start_light_paths<world_type>{world_, around_lights_.view(), paths_.view(),
                                                           active_.marks()});
      active_.collect(exec_, count_);
    });
    for (std::uint32_t segments = 1; segments < settings_.max_depth; ++segments) {
      const bool is_last = segments + 1 == settings_.max_depth;
      clock_.measure("light paths", [&] { follow_light_segment(segments, is_last); });
      const bool forgets = !settings_.techniques.joins_light_paths() && segments % depths_in_memory() == 0;
      if (!settings_.techniques.has(technique::splat) || !(is_last || forgets)) continue;
      clock_.measure("splats", [&] { splat_light(camera, segments); });
      if (is_last) continue;
      count_dropped();
      begin_light(camera, sample);
    }
    by_technique_.take_splats(radiance_);
  }
  /// How many depths of all light paths have room, at least one.
  std::uint32_t depths_in_memory() {
    return std::max(static_cast<std::uint32_t>(stored().capacity() / count_), 1u);
  }

  void follow_light_segment(std::uint32_t segments, bool is_last) {
    exec_.fill_bytes(keeps_.data(), 0, keeps_.bytes());
    active_.for_each(exec_, trace_light_paths<world_type>{world_, segments, paths_.view(), vertices_.view(),
                                                          active_.marks(), keeps_.view(),
                                                          light_.light_recorder(), film_.segment_counts()});
    light_.reserve(keeps_.view());
    active_.for_each(exec_, extend_light_paths<world_type>{world_, is_last, paths_.view(), vertices_.view(),
                                                           active_.marks(), light_.light_recorder()});
    if (!is_last) active_.collect(exec_, count_);
    sizes_.end_segment(stored(), segments);
  }

  /// Connects all stored vertices to the camera. `segments`: of their paths, at most.
  void splat_light(const pinhole& camera, std::uint32_t segments) {
    const std::uint32_t size = sizes_.up_to(segments);
    const float scale = 1.0f / static_cast<float>(count_);
    for (std::uint32_t first = 0, n = 0; first < size; first += n) {
      n = std::min(size - first, static_cast<std::uint32_t>(in_view_.capacity()));
      exec_.for_each(n, find_in_view{stored(), first, camera, in_view_.marks()});
      in_view_.collect(exec_, n);
      in_view_.for_each(exec_, splat_vertices<world_type>{world_, camera, stored(), first, splats_.view(),
                                                          by_technique_.splats()});
      splats_.add_to(exec_, radiance_.view(), scale, n);
      by_technique_.add_splats(scale, n);
    }
  }

  void follow_camera(const pinhole& camera) {
    clock_.measure("camera", [&] {
      if (world_.scene.has_solids)
        exec_.for_each(1, find_camera_solids<Caster, pinhole>{world_.scene, world_.caster, camera,
                                                              around_camera_.view()});
      exec_.for_each(count_, start_camera_paths<world_type>{world_, camera, around_camera_.view(),
                                                            paths_.view(), active_.marks()});
      active_.collect(exec_, count_);
    });
    const bool merges =
        settings_.techniques.has(technique::pb2d) || settings_.techniques.has(technique::bb1d);
    // Light tracing needs the segments alone that begin at the camera.
    const std::uint32_t most = settings_.techniques.needs_camera_paths() ? settings_.max_depth : 1;
    for (std::uint32_t segments = 1; segments <= most; ++segments) {
      clock_.measure("trace", [&] {
        if (merges)
          trace_camera<true>(segments, segments == most);
        else
          trace_camera<false>(segments, segments == most);
      });
      if (segments == most) break;
      join_camera_paths(segments);
      clock_.measure("shade", [&] {
        active_.for_each(
            exec_, extend_camera_paths<world_type>{world_, paths_.view(), vertices_.view(), active_.marks()});
        active_.collect(exec_, count_);
      });
    }
  }

  void join_camera_paths(std::uint32_t segments) {
    const tiled_view<subpath_vertex> vertices = vertices_.view();
    const wfpg::path_techniques& counts = world_.techniques;
    // Whole paths have at most max_depth segments, one of them the connection.
    const bool connects = counts.connections > 0.0f && segments + 1 < settings_.max_depth;
    const std::uint32_t size = connects ? sizes_.up_to(settings_.max_depth - segments - 1) : 0;
    clock_.measure("connections", [&] { joins_.join(world_, vertices, stored(), size, joined_, found()); });
    if (counts.surface_points > 0.0f || counts.volume_points > 0.0f)
      clock_.measure("merges", [&] {
        joined_.for_each(exec_, merge_vertices<world_type>{world_, vertices, light_.gather(), found()});
      });
  }

  template <bool merges>
  void trace_camera(std::uint32_t segments, bool is_last) {
    exec_.fill_bytes(joined_.marks().data(), 0, count_ * sizeof(std::uint32_t));
    active_.for_each(exec_, trace_camera_paths<world_type, merges>{
                                world_, segments, is_last, paths_.view(), vertices_.view(), active_.marks(),
                                joined_.marks(), light_.gather(), found(), film_.segment_counts(),
                                film_.light_hit_counts()});
    if (!is_last) joined_.collect(exec_, count_);
  }

  Exec exec_;
  tracer_settings settings_;
  std::size_t count_;
  world_type world_;
  tiled_array<subpath, Exec> paths_;
  tiled_array<subpath_vertex, Exec> vertices_;
  wfpg::buffer<std::uint32_t, Exec> keeps_;
  wfpg::index_list<Exec> active_;  // paths that go on
  wfpg::index_list<Exec> joined_;  // camera paths whose last vertex can be joined with others
  wfpg::buffer<vec3, Exec> radiance_;
  wfpg::bidirectional<Exec, subpath_vertex, photon, light_beam> light_;
  wfpg::splats<Exec> splats_;       // a place a stored vertex, of those that are connected at a time
  wfpg::index_list<Exec> in_view_;  // of these, those that the camera may see
  stored_sizes<Exec> sizes_;
  join_list<Exec> joins_;
  wfpg::buffer<solid_stack, Exec> around_camera_;
  wfpg::buffer<solid_stack, Exec> around_lights_;  // by the lights' columns; empty where there are no solids
  path_film<Exec> film_;
  technique_film<Exec> by_technique_;
  policy_clock<Exec> clock_;
  std::uint64_t dropped_ = 0, surplus_beams_ = 0;
};

template <class Exec, class Caster>
using bidirectional_tracer = observed_bidirectional_tracer<Exec, Caster, no_observer>;

}  // namespace render
