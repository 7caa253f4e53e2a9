// The path tracer. One sample of all pixels is one wave that goes from vertex to vertex as a whole. On a CPU,
// paths without a guide do not wait for each other.
#pragma once

#include "tracer/path_film.hpp"
#include "tracer/path_kernels.hpp"
#include "tracer/stage_clock.hpp"
#include "tracer/staged_paths.hpp"
#include "tracer/technique_set.hpp"
#include "tracer/unguided.hpp"
#include "tracer/wave_share.hpp"
#include "tracer/whole_paths.hpp"

#include <wfpg/exec/buffer.hpp>
#include <wfpg/exec/cpu_policy.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/host/recorded_runs.hpp>
#include <wfpg/host/wave.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>

namespace render {

/// Whether a guider says which paths its guide takes part in, and whether it rests in a sample: then it
/// records nothing, and BSDFs draw all directions.
template <class Guider, class = void>
inline constexpr bool can_rest_v = false;
template <class Guider>
inline constexpr bool
    can_rest_v<Guider, std::void_t<decltype(std::declval<const Guider&>().resting()),
                                   decltype(std::declval<const Guider&>().guided_paths())>> = true;

struct tracer_settings {
  int width = 512;              ///< pixels, positive
  int height = 512;             ///< pixels, positive
  std::uint32_t max_depth = 8;  ///< segments of a path from the camera, at least 1
  std::uint64_t seed = 0;
  std::uint32_t roulette_depth = 3;  ///< Russian roulette begins at this vertex; the camera's first hit is 0
  technique_set techniques = {};     ///< of paths from both ends
  wfpg::bidirectional_options light = {};  ///< of light paths: budget, radii, beam paths
  bool technique_pictures = false;         ///< whether they keep a picture a technique
  bool weighs_by_gain = false;             ///< samples have the weights that the guider measures
  wave_share share = {};                   ///< this rank's part of a wave; of no paths: all of one sample
  std::uint32_t end = 0xffffffffu;         ///< waves have no samples from this one on
  wfpg::communicator* ranks = nullptr;     ///< that render the picture together, of the policy's memory
  /// Stored vertices of light paths that are connected to the camera at a time: this many, or one a pixel
  /// where there are more pixels. A GPU is not filled by few.
  std::size_t least_splats = std::size_t(1) << 20;

  /// The samples of a wave that begins with this one.
  std::uint32_t samples_from(std::uint32_t sample) const { return std::min(part().samples, end - sample); }
  /// What the tracer traces.
  wave_share part() const { return share.count > 0 ? share : wave_share::all_of(pixels()); }
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

/// Renders samples of a scene with directions from a guider.
///
/// A Caster is a caster of the guider that also finds triangles. Kernels call an inline caster's functions:
///   triangle_hit intersect(const wfpg::ray&) const;  bool occluded(const wfpg::ray&) const;
/// A batch caster is called between kernels. Rays with t_max <= t_min are misses:
///   void intersect(const Exec&, wfpg::array_view<const wfpg::ray>, wfpg::array_view<triangle_hit>) const;
///   void occluded(const Exec&, wfpg::array_view<const wfpg::ray>, wfpg::array_view<std::uint32_t>) const;
///
/// Emission counts at vertices 1 to max_depth. Next-event estimation, if it is on, is done at vertices 1 to
/// max_depth - 1, so that both estimate the same sum. Work is ordered by path, never by arrival. One seed
/// therefore gives one picture on any number of threads.
template <class Exec, class Caster>
class path_tracer {
 public:
  path_tracer(const Exec& exec, const tracer_settings& settings, const path_lights& world,
              const Caster& caster)
      : exec_(exec),
        settings_(settings),
        world_(world),
        caster_(caster),
        share_(settings.part()),
        count_(share_.count),
        paths_(exec, count_),
        vertices_(exec, count_),
        queries_(exec, world.next_event ? count_ : 0),
        densities_(exec, world.next_event ? count_ : 0),
        directions_(exec, count_),
        keys_(exec, count_),
        radiance_(exec, count_),
        film_(exec, share_, settings.ranks),
        queues_(exec, count_),
        all_(count_),
        rays_(exec, is_inline ? 0 : count_),
        hits_(exec, is_inline ? 0 : count_),
        hidden_(exec, is_inline || !world.next_event ? 0 : count_),
        clock_(exec) {}

