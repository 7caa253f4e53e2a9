// A guider whose octree is made from the hits of the first sample, for a renderer that has no triangles in
// hand.
#pragma once

#include "tracer/unguided.hpp"

#include <wfpg/octree/surface_collector.hpp>
#include <wfpg/octree/voxelizer.hpp>

#include <cstdint>
#include <optional>

namespace render {

/// Writes the surfaces of a wave's rays, each into a slot of its own.
template <class Surfaces>
struct collect_surfaces {
  Surfaces surfaces;
  std::size_t first;  ///< slot of the wave
  wfpg::surface_collector_view collector;

  WFPG_HD void operator()(std::size_t i) const {
    const auto at = surfaces(static_cast<std::uint32_t>(i));
    if (at.active) collector.add(first + i, at.position, at.geometric_normal);
  }
};

/// Traces the first sample without a guide and collects its hits. A Guider takes the samples after it.
template <class Exec, class Guider>
class collecting_guider {
 public:
  using options_type = typename Guider::options_type;

  collecting_guider(const Exec& exec, const options_type& options)
      : exec_(exec),
        options_(options),
        unguided_(exec),
        hits_(std::in_place, exec, options.max_paths * options.max_depth) {}

  /// The guider. Precondition: a sample has ended.
  Guider& guider() { return *guider_; }

  void begin_sample() {
    if (guider_) guider_->begin_sample();
  }
  void end_sample() {
    if (guider_) return guider_->end_sample();
    const auto samples = hits_->samples(exec_);
    const wfpg::bounds3 box = wfpg::bounds_of_samples(exec_, samples.view());
    guider_.emplace(exec_,
                    wfpg::fragments_from_samples(exec_, samples.view(), options_.octree_resolution, box),
                    options_);
    hits_.reset();
  }
  auto recorder() const {
    using recorder_type = decltype(guider_->recorder());
    return guider_ ? guider_->recorder() : recorder_type();
  }
  auto lights() const { return guider_ ? guider_->lights() : wfpg::light_guide_view(); }

  template <class Wave, class Caster, class... Queries>
  void sample_directions(const Wave& wave, const Caster& caster,
                         wfpg::array_view<wfpg::sampled_direction> directions, const Queries&... queries) {
    if (guider_) return guider_->sample_directions(wave, caster, directions, queries...);
    exec_.for_each(wave.ray_count, collect_surfaces<decltype(wave.surfaces)>{
                                       wave.surfaces, wave.depth * wave.ray_count, hits_->view()});
    unguided_.sample_directions(wave, caster, directions, queries...);
  }

 private:
  Exec exec_;
  options_type options_;
  unguided<Exec> unguided_;
  std::optional<wfpg::surface_collector<Exec>> hits_;  // until the first sample ends
  std::optional<Guider> guider_;                       // from then on
};

}  // namespace render
