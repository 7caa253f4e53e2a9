// Plain path tracing behind the guider's interface, so that both methods share one loop and differ only in
// where directions come from.
#pragma once

#include <wfpg/light_guide.hpp>
#include <wfpg/mis.hpp>
#include <wfpg/path_recorder.hpp>
#include <wfpg/wave.hpp>

#include <cstdint>

namespace render {

/// Draws a direction for each ray from its BSDF, with the numbers that a guider would use for that: a
/// guider's unguided sample is the same.
template <class Surfaces, class Random>
struct sample_bsdfs {
  Surfaces surfaces;
  Random random;
  wfpg::array_view<wfpg::sampled_direction> directions;

  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const auto surface = surfaces(ray);
    directions[i] = {};
    if (surface.active) directions[i] = wfpg::guide_mixture{}.sample(surface, 0.0f, random(ray, 1));
  }
};

/// The density with which sample_bsdfs draws each ray's query direction.
template <class Surfaces, class Query>
struct query_bsdfs {
  Surfaces surfaces;
  Query query;
  wfpg::array_view<float> densities;

  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const auto surface = surfaces(ray);
    const wfpg::vec3 direction = query(ray);
    const bool asked = surface.active && direction != wfpg::vec3(0.0f);
    densities[i] = asked ? wfpg::guide_mixture{}.pdf(surface, direction) : 0.0f;
  }
};

/// A guider that does not guide.
template <class Exec>
class unguided {
 public:
  explicit unguided(const Exec& exec) : exec_(exec) {}

  void begin_sample() {}
  void end_sample() {}
  wfpg::no_path_recorder recorder() const { return {}; }
  wfpg::light_guide_view lights() const { return {}; }

  template <class Wave, class Caster>
  void sample_directions(const Wave& wave, const Caster&,
                         wfpg::array_view<wfpg::sampled_direction> directions) const {
    exec_.for_each(wave.ray_count, sample_bsdfs<decltype(wave.surfaces), decltype(wave.random)>{
                                       wave.surfaces, wave.random, directions});
  }
  template <class Wave, class Caster, class Query>
  void sample_directions(const Wave& wave, const Caster& caster,
                         wfpg::array_view<wfpg::sampled_direction> directions,
                         const wfpg::density_queries<Query>& queries) const {
    sample_directions(wave, caster, directions);
    exec_.for_each(wave.ray_count, query_bsdfs<decltype(wave.surfaces), Query>{wave.surfaces, queries.query,
                                                                               queries.densities});
  }

 private:
  Exec exec_;
};

}  // namespace render