  /// Renders a wave that begins with sample number `sample` (from 0) of each pixel, and waits. Its samples
  /// have `weight` >= 0 in the picture. With weighs_by_gain the guider's weight multiplies it. A Camera is a
  /// pinhole, or another type that makes rays:
  ///   wfpg::ray through(std::uint32_t pixel, vec2 offset) const;  offset in [0, 1)² of the pixel
  template <class Guider, class Camera>
  void render_sample(Guider& guider, const Camera& camera, std::uint32_t sample, float weight) {
    const std::uint32_t samples = settings_.samples_from(sample);
    wave_position at{share_.random(settings_.seed, sample), 0, settings_.max_depth};
    clock_.measure("camera", [&] {
      exec_.for_each(
          count_, start_paths<Camera>{camera, at.random, paths_.view(), radiance_.view(), sample + samples});
    });
    clock_.measure("update", [&] { guider.begin_sample(); });
    if (settings_.weighs_by_gain) weight *= guider.sample_weight();
    world_.guide = guider.lights();
    follow(guider, at);
    clock_.measure("update", [&] { guider.end_sample(); });
    clock_.measure("film", [&] { film_.add(radiance_.view(), weight, samples); });
    wfpg::read_element(exec_, radiance_.data());  // waits, so that a look at the time sees the whole sample
    clock_.resolve();
  }

  /// The samples so far.
  const path_film<Exec>& film() const { return film_; }
  path_film<Exec>& film() { return film_; }

  const named_seconds& seconds() const { return clock_.seconds(); }

  /// The caster of the paths' rays.
  const Caster& caster() const { return caster_; }

 private:
  static constexpr bool is_inline = wfpg::is_inline_caster_v<Caster>;
  static constexpr bool is_cpu = std::is_base_of_v<wfpg::exec::cpu_policy<Exec, Exec::warp_width>, Exec>;
  static constexpr bool may_follow = is_cpu && is_inline;

  struct listed_part {
    wfpg::recorded_runs part;
    staged_paths<Exec> paths;
  };

  // On a CPU, paths that no guide takes part in need not wait for each other, nor for those that one does.
  template <class Guider>
  void follow(Guider& guider, const wave_position& at) {
    if constexpr (std::is_same_v<Guider, unguided<Exec>>) {
      follow_unguided(guider, at, {});
    } else if constexpr (is_cpu && can_rest_v<Guider>) {
      unguided<Exec> others(exec_);
      if (guider.resting()) return follow_unguided(others, at, {});
      const wfpg::recorded_runs guided = guider.guided_paths();
      if (guided.log2_divisor() > 0) {
        follow_unguided(others, at, guided);
        return follow_by_stages(guider, at, part(guided_, guided, true));
      }
      follow_by_stages(guider, at, all_);
    } else {
      follow_by_stages(guider, at, all_);
    }
  }

  // Follows all paths but a part of few, none of which means all.
  void follow_unguided(unguided<Exec>& guider, const wave_position& at, const wfpg::recorded_runs& but) {
    if constexpr (may_follow)
      clock_.measure("paths", [&] { follow_whole_paths(at, but); });
    else
      follow_by_stages(guider, at, but.log2_divisor() > 0 ? part(others_, but, false) : all_);
  }

  // Returns a part's list, made anew where the part is another one.
  staged_paths<Exec>& part(std::optional<listed_part>& kept, const wfpg::recorded_runs& part, bool inside) {
    if (!kept || kept->part != part) kept = listed_part{part, {exec_, count_, part, inside}};
    return kept->paths;
  }

  void follow_whole_paths(const wave_position& at, const wfpg::recorded_runs& but) {
    if (world_.next_event)
      follow_with(at, but,
                  wfpg::density_queries{queued_light_directions{queries_.view()}, densities_.view()});
    else
      follow_with(at, but, wfpg::no_queries());
  }

  template <class Queries>
  void follow_with(const wave_position& at, const wfpg::recorded_runs& but, const Queries& queries) {
    using stages = path_stages<Caster, Queries>;
    const path_queue all{{}, true};
    const inline_answers<Caster> answers{caster_};
    const wfpg::no_path_recorder nobody;
    const decltype(stages::sample) sample{
        {{all, vertices_.view()}, {all, at.random, 0}, queries, directions_.view()}, {}};
    const stages kernels{tracing(at, all, answers, nobody), querying(at, all, answers), sample,
                         shading(at, all, nobody)};
    exec_.for_each_run(count_, follow_paths<Caster, Queries>{kernels, but.log2_divisor() == 0, but});
  }

  // Kernels of one depth, for waves and for whole paths.
  template <class Answers, class Recorder>
  trace_paths<Answers, Recorder> tracing(const wave_position& at, const path_queue& queue,
                                         const Answers& answers, const Recorder& recorder) {
    return {at,
            world_,
            answers,
            recorder,
            queue,
            paths_.view(),
            vertices_.view(),
            queries_.view(),
            keys_.view(),
            radiance_.view(),
            film_.segment_counts(),
            film_.light_hit_counts(),
            queue_maker<Exec>::ended};
  }
  template <class Answers>
  query_lights<Answers> querying(const wave_position& at, const path_queue& queue, const Answers& answers) {
    return {at, world_, answers, queue, vertices_.view(), queries_.view()};
  }
  template <class Recorder>
  shade_paths<Recorder> shading(const wave_position& at, const path_queue& queue, const Recorder& recorder) {
    return {at,
            recorder,
            queue,
            vertices_.view(),
            queries_.view(),
            densities_.view(),
            directions_.view(),
            paths_.view(),
            radiance_.view(),
            world_.guide,
            settings_.roulette_depth};
  }

