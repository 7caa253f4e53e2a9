// Implementation of path_guider.hpp.
#pragma once

#include <wfpg/path_guider.hpp>

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
const guider_options& path_guider<Exec>::checked(const guider_options& o) {
  using detail::require;
  detail::require_resolution(o.octree_resolution);
  require(o.rays_per_bin >= 1, "rays_per_bin", o.rays_per_bin, "at least 1");
  require(o.field_resolution >= 2 && o.field_resolution <= 128, "field_resolution", o.field_resolution,
          "in [2, 128]");
  require(o.min_field_resolution >= 2 && o.min_field_resolution <= 128, "min_field_resolution",
          o.min_field_resolution, "in [2, 128]");
  require(o.guide_fraction >= 0.0f && o.guide_fraction <= 1.0f, "guide_fraction", o.guide_fraction,
          "in [0, 1]");
  require(detail::is_finite(o.field.filter_alpha) && o.field.filter_alpha >= 0.0f, "field.filter_alpha",
          o.field.filter_alpha, "finite, at least 0");
  require(detail::is_finite(o.field.floor) && o.field.floor >= 0.0f, "field.floor", o.field.floor,
          "finite, at least 0");
  require(o.max_depth >= 1 && o.max_depth <= 1024, "max_depth", o.max_depth, "in [1, 1024]");
  require(o.max_paths < 0xffffffffull, "max_paths", o.max_paths, "less than 2^32 - 1");
  require(o.max_rays < 0xffffffffull, "max_rays", o.max_rays, "less than 2^32 - 1");
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
  require(o.max_paths * o.max_depth < 0xffffffffull, "max_paths times max_depth, the vertices of a sample,",
          o.max_paths * o.max_depth, "less than 2^32 - 1");
  return o;
}

template <class Exec>
guider_options path_guider<Exec>::completed(guider_options o) {
  if (o.max_rays == 0) o.max_rays = o.max_paths;
  return o;
}

/// Of so many paths, a power of two, one is recorded: the power.
template <class Exec>
std::uint32_t path_guider<Exec>::share_shift() const {
  if (options_.deposits_per_leaf == 0) return 0;
  const std::uint64_t wanted = std::uint64_t(options_.deposits_per_leaf) * octree_.leaf_count();
  const std::uint64_t all = std::uint64_t(options_.max_paths) * options_.max_depth;
  std::uint32_t shift = 0;
  while (wanted > 0 && all >> (shift + 1) >= wanted) ++shift;
  return shift;
}

template <class Exec>
std::size_t path_guider<Exec>::deposits_of_sample() const {
  if (options_.deposit_capacity > 0) return options_.deposit_capacity;
  const std::size_t recorded = detail::recorded_runs{share_shift()}.size(options_.max_paths);
  detail::require(recorded * options_.max_depth <= detail::most_queued,
                  "max_paths times max_depth, the vertices that are recorded,", recorded * options_.max_depth,
                  "at most 2^31: set deposits_per_leaf, or deposit_capacity");
  return recorded * options_.max_depth;
}

template <class Exec>
path_guider<Exec>::path_guider(const Exec& exec, voxel_fragments<Exec> fragments,
                               const guider_options& options)
    : options_(completed(checked(options))),
      build_(fragments.report),
      octree_(exec, fragments),
      cache_(exec, octree_, fragments, deposits_of_sample()),
      working_memory_(std::make_unique<retaining_resource>(exec.resource())),
      exec_(exec.with_resource(working_memory_.get())),
      recorder_(exec_, options_.max_paths, options_.max_depth, options_.include_emission, share_shift(),
                keeps_fields() && options_.kept.learn),
      product_points_(exec_, std::size_t(2) * options_.product_resolution * options_.product_resolution),
      counts_(exec_, options_.max_depth) {
  const binning_options binning{options_.min_bin_level, options_.rays_per_bin};
  if (keeps_fields())
    store_ = field_store<Exec>(exec_, octree_.view(), binning, options_.kept, options_.max_rays,
                               deposits_of_sample());
  else
    binner_ = spatial_binner<Exec>(exec_, octree_.view(), binning, options_.max_rays);
  lights_ = light_guide<Exec>(exec_, octree_.view(), options_.lights,
                              detail::max(options_.max_paths, options_.max_rays), options_.max_depth);
  octree_.release_build_data();
  ::thrust::fill_n(exec_.thrust(), counts_.data(), counts_.size(), depth_statistics{});
  const std::uint32_t p = options_.product_resolution;
  product_point* const hemisphere = product_points_.data();
  if (p > 0)
    exec_.for_each(std::size_t(p) * p, detail::measure_product_blocks{hemisphere, hemisphere + p * p, p});
}

