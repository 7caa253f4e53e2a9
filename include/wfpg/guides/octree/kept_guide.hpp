// The default guide: its fields stay across depths and samples, under a byte budget. They are refreshed in
// part, and learn from paths (field_store.hpp).
//
// Source: fields are those of Yalciner and Akyuz (2024), section 3.3. Keeping fields and learning are wfpg's
// own.
//
// Cost: that of field_store for each wave, and of octree_scene for each sample. Memory: that of octree_scene,
// and kept.budget_bytes.
#pragma once

#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/octree/detail/sample_fields.hpp>
#include <wfpg/guides/octree/field_store.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/octree_scene.hpp>

#include <vector>

namespace wfpg {

/// A guide with kept fields, for path_guider; guide.hpp describes the interface. Movable, not copyable.
///   Surfaces  (std::uint32_t ray) -> surface<Bsdf>
///   Random    (std::uint32_t ray, std::uint32_t dimension) -> vec2 in [0, 1)²
///   Caster    an inline or batch ray caster
template <class Exec>
class kept_guide : public octree_scene<Exec> {
  using scene = octree_scene<Exec>;

 public:
  /// Options of the constructors.
  using options_type = kept_guide_options;
  /// Returned by prepare(), for kernels.
  using view_type = guide_view;

  /// Builds the guide over triangles, which are read during the call alone. `exec` allocates octree and
  /// cache. `working` keeps memory that is given back to it; it allocates fields, choices of lights, and all
  /// that a sample needs.
  ///
  /// Throws std::invalid_argument for options out of range, and out_of_memory.
  kept_guide(const Exec& exec, const Exec& working, triangle_mesh_view mesh,
             const kept_guide_options& options)
      : kept_guide(exec, working, scene::fragments_of(exec, mesh, checked(options)), options) {}
  /// Builds the guide over fragments: of geometry that is not triangles, or of hit points
  /// (fragments_from_hits). Throws as the other constructor does.
  kept_guide(const Exec& exec, const Exec& working, voxel_fragments<Exec> fragments,
             const kept_guide_options& options)
      : scene(exec, working, std::move(fragments), checked(options)),
        options_(options),
        store_(working, scene::octree().view(), options.binning, options.kept, scene::rays_of_ranks(),
               scene::deposits_of_sample(), options.ranks, options.max_rays.value_or(options.max_paths)) {}

  /// Ranks that share a sample keep equal fields. A wave that builds exchanges up to 16 KiB, 8 bytes a slot
  /// and 28 a build. A sample's end exchanges 4 bytes a slot, and up to 60 more where paths are recorded.
  /// Each rank casts a part of the cones, and they exchange 4 bytes a cone.
  static constexpr bool joins_ranks = true;
  /// Adds the scene and the options that decide what is learnt, for ranks to compare. Every option that
  /// changes what a guide learns belongs here: ranks that differ in it would learn different guides, and
  /// nothing else would notice. Waits for the work before it.
  WFPG_COLD void agree(const Exec& exec, agreed_items& items) const {
    scene::agree_scene(exec, items);
    items.add("kept.resolution", std::uint64_t(options_.kept.resolution));
    items.add("kept.budget_bytes", std::uint64_t(options_.kept.budget_bytes));
    items.add("kept.recast", std::uint64_t(options_.kept.recast));
    items.add("kept.idle_samples", std::uint64_t(options_.kept.idle_samples));
    items.add("kept.max_wave_cones", options_.kept.max_wave_cones);
    items.add("kept.learn", std::uint64_t(options_.kept.learn));
    items.add("kept.cone_samples", options_.kept.cone_samples);
  }

  /// Which fraction of paths is recorded, by deposits_per_leaf. Directions are recorded where fields learn,
  /// at 9 bytes a vertex.
  recording_needs recording() const { return scene::recording(options_.kept.learn); }

  /// Call before the waves of a sample. Frees slots that are no longer used. O(slots).
  void begin_sample(const sample_context<Exec>& at) {
    store_.begin_sample(at.exec, at.number, at.age);
    scene::begin_scene_sample(at);
  }
  /// Finds, makes and refreshes the fields of a wave's rays. Returns the view that kernels sample from, valid
  /// until the next call. In unguided samples it counts rays for bins, and returns an empty view.
  ///
  /// With an inline caster nothing is read back to the host. Throws std::invalid_argument where the wave has
  /// more rays than max_rays, and what the caster throws.
  template <class Surfaces, class Random, class Caster>
  guide_view prepare(const sample_context<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster);

  /// True: path_guider calls sample_wave(). It finds and samples fields in one pass in waves that build none.
  static constexpr bool samples_waves = true;
  /// Samples the directions of a wave, with products where options ask for them. `Sampler`: sample_ray.
  /// Unguided waves sample their BSDFs. Throws what prepare() throws.
  template <class Surfaces, class Random, class Caster, class Sampler>
  void sample_wave(const sample_context<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster,
                   const Sampler& sampler) {
    if (scene::product_resolution(options_) > 0)
      sample_fields<detail::sample_product<Sampler>>(at, w, caster, sampler);
    else
      sample_fields<detail::sample_field<Sampler>>(at, w, caster, sampler);
  }

