// A guider whose octree is made from the hits of the first sample, for a renderer that has no triangles in
// hand.
#pragma once

#include "tracer/unguided.hpp"

#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guides/octree/deposit_paths.hpp>
#include <wfpg/octree/fragments_from_hits.hpp>
#include <wfpg/octree/surface_collector.hpp>

#include <algorithm>
#include <cstddef>
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
        hits_(std::in_place, exec, options.max_paths * options.max_depth),
        first_(exec, first_settings(options)) {
    // The first sample has no octree, whatever the options say.
    options_.unguided_samples = std::max(options.unguided_samples, 1u);
    options_.least_gain = 0.0f;  // nor has its recorder paths to compare with
  }

  /// The guider. Precondition: a sample has ended.
  Guider& guider() { return *guider_; }

  void begin_sample() {
    if (guider_) guider_->begin_sample();
  }
  void end_sample() {
    if (guider_) return guider_->end_sample();
    const auto samples = hits_->samples(exec_);
    const wfpg::bounds3 box = wfpg::bounds_of_samples(exec_, samples.view());
    guider_.emplace(exec_, wfpg::fragments_from_hits(exec_, samples.view(), options_.octree_resolution, box),
                    options_);
    hits_.reset();
    learn_first_sample();
  }
  auto recorder() const { return guider_ ? guider_->recorder() : first_.view(); }
  float sample_weight() const { return guider_ ? guider_->sample_weight() : 1.0f; }
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
  /// The guider's first sample is the one that was traced without it.
  void learn_first_sample() {
    guider_->begin_sample();
    // A deposit beyond the guider's own would be dropped, on several threads at random.
    if (first_.recorded() <= guider_->recorder().recorded())
      wfpg::deposit_paths(exec_, first_, guider_->guide().cache());
    guider_->end_sample();
    first_ = {};
  }

  /// A recorder of about 2^18 vertices.
  static wfpg::path_recorder_settings first_settings(const options_type& options) {
    wfpg::path_recorder_settings settings{options.max_paths, options.max_depth, options.include_emission};
    while (options.max_paths * options.max_depth >> settings.fraction_shift > 1u << 18)
      ++settings.fraction_shift;
    return settings;
  }

  Exec exec_;
  options_type options_;
  unguided<Exec> unguided_;
  std::optional<wfpg::surface_collector<Exec>> hits_;  // until the first sample ends
  wfpg::path_recorder<Exec> first_;                    // of the first sample's paths
  std::optional<Guider> guider_;                       // from then on
};

}  // namespace render
