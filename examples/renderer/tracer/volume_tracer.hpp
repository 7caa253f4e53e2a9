// The path tracer of scenes with media. One sample of all pixels is one wave, as in wavefront.hpp.
#pragma once

#include "tracer/path_film.hpp"
#include "tracer/stage_clock.hpp"
#include "tracer/staged_paths.hpp"
#include "tracer/unguided.hpp"
#include "tracer/volume_kernels.hpp"
#include "tracer/wavefront.hpp"

#include <wfpg/exec/buffer.hpp>

#include <cstdint>
#include <vector>

namespace render {

/// Renders samples of a scene with media. A Caster is an inline one, as path_tracer has it. Vertices in media
/// count as those on surfaces. Boundaries that light passes unbent are no vertices.
template <class Exec, class Caster>
class volume_tracer {
 public:
  volume_tracer(const Exec& exec, const tracer_settings& settings, const path_lights& world,
                const Caster& caster)
      : exec_(exec),
        settings_(settings),
        world_(world),
        caster_(caster),
        share_(settings.part()),
        count_(share_.count),
        around_camera_(exec, std::vector<solid_stack>(1)),
        paths_(exec, count_),
        vertices_(exec, count_),
        keys_(exec, count_),
        radiance_(exec, count_),
        film_(exec, share_, settings.ranks),
        queues_(exec, count_),
        clock_(exec) {}

  /// Renders a wave as path_tracer does. A Camera is one of path_tracer.
  template <class Camera>
  void render_sample(no_guide, const Camera& camera, std::uint32_t sample, float weight) {
    const std::uint32_t samples = settings_.samples_from(sample);
    volume_position at{{share_.random(settings_.seed, sample), 0, settings_.max_depth}};
    start(at, camera, sample + samples);
    for (path_queue queue{{}, true}; at.depth < at.max_depth; ++at.depth) {
      find_vertices(at, queue);
      if (at.is_last()) break;
      clock_.measure("sort", [&] { queue = queues_.of_all(exec_, keys_.view()); });
      if (at.depth % depths_between_looks == depths_between_looks - 1 && is_empty(queue)) break;
      if (world_.next_event) add_light(at, queue);
      scatter(at, queue);
    }
    clock_.measure("film", [&] { film_.add(radiance_.view(), weight, samples); });
    wfpg::read_element(exec_, radiance_.data());  // waits, so that a look at the time sees the whole sample
    clock_.resolve();
  }

  /// The samples so far.
  const path_film<Exec>& film() const { return film_; }
  path_film<Exec>& film() { return film_; }

  const named_seconds& seconds() const { return clock_.seconds(); }

 private:
  // Paths in media are long, and few of them the longest. A look waits for the work before it.
  static constexpr std::uint32_t depths_between_looks = 16;

  template <class Camera>
  void start(const volume_position& at, const Camera& camera, std::uint32_t end) {
    clock_.measure("camera", [&] {
      if (world_.scene.has_solids)
        exec_.for_each(
            1, find_camera_solids<Caster, Camera>{world_.scene, caster_, camera, around_camera_.view()});
      exec_.for_each(count_, start_volume_paths<Camera>{camera, at.random, around_camera_.view(),
                                                        paths_.view(), radiance_.view(), end});
    });
  }

  void find_vertices(const volume_position& at, const path_queue& queue) {
    clock_.measure("trace", [&] {
      exec_.for_each(count_,
                     find_volume_vertices<Caster>{at, world_, caster_, queue, paths_.view(), vertices_.view(),
                                                  keys_.view(), radiance_.view(), film_.segment_counts(),
                                                  film_.light_hit_counts(), queue_maker<Exec>::ended});
    });
  }

  bool is_empty(const path_queue& queue) const { return wfpg::read_element(exec_, queue.active.count) == 0; }

  void add_light(const volume_position& at, const path_queue& queue) {
    clock_.measure("lights", [&] {
      exec_.for_each(count_, add_volume_light<Caster>{at, world_, caster_, queue, paths_.view(),
                                                      vertices_.view(), keys_.view(), radiance_.view()});
    });
  }

  void scatter(const volume_position& at, const path_queue& queue) {
    clock_.measure("shade", [&] {
      exec_.for_each(count_, scatter_volume_paths{at, world_.scene, queue, paths_.view(), vertices_.view(),
                                                  keys_.view(), settings_.roulette_depth});
    });
  }

  Exec exec_;
  tracer_settings settings_;
  path_lights world_;
  Caster caster_;
  wave_share share_;
  std::size_t count_;
  wfpg::buffer<solid_stack, Exec> around_camera_;
  tiled_array<volume_path, Exec> paths_;
  tiled_array<path_vertex, Exec> vertices_;
  wfpg::buffer<std::uint32_t, Exec> keys_;
  wfpg::buffer<vec3, Exec> radiance_;
  path_film<Exec> film_;
  queue_maker<Exec> queues_;
  policy_clock<Exec> clock_;
};

}  // namespace render
