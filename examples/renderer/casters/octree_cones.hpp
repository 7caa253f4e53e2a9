// Cones that find light through the octree alone, in place of the scene's ray caster.
#pragma once

#include "app/render.hpp"
#include "scene/environment.hpp"

#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/svo_cone_caster.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>
#include <wfpg/path_guider.hpp>

namespace render {

/// A guider's caster: marches to the first voxel, or gathers.
class octree_caster {
 public:
  octree_caster(const wfpg::exitance_cache_view& cache, const wfpg::voxel_opacity_view& opacity,
                const environment_view& environment, cones how)
      : cache_(cache), opacity_(opacity), environment_(environment), gathers_(how == cones::trace) {}

  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& axis, float solid_angle) const {
    const float beyond = wfpg::luminance(environment_.radiance(axis.direction));
    if (gathers_) return wfpg::svo_cone_caster(cache_, opacity_, beyond)(axis, solid_angle);
    return wfpg::svo_ray_caster(cache_.octree(), beyond)(axis);
  }
  WFPG_HD wfpg::ray_hit operator()(const wfpg::ray& ray) const { return (*this)(ray, 0.0f); }

 private:
  wfpg::exitance_cache_view cache_;
  wfpg::voxel_opacity_view opacity_;
  environment_view environment_;
  bool gathers_;
};

/// A guider with this caster. The guider must outlive it.
template <class Exec, class Guider>
class octree_cone_guider {
 public:
  octree_cone_guider(const Exec& exec, Guider& guider, const environment_view& environment, cones how)
      : guider_(guider),
        opacity_(exec, guider.guide().octree()),
        caster_(guider.guide().cache(), opacity_.view(), environment, how) {}

  void begin_sample() { guider_.begin_sample(); }
  void end_sample() { guider_.end_sample(); }
  bool resting() const { return guider_.resting(); }
  wfpg::recorded_runs guided_paths() const { return guider_.guided_paths(); }
  auto recorder() const { return guider_.recorder(); }
  auto lights() const { return guider_.lights(); }
  float sample_weight() const { return guider_.sample_weight(); }

  template <class Wave, class Caster, class... Queries>
  void sample_directions(const Wave& wave, const Caster&,
                         wfpg::array_view<wfpg::sampled_direction> directions, const Queries&... queries) {
    guider_.sample_directions(wave, caster_, directions, queries...);
  }

 private:
  Guider& guider_;
  wfpg::voxel_opacity<Exec> opacity_;
  octree_caster caster_;
};

}  // namespace render