  // Each stage is done for all of the staged paths before the next one begins.
  template <class Guider>
  void follow_by_stages(Guider& guider, wave_position at, staged_paths<Exec>& staged) {
    for (wave_slots now{at, staged.first(), staged.size()}; now.at.depth < at.max_depth; ++now.at.depth) {
      trace(guider, now);
      if (now.at.is_last()) break;
      clock_.measure("sort", [&] { now.queue = staged.active(exec_, queues_, keys_.view()); });
      if (world_.next_event) query(now);
      sample_directions(guider, now);
      shade(guider, now);
    }
  }

  // Slots of the staged paths, at one depth.
  struct wave_slots {
    wave_position at;
    path_queue queue;
    std::size_t count;
  };

  template <class Guider>
  void trace(Guider& guider, const wave_slots& now) {
    clock_.measure("trace", [&] {
      if constexpr (is_inline) {
        trace_with(guider, now, inline_answers<Caster>{caster_});
      } else {
        exec_.for_each(now.count, write_rays{now.queue, paths_.view(), rays_.view()});
        caster_.intersect(exec_, wfpg::array_view<const wfpg::ray>(rays_.data(), now.count),
                          wfpg::array_view<triangle_hit>(hits_.data(), now.count));
        trace_with(guider, now, batch_hits{hits_.view()});
      }
    });
  }

  template <class Guider, class Answers>
  void trace_with(Guider& guider, const wave_slots& now, const Answers& answers) {
    exec_.for_each(now.count, tracing(now.at, now.queue, answers, guider.recorder()));
  }

  void query(const wave_slots& now) {
    clock_.measure("lights", [&] {
      if constexpr (is_inline) {
        query_with(now, inline_answers<Caster>{caster_});
      } else {
        query_with(now, batch_questions{rays_.view()});
        caster_.occluded(exec_, wfpg::array_view<const wfpg::ray>(rays_.data(), now.count),
                         wfpg::array_view<std::uint32_t>(hidden_.data(), now.count));
        exec_.for_each(now.count, drop_hidden{hidden_.view(), queries_.view()});
      }
    });
  }

  template <class Answers>
  void query_with(const wave_slots& now, const Answers& answers) {
    exec_.for_each(now.count, querying(now.at, now.queue, answers));
  }

  template <class Guider>
  void sample_directions(Guider& guider, const wave_slots& now) {
    clock_.measure("directions", [&] {
      const wfpg::wave wave{
          now.at.depth, now.count, queued_surfaces{now.queue, vertices_.view()},
          queued_random{now.queue, now.at.random, now.at.first_dimension() + dimension::direction}};
      if (world_.next_event)
        guider.sample_directions(
            wave, caster_, directions_.view(),
            wfpg::density_queries{queued_light_directions{queries_.view()}, densities_.view()});
      else
        guider.sample_directions(wave, caster_, directions_.view());
    });
  }

  template <class Guider>
  void shade(Guider& guider, const wave_slots& now) {
    clock_.measure("shade",
                   [&] { exec_.for_each(now.count, shading(now.at, now.queue, guider.recorder())); });
  }

  Exec exec_;
  tracer_settings settings_;
  path_lights world_;
  Caster caster_;
  wave_share share_;
  std::size_t count_;
  tiled_array<path_state, Exec> paths_;
  tiled_array<path_vertex, Exec> vertices_;
  tiled_array<light_query, Exec> queries_;
  wfpg::buffer<float, Exec> densities_;
  wfpg::buffer<wfpg::sampled_direction, Exec> directions_;
  wfpg::buffer<std::uint32_t, Exec> keys_;
  wfpg::buffer<vec3, Exec> radiance_;
  path_film<Exec> film_;
  queue_maker<Exec> queues_;
  staged_paths<Exec> all_;
  std::optional<listed_part> guided_;   // while a guide probes
  std::optional<listed_part> others_;   // for a batch caster
  wfpg::buffer<wfpg::ray, Exec> rays_;  // for a batch caster
  wfpg::buffer<triangle_hit, Exec> hits_;
  wfpg::buffer<std::uint32_t, Exec> hidden_;
  policy_clock<Exec> clock_;
};

}  // namespace render
