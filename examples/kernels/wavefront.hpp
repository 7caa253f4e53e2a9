// The host: one sample of all pixels is a wave that goes from vertex to vertex.
#pragma once

#include "guiding.hpp"
#include "kernels.hpp"
#include "renderer.hpp"

#if KERNELS_CHECK
#include <wfpg/testing/check_host.hpp>
#endif

#include <optional>

namespace kernels {

template <class Device, class Accelerated>
class wavefront : public renderer {
 public:
  wavefront(const render::scene& host, const settings& wanted)
      : wanted_(wanted),
        count_(std::size_t(wanted.width) * std::size_t(wanted.height)),
        arrays_(policy(), host),
        lights_(policy(), host),
        geometry_(std::make_unique<accelerated_geometry<Device, Accelerated>>(host, arrays_.view())),
        camera_(host.view, wanted.width, wanted.height),
        paths_(count_),
        vertices_(count_),
        queues_(count_),
        queue_(count_),
        rays_(count_),
        hits_(count_),
        shadows_(count_),
        hidden_(count_),
        colours_(count_)
#if KERNELS_GUIDE
        ,
        guider_(make_guider(guide_caster<Device>{geometry_.get(), arrays_.view()}, render::bounds_of(host),
                            wanted))
#endif
  {
#if KERNELS_CHECK
    wfpg::testing::host_check_options options;
    options.media = wanted.fog > 0.0f;
    if (wanted.check) checker_.emplace(policy(), count_, wanted.max_depth, options);
#endif
  }

  std::vector<vec3> sample() override {
    wave at = first_wave();
    launch<Device>(count_, start_paths{at, camera_});
#if KERNELS_GUIDE
    guider_.begin_sample();
    weight_ = guider_.sample_weight();
#endif
    for (; at.depth < at.max_depth; ++at.depth) {
      find_vertices_of(at);
      if (at.is_last()) break;
      shade_all(at);
    }
    ++samples_;
#if KERNELS_CHECK
    launch<Device>(count_, write_colours{at, address(colours_), checker()});
    if (checker_) checker_->end_sample(guider_.recorder(), guide_caster<Device>{geometry_.get(), at.scene});
#else
    launch<Device>(count_, write_colours{at, address(colours_)});
#endif
#if KERNELS_GUIDE
    guider_.end_sample();
#endif
    std::vector<vec3> colours(count_);
    ::thrust::copy(colours_.begin(), colours_.end(), colours.begin());
    return colours;
  }

  float weight() const override {
    return weight_;
  }

#if KERNELS_CHECK
  std::string faults() const override {
    return checker_ ? checker_->report().message : "";
  }
  std::string note() const override {
    return checker_ ? checker_->note() : "";
  }
#endif

 private:
  using policy = typename Device::policy;
  template <class T>
  using array = typename Device::template array<T>;

#if KERNELS_CHECK
  wfpg::testing::host_checker_view checker() const {
    return checker_ ? checker_->view() : wfpg::testing::host_checker_view();
  }
#endif

  wave first_wave() {
    wave at;
    at.scene = arrays_.view();
    at.lights = lights_.view();
    at.random = {wanted_.seed, samples_};
    at.max_depth = wanted_.max_depth;
    at.fog = wanted_.fog;
    at.paths = address(paths_);
    at.vertices = address(vertices_);
    at.queues = address(queues_);
    at.rays = address(rays_);
    at.hits = address(hits_);
    at.shadows = address(shadows_);
    at.hidden = address(hidden_);
    return at;
  }

  void find_vertices_of(const wave& at) {
    launch<Device>(count_, write_rays{at});
    geometry_->trace(at.rays, count_, at.hits);
#if KERNELS_GUIDE
    launch<Device>(count_, find_vertices{at, guider_.recorder()});
#else
    launch<Device>(count_, find_vertices{at});
#endif
  }

  void shade_all(const wave& at) {
#if KERNELS_GUIDE
    view_ = guider_.prepare(at.depth, guide_caster<Device>{geometry_.get(), at.scene});
#endif
    launch<Device>(count_, ask_nothing{at});
    shade_queue<matte>(at);
    shade_queue<metal>(at);
    shade_queue<mirror>(at);
    shade_queue<glass>(at);
    shade_queue<frosted_glass>(at);
    shade_queue<varnish>(at);
    shade_queue<paint>(at);
    launch<Device>(fill_queue(fog_queue), scatter_in_fog{at, address(queue_)});
    geometry_->occluded(at.rays, count_, at.hidden);
#if KERNELS_GUIDE
    launch<Device>(count_, add_light{at, guider_.recorder()});
#else
    launch<Device>(count_, add_light{at});
#endif
  }

  std::size_t fill_queue(std::uint32_t wanted) {
    return select<Device>(count_, is_in_queue{address(queues_), wanted}, address(queue_));
  }

  template <class Bsdf>
  void shade_queue(const wave& at) {
    const std::size_t n = fill_queue(static_cast<std::uint32_t>(Bsdf::kind));
#if KERNELS_CHECK
    launch<Device>(
        n, shade<Bsdf>{at, address(queue_), wanted_.roulette_depth, view_, guider_.recorder(), checker()});
#elif KERNELS_GUIDE
    launch<Device>(n, shade<Bsdf>{at, address(queue_), wanted_.roulette_depth, view_, guider_.recorder()});
#else
    launch<Device>(n, shade<Bsdf>{at, address(queue_), wanted_.roulette_depth});
#endif
  }

  settings wanted_;
  std::size_t count_;
  render::device_scene<policy> arrays_;
  render::light_distribution<policy> lights_;
  std::unique_ptr<const geometry<Device>> geometry_;
  render::pinhole camera_;
  array<path> paths_;
  array<vertex> vertices_;
  array<std::uint32_t> queues_, queue_;
  array<ray> rays_;
  array<triangle_hit> hits_;
  array<spectrum> shadows_;
  array<std::uint32_t> hidden_;
  array<vec3> colours_;
  std::uint32_t samples_ = 0;
  float weight_ = 1.0f;  // of the last one
#if KERNELS_GUIDE
  guider_on<Device> guider_;
  wfpg::guide_view view_;
#endif
#if KERNELS_CHECK
  std::optional<wfpg::testing::host_checker<policy>> checker_;
#endif
};

}  // namespace kernels