  /// Deposits the recorded paths of a sample into the cache, and into fields that learn. Clears the recorder.
  /// Both change in update().
  void learn(const sample_context<Exec>& at, path_recorder<Exec>& paths) {
    scene::deposit(at, paths, learnt());
  }
  /// Updates the cache, fields and choices of lights. Call after each sample, recorded or not. O(deposits +
  /// nodes + cells of the fields used).
  void update(const sample_context<Exec>& at) {
    // First, since the cache and fields learn from what all ranks found.
    scene::exchange(at, true, [&](auto& all) { store_.share(at.exec, all, scene::has_deposits()); });
    const bool recorded = scene::update_cache(at);
    if (recorded) store_.aim(at.exec, scene::cache());
    store_.end_sample(at.exec, recorded, at.guided_next.log2_divisor());
    scene::end_scene_sample(at);
  }

  /// Call after geometry moved inside `bounds`. Fields that may see it cast all their cones when they are
  /// next used. The octree itself does not change.
  void invalidate(const Exec& exec, const bounds3& bounds) { store_.invalidate(exec, bounds); }
  /// Call after geometry moved anywhere. Every field loses its hits and what it learnt when it is next used.
  void invalidate_all(const Exec& exec) { store_.invalidate_all(exec); }
  /// Forgets all cached light, and what fields and choices of lights learnt. Fields keep their cones' hits.
  void forget_light(const Exec& exec) {
    scene::forget_scene_light(exec);
    store_.forget(exec);
    store_.aim(exec, scene::cache());
  }

  /// Where a host's kernels record what their directions found, without the recorder. Empty where fields do
  /// not learn. Such a host sets deposit_capacity, which is also the capacity here.
  learnt_radiance_view learnt() const { return store_.learnt(learns_fractions()); }
  /// Key of each kept field, indexed by sampled_direction::field. A key is node * orientations + orientation,
  /// or 0xffffffff where the number is not in use. Waits for the work before it.
  std::vector<std::uint32_t> field_keys(const Exec& exec) const { return store_.keys(exec); }

  /// Adds depths, kept fields, deposits and the build to a guider's statistics. Counts by depth start when
  /// the guide is made. Waits for the work before it.
  void report(const Exec& exec, guider_statistics& statistics) const {
    scene::report_scene(exec, statistics);
    statistics.kept = store_.statistics(exec);
  }
  /// Bytes of octree, cache, fields and lights, and of what a sample needs.
  std::vector<memory_part> memory() const {
    return scene::scene_memory(
        {{"kept fields", store_.slot_bytes(), true}, {"levels", store_.level_bytes(), true}},
        store_.value_bytes(), store_.wave_bytes(), 0);
  }

 private:
  friend struct detail::guide_sections;

  // Throws std::invalid_argument where P does not divide kept.resolution. The base and the store check all
  // else.
  static const kept_guide_options& checked(const kept_guide_options& options) {
    detail::require_product_resolution(scene::product_resolution(options), "kept.resolution",
                                       options.kept.resolution);
    return options;
  }
  // Whether fractions are learnt: the option, if set, pins them.
  bool learns_fractions() const { return !options_.guide_fraction && options_.kept.learn; }
  // Fraction that fields begin with.
  float first_fraction() const { return scene::fraction().with_enough_rays; }
  // What the store needs of a wave. Draws the wave's points for products.
  //
  // Kept fields begin with one fraction of guided directions, for bins of every size.
  template <class Surfaces, class Random>
  kept_field_wave<Surfaces> kept_wave(const sample_context<Exec>& at, const wave<Surfaces, Random>& w) {
    return {w.ray_count,
            w.surfaces,
            scene::cache(),
            options_.field,
            options_.mode,
            first_fraction(),
            hash(at.seed, w.depth),
            scene::draw_points(at, w.depth),
            scene::depth_counts(w.depth),
            learns_fractions(),
            at.guided_paths,
            scene::first_path()};
  }
  // `FieldSampler`: sample_field or sample_product, over `Sampler`.
  template <class FieldSampler, class Surfaces, class Random, class Caster, class Sampler>
  void sample_fields(const sample_context<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster,
                     const Sampler& sampler);

  // As given to the constructor; the base has the part that both guides share.
  kept_guide_options options_;
  // Refers to the octree in the base class. With ranks it is equal on all of them after each sample.
  // Between two samples' ends it may differ in the slots' last use.
  field_store<Exec> store_;
};

}  // namespace wfpg

#include <wfpg/guides/octree/detail/kept_guide_impl.hpp>
