// Implementation of kept_guide.hpp.
#pragma once

#include <wfpg/guides/octree/kept_guide.hpp>

namespace wfpg {

template <class Exec>
template <class Surfaces, class Random, class Caster>
guide_view kept_guide<Exec>::prepare(const sample_context<Exec>& at, const wave<Surfaces, Random>& w,
                                     const Caster& caster) {
  const auto timed = at.clock.time(stage::fields);
  // An unguided sample counts rays, so that bins are known when guiding starts.
  if (at.guided) return store_.prepare(at.exec, kept_wave(at, w), caster, options_.caster_buffer_bytes);
  if (w.depth < options_.guided_depths)  // bins are for rays that are to have fields
    store_.count(at.exec, w.ray_count,
                 wave_rays<Surfaces>{w.surfaces, options_.mode, at.guided_next, scene::first_path()},
                 at.guided_next.log2_divisor());
  return {};
}

/// Finds fields and samples them in one pass where none is built in between. Otherwise prepares the wave, and
/// samples in a second pass.
template <class Exec>
template <class FieldSampler, class Surfaces, class Random, class Caster, class Sampler>
void kept_guide<Exec>::sample_fields(const sample_context<Exec>& at, const wave<Surfaces, Random>& w,
                                     const Caster& caster, const Sampler& sampler) {
  if (at.guided && !store_.builds_in_wave()) {
    const auto timed = at.clock.time(stage::sample);
    const kept_field_wave<Surfaces> kept = kept_wave(at, w);
    store_.find_and_sample(at.exec, kept, FieldSampler{sampler, store_.fields(kept.points)});
    return;
  }
  const guide_view view = prepare(at, w, caster);
  const auto timed = at.clock.time(stage::sample);
  if (at.guided)
    at.exec.for_each(w.ray_count, detail::sample_view<FieldSampler>{{sampler, view.fields()}, view});
  else
    at.exec.for_each(w.ray_count, sample_bsdf<Sampler>{sampler, {}});
}

}  // namespace wfpg
