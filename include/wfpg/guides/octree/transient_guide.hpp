// The paper's guide: it bins the rays of each wave, makes each bin's field anew, and samples it. Nothing but
// the octree and its cache is kept across samples.
//
// Source: Yalciner and Akyuz (2024), Algorithms 1 to 3.
//
// Cost: binning a wave, and F^2 cones for each of its bins (transient_fields.hpp). Memory: that of
// octree_scene; 20 bytes a ray. Where prepare() is called, 4 (F^2 + F) bytes a bin and half more.
#pragma once

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/bins/wave_rays.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/octree_scene.hpp>
#include <wfpg/guides/octree/transient_fields.hpp>

#include <vector>

namespace wfpg {
namespace detail {

/// Kernel of one thread: adds a wave's counts to its depth's sums.
struct add_counts {
  bins_view bins;                 ///< the wave's bins
  const std::uint32_t* unbinned;  ///< rays outside every voxel
  const std::uint32_t* of_ranks;  ///< bins of all ranks; null without ranks
  std::uint32_t cells;            ///< cones a bin
  depth_statistics* sums;         ///< of the wave's depth
  WFPG_HD void operator()(std::size_t) const {
    const std::uint32_t n = of_ranks ? *of_ranks : *bins.count;
    sums->bins += n;
    sums->rays += bins.offsets[*bins.count];
    sums->unbinned += *unbinned;
    sums->cones += std::uint64_t(n) * cells;
  }
};

}  // namespace detail

/// A guide with transient fields, for path_guider; guide.hpp describes the interface. Movable, not copyable.
///   Surfaces  (std::uint32_t ray) -> surface<Bsdf>
///   Random    (std::uint32_t ray, std::uint32_t dimension) -> vec2 in [0, 1)²
///   Caster    an inline or batch ray caster
template <class Exec>
class transient_guide : public octree_scene<Exec> {
  using scene = octree_scene<Exec>;

 public:
  /// Options of the constructors.
  using options_type = transient_guide_options;
  /// Returned by prepare(), for kernels.
  using view_type = guide_view;

  /// Builds the guide over triangles, which are read during the call alone. `exec` allocates octree and
  /// cache. `working` keeps memory that is given back to it; it allocates what a sample needs.
  ///
  /// Throws std::invalid_argument for options out of range, and out_of_memory.
  transient_guide(const Exec& exec, const Exec& working, triangle_mesh_view mesh,
                  const transient_guide_options& options)
      : transient_guide(exec, working, scene::fragments_of(exec, mesh, checked(options)), options) {}
  /// Builds the guide over fragments: of geometry that is not triangles, or of hit points
  /// (fragments_from_hits). Throws as the other constructor does.
  transient_guide(const Exec& exec, const Exec& working, voxel_fragments<Exec> fragments,
                  const transient_guide_options& options)
      : scene(exec, working, std::move(fragments), checked(options)),
        options_(options),
        max_rays_(options.max_rays.value_or(options.max_paths)),
        binner_(working, scene::octree().view(), options.binning, max_rays_),
        ranks_(working, max_rays_, options.ranks) {}

  /// Ranks that share a sample make equal fields, each for the bins of its rays. A guided wave exchanges 4
  /// bytes a leaf, and 48 for each bin of each rank.
  static constexpr bool joins_ranks = true;
  /// Adds the scene and the options that decide what is learnt, for ranks to compare.
  WFPG_COLD void agree(const Exec& exec, agreed_items& items) const {
    scene::agree_scene(exec, items);
    items.add("field_resolution", std::uint64_t(options_.field_resolution));
    items.add("min_field_resolution", std::uint64_t(options_.min_field_resolution));
  }

  /// Which fraction of paths is recorded, by deposits_per_leaf. Directions are not recorded, since fields do
  /// not learn.
  recording_needs recording() const { return scene::recording(false); }

