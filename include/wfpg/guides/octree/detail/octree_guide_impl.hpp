// Implementation of octree_guide.hpp.
#pragma once

#include <wfpg/guides/octree/octree_guide.hpp>

namespace wfpg {
namespace detail {

/// Adds a wave's bins to its depth's sums.
struct add_counts {
  bins_view bins;
  const std::uint32_t* unbinned;
  std::uint32_t cells;
  depth_statistics* sums;
  WFPG_HD void operator()(std::size_t) const {
    const std::uint32_t n = *bins.count;
    sums->bins += n;
    sums->rays += bins.offsets[n];
    sums->unbinned += *unbinned;
    sums->cones += std::uint64_t(n) * cells;
  }
};

}  // namespace detail

template <class Exec>
const guider_options& octree_guide<Exec>::checked(const guider_options& o) {
  detail::require_resolution(o.octree_resolution);
  require(o.rays_per_bin >= 1, "rays_per_bin", o.rays_per_bin, "at least 1");
  require(o.field_resolution >= 2 && o.field_resolution <= 128, "field_resolution", o.field_resolution,
          "in [2, 128]");
  require(o.min_field_resolution >= 2 && o.min_field_resolution <= 128, "min_field_resolution",
          o.min_field_resolution, "in [2, 128]");
  require(o.field.filter_alpha >= 0.0f, "field.filter_alpha", o.field.filter_alpha, "finite, at least 0");
  require(o.field.floor >= 0.0f, "field.floor", o.field.floor, "finite, at least 0");
  if (o.fields == field_lifetime::kept)
    detail::require_product_resolution(o.product_resolution, "kept.resolution", o.kept.resolution);
  else
    for (std::uint32_t depth = 0; depth < 8; ++depth)  // 128 cells are halved no more than 7 times
      detail::require_product_resolution(o.product_resolution, "field_resolution at a depth",
                                         resolution_at(o, depth));
  require(o.product_resolution == 0 || o.guide_fraction < 1.0f, "guide_fraction", o.guide_fraction,
          "less than 1 with products, which do not reach all that a BSDF does");
  detail::require_valid(o.lights);
  require(o.deposit_capacity <= detail::most_queued, "deposit_capacity", o.deposit_capacity, "at most 2^31");
  return o;
}

template <class Exec>
std::size_t octree_guide<Exec>::deposits_of_sample() const {
  if (options_.deposit_capacity > 0) return options_.deposit_capacity;
  return recorded().vertices("deposits_per_leaf, or deposit_capacity");
}

template <class Exec>
octree_guide<Exec>::octree_guide(const Exec& exec, const Exec& working, voxel_fragments<Exec> fragments,
                                 const guider_options& options)
    : options_(checked(options)),
      build_(fragments.report),
      octree_(exec, fragments),
      cache_(exec, octree_, fragments, deposits_of_sample()),
      product_points_(working, std::size_t(2) * options_.product_resolution * options_.product_resolution),
      counts_(working, options_.max_depth) {
  const binning_options binning{options_.min_bin_level, options_.rays_per_bin};
  if (keeps_fields())
    store_ = field_store<Exec>(working, octree_.view(), binning, options_.kept, options_.max_rays,
                               deposits_of_sample());
  else
    binner_ = spatial_binner<Exec>(working, octree_.view(), binning, options_.max_rays);
  lights_ = light_guide<Exec>(working, octree_.view(), options_.lights,
                              max(options_.max_paths, options_.max_rays), options_.max_depth);
  octree_.release_build_data();
  ::thrust::fill_n(working.thrust(), counts_.data(), counts_.size(), depth_statistics{});
  const std::uint32_t p = options_.product_resolution;
  product_point* const hemisphere = product_points_.data();
  if (p > 0) working.for_each(std::size_t(p) * p, measure_product_blocks{hemisphere, hemisphere + p * p, p});
}

template <class Exec>
void octree_guide<Exec>::begin_sample(const guide_sample<Exec>& at) {
  if (keeps_fields()) store_.begin_sample(at.exec, at.number);
  lights_.begin_sample(static_cast<std::uint32_t>(at.seed));
}

template <class Exec>
void octree_guide<Exec>::update(const guide_sample<Exec>& at) {
  // A host that made room for deposits of its own may have made some in any sample.
  const bool told = told_ || options_.deposit_capacity > 0;
  if (told) cache_.update(at.exec);
  if (keeps_fields()) store_.end_sample(at.exec, told);
  lights_.end_sample(at.exec);
  told_ = false;
}

template <class Exec>
void octree_guide<Exec>::forget_light(const Exec& exec) {
  cache_.clear(exec);
  if (keeps_fields()) store_.forget(exec);
  lights_.forget(exec);
}

template <class Exec>
std::uint32_t octree_guide<Exec>::resolution_at(const guider_options& options, std::uint32_t depth) {
  const std::uint32_t least = min(options.min_field_resolution, options.field_resolution);
  return depth < 32 ? max(options.field_resolution >> depth, least) : least;
}

/// Where a wave's products evaluate BSDFs.
template <class Exec>
product_points octree_guide<Exec>::points_at(const guide_sample<Exec>& at, std::uint32_t depth) {
  const std::uint32_t p = options_.product_resolution;
  if (p == 0) return {};
  product_point* const hemisphere = product_points_.data();
  at.exec.for_each(std::size_t(p) * p,
                   draw_product_points{hemisphere, hemisphere + p * p, p, hash(at.seed, depth)});
  return {hemisphere, hemisphere + p * p, p};
}

template <class Exec>
mixture_fraction octree_guide<Exec>::fraction() const {
  if (options_.guide_fraction > 0.0f) return {options_.guide_fraction, options_.guide_fraction, 0};
  if (options_.mode == guiding_mode::plain) return {0.5f, 0.5f, 0};
  return {0.7f, 0.5f, options_.rays_per_bin};
}

template <class Exec>
template <class Surfaces, class Random>
bin_fields<Surfaces> octree_guide<Exec>::bin_wave(const guide_sample<Exec>& at,
                                                  const wave<Surfaces, Random>& w) {
  const auto timed = at.clock.time(stage::bin);
  const bins_view bins = binner_.bin(at.exec, w.ray_count, wave_rays<Surfaces>{w.surfaces, options_.mode});
  const std::uint32_t size = field_resolution(w.depth);
  at.exec.for_each(1, detail::add_counts{bins, binner_.unbinned(), size * size, depth_counts(w.depth)});
  return {bins, w.surfaces, cache_.view(), options_.field, options_.mode, size, hash(at.seed, w.depth)};
}

template <class Exec>
template <class Surfaces, class Random, class Caster, class Serve>
void octree_guide<Exec>::serve(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w,
                               const Caster& caster, const Serve& serve) {
  if (!keeps_fields())
    serve_transient(at, w, caster, serve);
  else if (options_.product_resolution > 0)
    serve_kept<detail::serve_product<Serve>>(at, w, caster, serve);
  else
    serve_kept<detail::serve_field<Serve>>(at, w, caster, serve);
}

/// What kept fields are made for.
template <class Exec>
template <class Surfaces, class Random>
kept_field_wave<Surfaces> octree_guide<Exec>::kept_wave(const guide_sample<Exec>& at,
                                                        const wave<Surfaces, Random>& w) {
  return {w.ray_count,
          w.surfaces,
          cache_.view(),
          options_.field,
          options_.mode,
          fraction().with_enough_rays,
          hash(at.seed, w.depth),
          points_at(at, w.depth),
          depth_counts(w.depth)};
}

/// Kept fields: found, made and refreshed.
template <class Exec>
template <class Surfaces, class Random, class Caster>
guide_view octree_guide<Exec>::keep_wave(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w,
                                         const Caster& caster) {
  const auto timed = at.clock.time(stage::fields);
  if (at.guided) return store_.prepare(at.exec, kept_wave(at, w), caster, options_.caster_buffer_bytes);
  if (w.depth < options_.guided_depths)  // bins are for rays that are to have fields
    store_.count(at.exec, w.ray_count, wave_rays<Surfaces>{w.surfaces, options_.mode});
  return {};
}

/// The same, and drawn from, in one pass where no field is to be made in between.
template <class Exec>
template <class ServeField, class Surfaces, class Random, class Caster, class Serve>
void octree_guide<Exec>::serve_kept(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w,
                                    const Caster& caster, const Serve& serve) {
  if (at.guided && !store_.builds_in_wave()) {
    const auto timed = at.clock.time(stage::serve);
    const kept_field_wave<Surfaces> kept = kept_wave(at, w);
    store_.find_and_serve(at.exec, kept, ServeField{serve, store_.fields(kept.points)});
    return;
  }
  const guide_view view = keep_wave(at, w, caster);
  const auto timed = at.clock.time(stage::serve);
  if (at.guided)
    at.exec.for_each(w.ray_count, detail::serve_view<ServeField>{{serve, view.fields()}, view});
  else
    at.exec.for_each(w.ray_count, serve_unbinned<Serve>{serve, {}});
}

/// Transient fields in scratch memory.
template <class Exec>
template <class Surfaces, class Random, class Caster, class Serve>
void octree_guide<Exec>::serve_transient(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w,
                                         const Caster& caster, const Serve& serve) {
  serve_unbinned<Serve> rest{serve, {}};
  if (at.guided) {
    const auto fields = bin_wave(at, w);
    rest.ray_keys = fields.bins.ray_keys;
    const auto timed = at.clock.time(stage::fields);
    const product_points points = points_at(at, w.depth);
    const transient_sink<Serve> sink{fields.bins, serve, fraction(), fields.resolution, points};
    for_each_field(at.exec, fields, caster, sink, options_.caster_buffer_bytes);
  }
  const auto timed = at.clock.time(stage::serve);
  at.exec.for_each(w.ray_count, rest);
}

/// Transient fields in memory of their own.
template <class Exec>
template <class Surfaces, class Random, class Caster>
guide_view octree_guide<Exec>::make_resident(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w,
                                             const Caster& caster) {
  if (!at.guided) return {};
  const auto fields = bin_wave(at, w);
  const auto timed = at.clock.time(stage::fields);
  const std::size_t bins = read_element(at.exec, fields.bins.count);
  const std::size_t words = bins * grid_distribution::words(fields.resolution);
  // Half more than is needed: the next waves have a few bins more or less, and are not to allocate.
  if (resident_fields_.size() < bins) reallocate(at.exec, resident_fields_, bins + bins / 2);
  if (resident_words_.size() < words) reallocate(at.exec, resident_words_, words + words / 2);
  if (field_of_ray_.size() < options_.max_rays) reallocate(at.exec, field_of_ray_, options_.max_rays);
  ::thrust::fill_n(at.exec.thrust(), field_of_ray_.data(), w.ray_count, no_field);
  for_each_field(at.exec, fields, caster,
                 resident_sink{fields.bins, resident_words_.data(), resident_fields_.data(),
                               field_of_ray_.data(), fraction(), fields.resolution},
                 options_.caster_buffer_bytes);
  return {{field_of_ray_.data(), w.ray_count},
          {resident_fields_.data(), resident_words_.data(), fields.resolution, points_at(at, w.depth)}};
}

template <class Exec>
void octree_guide<Exec>::report(const Exec& exec, guider_statistics& statistics) const {
  statistics.depths = counts_.to_host(exec);
  statistics.deposits = cache_.dropped(exec);
  if (keeps_fields()) statistics.kept = store_.statistics(exec);
  statistics.build = build_;
}

template <class Exec>
std::vector<memory_part> octree_guide<Exec>::memory() const {
  const std::size_t resident = resident_words_.bytes() + resident_fields_.bytes() + field_of_ray_.bytes();
  const std::size_t binning =
      binner_.bytes() + store_.wave_bytes() + counts_.bytes() + product_points_.bytes();
  const std::size_t values = store_.value_bytes() + lights_.transient_bytes();
  return {{"octree", octree_.bytes(), true},
          {"cache", cache_.persistent_bytes(), true},
          {"kept fields", store_.slot_bytes(), true},
          {"levels", store_.level_bytes(), true},
          {"lights", lights_.persistent_bytes(), true},
          {"deposits", cache_.transient_bytes() + values, false},
          {"binning", binning, false},
          {"fields", resident, false}};
}

}  // namespace wfpg
