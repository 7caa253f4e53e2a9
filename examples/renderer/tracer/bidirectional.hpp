// The bidirectional path tracer. In one sample each pixel has a light path and a camera path. All paths go
// from vertex to vertex as a wave. Light comes from hits of lights, from light samples, from connections of
// the two paths, and from connections of light paths to the camera. Vertices of camera paths can be merged
// with those of all light paths, too.
//
// Sources: Veach 1997, chapter 10; Georgiev et al. 2012, "Light Transport Simulation with Vertex Connection
// and Merging"; weights as in <wfpg/light/path_weights.hpp>.
#pragma once

#include "tracer/connection_kernels.hpp"
#include "tracer/light_kernels.hpp"
#include "tracer/path_film.hpp"
#include "tracer/stage_clock.hpp"
#include "tracer/unguided.hpp"
#include "tracer/wavefront.hpp"

#include <wfpg/host/ray_caster.hpp>
#include <wfpg/light/photon_estimators.hpp>
#include <wfpg/light/photon_map.hpp>

#include <cstdint>
#include <vector>

namespace render {

/// Renders samples of a scene. Caster: an inline caster as path_tracer's.
///
/// One seed gives one picture on any number of threads: splats are added in the order of light paths.
template <class Exec, class Caster>
class bidirectional_tracer {
  static_assert(wfpg::is_inline_caster_v<Caster>);
  using world_type = bidirectional_world<Caster>;

 public:
  bidirectional_tracer(const Exec& exec, const tracer_settings& settings, const path_lights& world,
                       const Caster& caster)
      : exec_(exec),
        settings_(settings),
        count_(settings.pixels()),
        world_{world.scene,
               world.lights,
               caster,
               counts_of(settings.techniques, world.next_event, count_),
               {},
               settings.max_depth,
               settings.roulette_depth},
        paths_(exec, count_),
        vertices_(exec, count_),
        keeps_(exec, count_),
        radiance_(exec, count_),
        splats_(exec, count_, count_),
        positions_(exec, 0),
        stored_(exec, {settings.techniques.needs_light_vertices() ? count_ : 0, settings.light.memory,
                       glm::max(settings.max_depth, 2u) - 1}),
        around_camera_(exec, std::vector<solid_stack>(1)),
        around_lights_(exec,
                       std::vector<solid_stack>(world.scene.has_solids ? world.lights.lights.size() : 0)),
        film_(exec, count_),
        clock_(exec) {
    exec_.for_each(around_lights_.size(), find_light_solids<world_type>{world_, around_lights_.view()});
  }

  /// Renders sample number `sample` (from 0) of each pixel with `weight` >= 0 in the picture, and waits.
  void render_sample(no_guide, const pinhole& camera, std::uint32_t sample, float weight) {
    world_.random = {settings_.seed, sample};
    exec_.fill_bytes(radiance_.data(), 0, radiance_.bytes());
    stored_.begin(exec_);
    const float radius = radius_of(sample);
    if (settings_.techniques.merges)
      world_.techniques.surface_points = static_cast<float>(count_) * pi * radius * radius;
    if (settings_.techniques.needs_light_paths()) follow_light(camera);
    if (settings_.techniques.merges) clock_.measure("photon map", [&] { build_photon_map(radius); });
    follow_camera(camera);
    clock_.measure("film", [&] { film_.add(radiance_.view(), weight); });
    dropped_ += stored_.dropped(exec_);  // waits, so that a look at the time sees the whole sample
    clock_.resolve();
  }

  /// The samples so far.
  const path_film<Exec>& film() const { return film_; }
  path_film<Exec>& film() { return film_; }

  /// Vertices of light paths that had no memory, over all samples. Their light is missing.
  std::uint64_t dropped() const { return dropped_; }
  /// Bytes of the vertices of light paths.
  std::size_t light_bytes() const { return stored_.bytes(); }
  const named_seconds& seconds() const { return clock_.seconds(); }