  /// Call before the waves of a sample.
  void begin_sample(const sample_context<Exec>& at) { scene::begin_scene_sample(at); }
  /// Makes a wave's fields in memory, and returns the view that kernels sample from, valid until the next
  /// call. Reads the number of bins back, which waits for the work before it. An unguided sample gets an
  /// empty view.
  ///
  /// Throws std::invalid_argument where the wave has more rays than max_rays. Throws out_of_memory, and what
  /// the caster throws.
  template <class Surfaces, class Random, class Caster>
  guide_view prepare(const sample_context<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster);

  /// True: path_guider calls sample_wave(), since fields live only while their rays are sampled.
  static constexpr bool samples_waves = true;
  /// Samples the directions of a wave from fields in scratch memory. With an inline caster nothing is read
  /// back to the host. `Sampler`: sample_ray. Rays without a bin sample their BSDFs. Throws as prepare()
  /// does.
  template <class Surfaces, class Random, class Caster, class Sampler>
  void sample_wave(const sample_context<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster,
                   const Sampler& sampler);

  /// Deposits the recorded paths of a sample into the cache, which changes in update(). Clears the recorder.
  void learn(const sample_context<Exec>& at, path_recorder<Exec>& paths) { scene::deposit(at, paths, {}); }
  /// Updates the cache and the choices of lights. Call after each sample, recorded or not. O(deposits +
  /// nodes).
  void update(const sample_context<Exec>& at) {
    scene::exchange(at, true, [](const auto&) {});
    scene::update_cache(at);
    scene::end_scene_sample(at);
  }
  /// Forgets all cached light, and what choices of lights learnt.
  void forget_light(const Exec& exec) { scene::forget_scene_light(exec); }

  /// F at a depth: cells along a field's side. It halves at each depth, down to min_field_resolution.
  std::uint32_t field_resolution(std::uint32_t depth) const { return resolution_at(options_, depth); }

  /// Adds depths, deposits and the build to a guider's statistics. Waits for the work before it.
  void report(const Exec& exec, guider_statistics& statistics) const {
    scene::report_scene(exec, statistics);
  }
  /// Bytes of octree, cache and lights, and of what a sample needs.
  std::vector<memory_part> memory() const {
    return scene::scene_memory({}, 0, binner_.bytes() + ranks_.bytes(),
                               resident_words_.bytes() + resident_fields_.bytes() + field_of_ray_.bytes());
  }

 private:
  friend struct detail::guide_sections;

  // Throws std::invalid_argument for options of fields out of range, and where P does not divide F at a
  // depth.
  static const transient_guide_options& checked(const transient_guide_options& options);
  static std::uint32_t resolution_at(const transient_guide_options& options, std::uint32_t depth) {
    const std::uint32_t least = min(options.min_field_resolution, options.field_resolution);
    return depth < 32 ? max(options.field_resolution >> depth, least) : least;
  }
  // Bins a wave's rays and counts them. Returns what its fields are made of.
  template <class Surfaces, class Random>
  bin_fields<Surfaces> bin_wave(const sample_context<Exec>& at, const wave<Surfaces, Random>& w);
  /// Replaces a buffer by a new one of `size` elements, which are not initialized. Frees the old one first,
  /// so that the peak is one buffer.
  template <class T>
  static void reallocate(const Exec& exec, buffer<T, Exec>& memory, std::size_t size) {
    memory = {};
    memory = buffer<T, Exec>(exec, size);
  }

  transient_guide_options options_;
  // Rays of a wave, at most.
  std::size_t max_rays_;
  spatial_binner<Exec> binner_;
  detail::bin_ranks<Exec> ranks_;
  // Fields that prepare() makes: empty until it is called. They only grow.
  buffer<std::uint32_t, Exec> resident_words_;
  buffer<resident_field, Exec> resident_fields_;
  buffer<std::uint32_t, Exec> field_of_ray_;
};

}  // namespace wfpg

#include <wfpg/guides/octree/detail/transient_guide_impl.hpp>
