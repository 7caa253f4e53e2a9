// An iteration of the renderer's bidirectional tracer: a sample of all pixels of a built-in scene. The floor
// casts the rays of that iteration again, and does nothing else. They were recorded in the order in which
// kernels asked for them, and each kernel's rays are cast by one kernel.
#include "casters/bvh_scene.hpp"
#include "lights/lights.hpp"
#include "scene/builtin_scenes.hpp"
#include "timing.hpp"
#include "tracer/bidirectional.hpp"
#if defined(__CUDACC__)
#include "tracer/cuda_clock.hpp"
#endif

#include <wfpg/exec/policy.hpp>
#include <wfpg/exec/support/atomic.hpp>

#include <cstddef>
#include <vector>

namespace bench {
namespace {

/// Rays in the order in which they were asked for. Those beyond the arrays' size are only counted.
struct ray_record {
  std::uint32_t* count;
  wfpg::array_view<wfpg::ray> rays;
  wfpg::array_view<std::uint8_t> any_hit;  ///< 1: any hit ends the ray

  WFPG_HD void add(const wfpg::ray& ray, bool any) const {
    const std::uint32_t i = wfpg::atomic_add(count, 1u);
    if (i >= rays.size()) return;
    rays[i] = ray;
    any_hit[i] = any ? 1 : 0;
  }
};

/// A caster that records its rays.
struct recording_caster : render::bvh_caster {
  ray_record record;

  WFPG_HD render::triangle_hit intersect(const wfpg::ray& ray) const {
    record.add(ray, false);
    return bvh_caster::intersect(ray);
  }
  WFPG_HD bool occluded(const wfpg::ray& ray) const {
    record.add(ray, true);
    return bvh_caster::occluded(ray);
  }
};

/// A policy that notes after each loop over indices how many rays there are.
template <class Exec>
class noting : public Exec {
 public:
  noting(const Exec& exec, const std::uint32_t* count, std::vector<std::size_t>& ends)
      : Exec(exec), count_(count), ends_(&ends) {}

  template <class F>
  void for_each(std::size_t n, const F& f) const {
    Exec::for_each(n, f);
    note();
  }
  template <class F>
  void for_each(wfpg::exec::device_count n, const F& f) const {
    Exec::for_each(n, f);
    note();
  }

  void note() const {
    const std::size_t end = wfpg::read_element(*this, count_);
    if (end > (ends_->empty() ? 0 : ends_->back())) ends_->push_back(end);
  }

 private:
  const std::uint32_t* count_;
  std::vector<std::size_t>* ends_;  // the numbers after each loop that cast rays
};

struct cast_recorded {
  render::bvh_caster caster;
  std::size_t first;
  wfpg::array_view<const wfpg::ray> rays;
  wfpg::array_view<const std::uint8_t> any_hit;
  wfpg::array_view<std::uint32_t> found;

  WFPG_HD void operator()(std::size_t n) const {
    const std::size_t i = first + n;
    found[i] = any_hit[i] ? (caster.occluded(rays[i]) ? 1u : 0u) : caster.intersect(rays[i]).triangle;
  }
};

/// A built-in scene with what a tracer needs.
template <class Exec>
class traced_scene {
 public:
  traced_scene(const Exec& exec, const char* name, bool merges)
      : host_(render::make_builtin_scene(name)),
        arrays_(exec, host_),
        lights_(exec, host_),
        hierarchy_(exec, host_, arrays_.view()) {
    settings_.width = sizes::iteration_width;
    settings_.height = sizes::iteration_height;
    settings_.max_depth = static_cast<std::uint32_t>(host_.max_depth);
    if (merges) settings_.techniques.add(render::technique::surf);
  }

  render::bvh_caster caster() const { return hierarchy_.caster(); }
  std::size_t pixels() const { return settings_.pixels(); }

  /// A tracer with a caster of its own.
  template <class Policy, class Caster>
  render::bidirectional_tracer<Policy, Caster> tracer(const Policy& exec, const Caster& with) const {
    return {exec, settings_, {arrays_.view(), lights_.view(), true}, with};
  }
  /// The first sample of each pixel.
  template <class Tracer>
  void render_sample(Tracer& tracer) const {
    const render::pinhole camera(host_.view, settings_.width, settings_.height);
    tracer.render_sample(render::no_guide(), camera, 0, 1.0f);
  }

 private:
  render::scene host_;
  render::tracer_settings settings_;
  render::device_scene<Exec> arrays_;
  render::light_distribution<Exec> lights_;
  render::bvh_scene<Exec> hierarchy_;
};

/// The floor: an iteration's rays.
template <class Exec>
class recorded_rays {
 public:
  recorded_rays(const Exec& exec, const traced_scene<Exec>& scene) : exec_(exec), caster_(scene.caster()) {
    record(scene);  // counts them
    rays_ = {exec, ends_.back()};
    any_hit_ = {exec, rays_.size()};
    found_ = {exec, rays_.size()};
    record(scene);
  }

  void operator()() const {
    std::size_t first = 0;
    for (const std::size_t end : ends_) {
      exec_.for_each(end - first,
                     cast_recorded{caster_, first, wfpg::array_view<const wfpg::ray>(rays_.view()),
                                   wfpg::array_view<const std::uint8_t>(any_hit_.view()), found_.view()});
      first = end;
    }
  }

  std::size_t size() const { return rays_.size(); }
  std::size_t kernels() const { return ends_.size(); }
  double any_hit_fraction() const {
    std::size_t any = 0;
    for (const std::uint8_t k : any_hit_.to_host(exec_)) any += k;
    return static_cast<double>(any) / static_cast<double>(size());
  }

 private:
  void record(const traced_scene<Exec>& scene) {
    const wfpg::buffer<std::uint32_t, Exec> count(exec_, std::vector<std::uint32_t>{0});
    ends_.clear();
    const noting<Exec> policy(exec_, count.data(), ends_);
    auto tracer =
        scene.tracer(policy, recording_caster{caster_, {count.data(), rays_.view(), any_hit_.view()}});
    scene.render_sample(tracer);
    policy.note();
  }

  Exec exec_;
  render::bvh_caster caster_;
  std::vector<std::size_t> ends_;  // of each kernel's rays
  wfpg::buffer<wfpg::ray, Exec> rays_;
  wfpg::buffer<std::uint8_t, Exec> any_hit_;
  wfpg::buffer<std::uint32_t, Exec> found_;
};

template <class Exec>
void iteration(benchmark::State& state) {
  const Exec exec;
  const traced_scene<Exec> scene(exec, state.range(0) != 0 ? "mirror-balls" : "caustic-pool",
                                 state.range(1) != 0);
  const recorded_rays<Exec> floor(exec, scene);
  auto tracer = scene.tracer(exec, scene.caster());
  compare(
      state, exec, [&] { scene.render_sample(tracer); }, floor);
  state.counters["rays_a_pixel"] = static_cast<double>(floor.size()) / static_cast<double>(scene.pixels());
  state.counters["any_hit"] = floor.any_hit_fraction();
  state.counters["kernels"] = static_cast<double>(floor.kernels());
  state.counters["dropped"] = static_cast<double>(tracer.dropped());
}

WFPG_BENCH_STAGE(iteration, {"mirror_balls", "merges"}, sizes::iteration);

}  // namespace
}  // namespace bench