template <class Exec>
void path_guider<Exec>::begin_sample() {
  const std::uint32_t sample = samples_ + 1;
  // Of many paths fewer do once means have settled.
  const std::uint32_t fewer = share_shift() > 0 && sample > 32 ? 2 : 0;
  const auto seed = static_cast<std::uint32_t>(detail::hash(options_.seed, sample));
  recorder_.begin_sample(exec_, seed, fewer);
  if (keeps_fields()) store_.begin_sample(exec_, sample);
  lights_.begin_sample(seed);
  samples_ = sample;  // last: a call that threw is made again for the same sample
}

template <class Exec>
void path_guider<Exec>::end_sample() {
  {
    const auto timed = clock_.time(detail::stage::record);
    recorder_.deposit(exec_, cache_.view(), store_.learnt());
  }
  const auto timed = clock_.time(detail::stage::cache);
  cache_.update(exec_);
  if (keeps_fields()) store_.end_sample(exec_);
  lights_.end_sample(exec_);
}

template <class Exec>
std::uint32_t path_guider<Exec>::resolution_at(const guider_options& options, std::uint32_t depth) {
  const std::uint32_t least = detail::min(options.min_field_resolution, options.field_resolution);
  return depth < 32 ? detail::max(options.field_resolution >> depth, least) : least;
}

/// Where a wave's products evaluate BSDFs.
template <class Exec>
product_points path_guider<Exec>::points_at(std::uint32_t depth) {
  const std::uint32_t p = options_.product_resolution;
  if (p == 0) return {};
  product_point* const hemisphere = product_points_.data();
  exec_.for_each(std::size_t(p) * p,
                 detail::draw_product_points{hemisphere, hemisphere + p * p, p, wave_seed(depth)});
  return {hemisphere, hemisphere + p * p, p};
}

template <class Exec>
detail::mixture_fraction path_guider<Exec>::fraction() const {
  if (options_.guide_fraction > 0.0f) return {options_.guide_fraction, options_.guide_fraction, 0};
  if (options_.mode == guiding_mode::plain) return {0.5f, 0.5f, 0};
  return {0.7f, 0.5f, options_.rays_per_bin};
}

template <class Exec>
template <class Surfaces, class Random>
detail::bin_fields<Surfaces> path_guider<Exec>::bin_wave(const wave<Surfaces, Random>& w) {
  const auto timed = clock_.time(detail::stage::bin);
  const bins_view bins =
      binner_.bin(exec_, w.ray_count, detail::wave_rays<Surfaces>{w.surfaces, options_.mode});
  const std::uint32_t size = field_resolution(w.depth);
  exec_.for_each(1, detail::add_counts{bins, binner_.unbinned(), size * size, depth_counts(w.depth)});
  return {bins, w.surfaces, cache_.view(), options_.field, options_.mode, size, wave_seed(w.depth)};
}

template <class Exec>
template <class Surfaces, class Random, class Caster, class Queries>
void path_guider<Exec>::sample_directions(const wave<Surfaces, Random>& w, const Caster& caster,
                                          array_view<sampled_direction> directions, const Queries& queries) {
  static_assert(is_surfaces_v<Surfaces>,
                "surfaces: needs wfpg::surface<Bsdf> operator()(std::uint32_t) const");
  static_assert(is_bsdf_v<bsdf_of_t<Surfaces>>,
                "the BSDF needs eval, pdf, sample, is_delta and transmits, all const");
  static_assert(is_random_v<Random>, "random: needs vec2 operator()(std::uint32_t, std::uint32_t) const");
  static_assert(is_ray_caster_v<Caster, Exec>,
                "caster: needs ray_hit operator()(const ray&) const, or cast(exec, rays, hits) const");
  detail::require(w.ray_count <= options_.max_rays, "ray_count", w.ray_count, "at most max_rays");
  detail::require(directions.size() >= w.ray_count, "size of directions", directions.size(),
                  "ray_count or more");
  if constexpr (!std::is_same_v<Queries, no_queries>)
    detail::require(queries.densities.size() >= w.ray_count, "size of densities", queries.densities.size(),
                    "ray_count or more");

  const detail::serve_ray<Surfaces, Random, Queries> serve{w.surfaces, w.random, queries, directions};
  if (!keeps_fields()) return serve_transient(w, caster, serve);
  const guide_view view = keep_wave(w, caster);
  const auto timed = clock_.time(detail::stage::serve);
  if (view.product_resolution() == 0)
    exec_.for_each(w.ray_count, detail::serve_view<decltype(serve)>{serve, view});
  else
    exec_.for_each(w.ray_count, detail::serve_products<decltype(serve)>{serve, view});
}

template <class Exec>
template <class Surfaces, class Random, class Caster>
guide_view path_guider<Exec>::prepare(const wave<Surfaces, Random>& w, const Caster& caster) {
  static_assert(is_surfaces_v<Surfaces>,
                "surfaces: needs wfpg::surface<Bsdf> operator()(std::uint32_t) const");
  static_assert(is_ray_caster_v<Caster, Exec>,
                "caster: needs ray_hit operator()(const ray&) const, or cast(exec, rays, hits) const");
  detail::require(w.ray_count <= options_.max_rays, "ray_count", w.ray_count, "at most max_rays");
  return keeps_fields() ? keep_wave(w, caster) : make_resident(w, caster);
}

