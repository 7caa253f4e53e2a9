// Implementation of transient_guide.hpp.
#pragma once

#include <wfpg/guides/octree/transient_guide.hpp>

namespace wfpg {

template <class Exec>
const transient_guide_options& transient_guide<Exec>::checked(const transient_guide_options& o) {
  require(o.field_resolution >= 2 && o.field_resolution <= 128, "field_resolution", o.field_resolution,
          "in [2, 128]");
  require(o.min_field_resolution >= 2 && o.min_field_resolution <= 128, "min_field_resolution",
          o.min_field_resolution, "in [2, 128]");
  for (std::uint32_t depth = 0; depth < 8; ++depth)  // 128 cells are halved no more than 7 times
    detail::require_product_resolution(scene::product_resolution(o), "field_resolution at a depth",
                                       resolution_at(o, depth));
  return o;
}

template <class Exec>
template <class Surfaces, class Random>
bin_fields<Surfaces> transient_guide<Exec>::bin_wave(const sample_context<Exec>& at,
                                                     const wave<Surfaces, Random>& w) {
  // Counting is a part of binning, and is timed with it.
  const auto timed = at.clock.time(stage::bin);
  const wave_rays<Surfaces> rays{w.surfaces, options_.mode, at.guided_paths, scene::first_path()};
  const bins_view bins = binner_.bin(at.exec, w.ray_count, rays, ranks_.ranks());
  const std::uint32_t size = field_resolution(w.depth);
  bin_fields<Surfaces> fields{bins,          w.surfaces, scene::cache(),        options_.field,
                              options_.mode, size,       hash(at.seed, w.depth)};
  if (ranks_) ranks_.share(at.exec, fields, rays);
  at.exec.for_each(1, detail::add_counts{bins, binner_.unbinned(), ranks_.count(), size * size,
                                         scene::depth_counts(w.depth)});
  return fields;
}

template <class Exec>
template <class Surfaces, class Random, class Caster, class Sampler>
void transient_guide<Exec>::sample_wave(const sample_context<Exec>& at, const wave<Surfaces, Random>& w,
                                        const Caster& caster, const Sampler& sampler) {
  // Rays without a bin: all of them in unguided samples.
  sample_bsdf<Sampler> rest{sampler, {}};
  if (at.guided) {
    const auto fields = bin_wave(at, w);
    rest.ray_keys = fields.bins.ray_keys;
    const auto timed = at.clock.time(stage::fields);
    const product_points points = scene::draw_points(at, w.depth);
    // Binned rays are sampled while their field is in scratch memory.
    const transient_sink<Sampler> sink{fields.bins, sampler, scene::fraction(), fields.resolution, points};
    for_each_field(at.exec, fields, caster, sink, options_.caster_buffer_bytes);
  }
  const auto timed = at.clock.time(stage::sample);
  at.exec.for_each(w.ray_count, rest);
}

template <class Exec>
template <class Surfaces, class Random, class Caster>
guide_view transient_guide<Exec>::prepare(const sample_context<Exec>& at, const wave<Surfaces, Random>& w,
                                          const Caster& caster) {
  if (!at.guided) return {};
  const auto fields = bin_wave(at, w);
  const auto timed = at.clock.time(stage::fields);
  // Memory depends on the number of bins, so the host has to read it.
  const std::size_t bins = read_element(at.exec, fields.bins.count);
  const std::size_t words = bins * grid_distribution::words(fields.resolution);
  // Allocates half more than is needed: the next waves have a few bins more or less, and need not allocate.
  if (resident_fields_.size() < bins) reallocate(at.exec, resident_fields_, bins + bins / 2);
  if (resident_words_.size() < words) reallocate(at.exec, resident_words_, words + words / 2);
  if (field_of_ray_.size() < max_rays_) reallocate(at.exec, field_of_ray_, max_rays_);
  // All bits of no_field are set.
  at.exec.fill_bytes(field_of_ray_.data(), 0xff, w.ray_count * sizeof(no_field));
  for_each_field(at.exec, fields, caster,
                 resident_sink{fields.bins, resident_words_.data(), resident_fields_.data(),
                               field_of_ray_.data(), scene::fraction(), fields.resolution},
                 options_.caster_buffer_bytes);
  return {
      {field_of_ray_.data(), w.ray_count},
      {resident_fields_.data(), resident_words_.data(), fields.resolution, scene::draw_points(at, w.depth)}};
}

}  // namespace wfpg
