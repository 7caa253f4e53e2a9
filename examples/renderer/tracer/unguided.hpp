// Plain path tracing behind the guider's interface. All methods share one loop and differ only in their
// directions.
#pragma once

#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/octree/light_guide.hpp>
#include <wfpg/host/wave.hpp>
#include <wfpg/sampling/sampled_direction.hpp>

namespace render {

/// What a tracer whose directions come from no guide is given in place of one.
struct no_guide {};

/// A guider that does not guide. Each ray samples its BSDF, in the same pass as a guider's unguided waves.
template <class Exec>
class unguided {
 public:
  explicit unguided(const Exec& exec) : exec_(exec) {}

  void begin_sample() {}
  void end_sample() {}
  wfpg::no_path_recorder recorder() const { return {}; }
  wfpg::light_guide_view lights() const { return {}; }
  float sample_weight() const { return 1.0f; }

  template <class Wave, class Caster, class Queries = wfpg::no_queries>
  void sample_directions(const Wave& wave, const Caster&,
                         wfpg::array_view<wfpg::sampled_direction> directions,
                         const Queries& queries = {}) const {
    using sampler = wfpg::sample_ray<decltype(wave.surfaces), decltype(wave.random), Queries>;
    exec_.for_each(wave.ray_count,
                   wfpg::sample_bsdf<sampler>{{wave.surfaces, wave.random, queries, directions}, {}});
  }

 private:
  Exec exec_;
};

}  // namespace render
