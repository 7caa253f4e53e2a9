// Plain path tracing behind the guider's interface, so that both methods share one loop and differ only in
// where directions come from.
#pragma once

#include <wfpg/light_guide.hpp>
#include <wfpg/mis.hpp>
#include <wfpg/path_recorder.hpp>
#include <wfpg/wave.hpp>

#include <cstdint>
#include <type_traits>

namespace render {

/// Draws a direction for each ray from its BSDF, with the numbers that a guider would use for that: a
/// guider's unguided sample is the same. Says with what density it draws the ray's query direction.
template <class Surfaces, class Random, class Queries>
struct sample_bsdfs {
  Surfaces surfaces;
  Random random;
  Queries queries;
  wfpg::array_view<wfpg::sampled_direction> directions;

  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    const auto surface = surfaces(ray);
    const wfpg::guide_mixture bsdf_alone;
    directions[i] = {};
    if (surface.active) directions[i] = bsdf_alone.sample(surface, 0.0f, random(ray, 1));
    if constexpr (!std::is_same_v<Queries, wfpg::no_queries>) {
      const wfpg::vec3 direction = queries.query(ray);
      const bool asked = surface.active && direction != wfpg::vec3(0.0f);
      queries.densities[i] = asked ? bsdf_alone.pdf(surface, direction) : 0.0f;
    }
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

  template <class Wave, class Caster, class Queries = wfpg::no_queries>
  void sample_directions(const Wave& wave, const Caster&,
                         wfpg::array_view<wfpg::sampled_direction> directions,
                         const Queries& queries = {}) const {
    exec_.for_each(wave.ray_count, sample_bsdfs<decltype(wave.surfaces), decltype(wave.random), Queries>{
                                       wave.surfaces, wave.random, queries, directions});
  }

 private:
  Exec exec_;
};

}  // namespace render