/// Kept fields: found, made and refreshed.
template <class Exec>
template <class Surfaces, class Random, class Caster>
guide_view path_guider<Exec>::keep_wave(const wave<Surfaces, Random>& w, const Caster& caster) {
  const auto timed = clock_.time(detail::stage::fields);
  if (!guided()) {
    store_.count(exec_, w.ray_count, detail::wave_rays<Surfaces>{w.surfaces, options_.mode});
    return {};
  }
  const kept_field_wave<Surfaces> wave{w.ray_count,        w.surfaces,         cache_.view(),
                                       options_.field,     options_.mode,      fraction().with_enough_rays,
                                       wave_seed(w.depth), points_at(w.depth), depth_counts(w.depth)};
  return store_.prepare(exec_, wave, caster, options_.caster_buffer_bytes);
}

/// Transient fields in scratch memory.
template <class Exec>
template <class Surfaces, class Random, class Caster, class Serve>
void path_guider<Exec>::serve_transient(const wave<Surfaces, Random>& w, const Caster& caster,
                                        const Serve& serve) {
  detail::serve_unbinned<Serve> rest{serve, {}};
  if (guided()) {
    const auto fields = bin_wave(w);
    rest.ray_keys = fields.bins.ray_keys;
    const auto timed = clock_.time(detail::stage::fields);
    const product_points points = points_at(w.depth);
    const detail::transient_sink<Serve> sink{fields.bins, serve, fraction(), fields.resolution, points};
    detail::for_each_field(exec_, fields, caster, sink, options_.caster_buffer_bytes);
  }
  const auto timed = clock_.time(detail::stage::serve);
  exec_.for_each(w.ray_count, rest);
}

/// Transient fields in memory of their own.
template <class Exec>
template <class Surfaces, class Random, class Caster>
guide_view path_guider<Exec>::make_resident(const wave<Surfaces, Random>& w, const Caster& caster) {
  if (!guided()) return {};
  const auto fields = bin_wave(w);
  const auto timed = clock_.time(detail::stage::fields);
  const std::size_t bins = read_element(exec_, fields.bins.count);
  const std::size_t words = bins * fields.resolution * fields.resolution;
  // Half more than is needed: the next waves have a few bins more or less, and are not to allocate.
  if (resident_fields_.size() < bins) reallocate(resident_fields_, bins + bins / 2);
  if (resident_words_.size() < words) reallocate(resident_words_, words + words / 2);
  if (field_of_ray_.size() < options_.max_rays) reallocate(field_of_ray_, options_.max_rays);
  ::thrust::fill_n(exec_.thrust(), field_of_ray_.data(), w.ray_count, no_field);
  detail::for_each_field(exec_, fields, caster,
                         detail::resident_sink{fields.bins, resident_words_.data(), resident_fields_.data(),
                                               field_of_ray_.data(), fraction(), fields.resolution},
                         options_.caster_buffer_bytes);
  return {{field_of_ray_.data(), w.ray_count},
          {resident_fields_.data(), resident_words_.data(), fields.resolution, points_at(w.depth)}};
}

template <class Exec>
guider_statistics path_guider<Exec>::statistics() const {
  guider_statistics result;
  result.samples = samples_;
  result.guided_samples = samples_ > options_.unguided_samples && !octree_.view().empty()
                              ? samples_ - options_.unguided_samples
                              : 0;
  result.depths = counts_.to_host(exec_);
  result.deposits = cache_.dropped(exec_);
  if (keeps_fields()) result.kept = store_.statistics(exec_);
  result.dropped_vertices = recorder_.dropped(exec_);
  result.build = build_;
  result.seconds = clock_.report();
  return result;
}

template <class Exec>
memory_report path_guider<Exec>::memory() const {
  const std::size_t resident = resident_words_.bytes() + resident_fields_.bytes() + field_of_ray_.bytes();
  const std::size_t binning = binner_.bytes() + store_.wave_bytes() + counts_.bytes();
  const std::size_t values = store_.value_bytes() + lights_.transient_bytes();
  const std::size_t named = recorder_.bytes() + binning + resident + store_.slot_bytes() +
                            store_.level_bytes() + lights_.persistent_bytes() + values;
  return {{{"octree", octree_.bytes(), true},
           {"cache", cache_.persistent_bytes(), true},
           {"kept fields", store_.slot_bytes(), true},
           {"levels", store_.level_bytes(), true},
           {"lights", lights_.persistent_bytes(), true},
           {"deposits", cache_.transient_bytes() + values, false},
           {"paths", recorder_.bytes(), false},
           {"binning", binning, false},
           {"fields", resident, false},
           {"scratch", working_memory_->bytes() - detail::min(named, working_memory_->bytes()), false}}};
}

}  // namespace wfpg