 private:
  /// A light path a pixel.
  static wfpg::path_techniques counts_of(const technique_set& set, bool next_event, std::size_t pixels) {
    wfpg::path_techniques counts;
    counts.light_hits = set.light_hits ? 1.0f : 0.0f;
    counts.next_event = set.next_event && next_event ? 1.0f : 0.0f;
    counts.connections = set.connections ? 1.0f : 0.0f;
    counts.splats = set.splats ? static_cast<float>(pixels) : 0.0f;
    return counts;
  }

  /// Of a sample's merges. A scene without extent has any.
  float radius_of(std::uint32_t sample) const {
    const wfpg::radius_schedule radius{settings_.light.merge_radius * world_.lights.scene_radius,
                                       settings_.light.radius_alpha, 2};
    return glm::max(radius(sample + 1), wfpg::photon_map<Exec>::least_radius);
  }

  void build_photon_map(float radius) {
    const std::uint32_t photons = stored_.size(exec_);
    if (positions_.size() < photons) positions_ = wfpg::buffer<vec3, Exec>(exec_, stored_.capacity());
    exec_.for_each(photons, copy_positions{stored_.view(), positions_.view()});
    photons_.build(exec_, {positions_.data(), photons}, radius);
  }

  void follow_light(const pinhole& camera) {
    clock_.measure("light paths", [&] {
      exec_.for_each(count_, start_light_paths<world_type>{world_, around_lights_.view(), paths_.view()});
    });
    for (std::uint32_t segments = 1; segments < settings_.max_depth; ++segments) {
      clock_.measure("light paths", [&] {
        exec_.for_each(count_,
                       trace_light_paths<world_type>{world_, segments, paths_.view(), vertices_.view(),
                                                     keeps_.view(), film_.segment_counts()});
        if (settings_.techniques.needs_light_vertices()) stored_.reserve(exec_, keeps_.view());
        const bool is_last = segments + 1 == settings_.max_depth;
        exec_.for_each(
            count_, extend_light_paths<world_type>{world_, camera, is_last, paths_.view(), vertices_.view(),
                                                   keeps_.view(), stored_.view(), splats_.view()});
      });
      clock_.measure("splats", [&] {
        if (settings_.techniques.splats)
          splats_.add_to(exec_, radiance_.view(), 1.0f / static_cast<float>(count_));
      });
    }
  }

  void follow_camera(const pinhole& camera) {
    clock_.measure("camera", [&] {
      if (world_.scene.has_solids)
        exec_.for_each(1, find_camera_solids<Caster, pinhole>{world_.scene, world_.caster, camera,
                                                              around_camera_.view()});
      exec_.for_each(count_,
                     start_camera_paths<world_type>{world_, camera, around_camera_.view(), paths_.view()});
    });
    for (std::uint32_t segments = 1; segments <= settings_.max_depth; ++segments) {
      clock_.measure("trace", [&] {
        exec_.for_each(count_, trace_camera_paths<world_type>{
                                   world_, segments, paths_.view(), vertices_.view(), radiance_.view(),
                                   film_.segment_counts(), film_.light_hit_counts()});
      });
      if (segments == settings_.max_depth) break;
      clock_.measure("connections", [&] {
        exec_.for_each(
            count_, connect_camera_paths<world_type>{world_, paths_.view(), vertices_.view(), photons_.view(),
                                                     stored_.view(), radiance_.view()});
      });
    }
  }

  Exec exec_;
  tracer_settings settings_;
  std::size_t count_;
  world_type world_;
  tiled_array<subpath, Exec> paths_;
  tiled_array<subpath_vertex, Exec> vertices_;
  wfpg::buffer<std::uint32_t, Exec> keeps_;
  wfpg::buffer<vec3, Exec> radiance_;
  wfpg::splats<Exec> splats_;
  wfpg::buffer<vec3, Exec> positions_;  // of stored vertices
  wfpg::light_vertices<Exec, subpath_vertex> stored_;
  wfpg::photon_map<Exec> photons_;
  wfpg::buffer<solid_stack, Exec> around_camera_;
  wfpg::buffer<solid_stack, Exec> around_lights_;  // by the lights' columns; empty where there are no solids
  path_film<Exec> film_;
  policy_clock<Exec> clock_;
  std::uint64_t dropped_ = 0;
};

}  // namespace render
