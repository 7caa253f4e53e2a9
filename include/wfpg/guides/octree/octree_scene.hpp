// Base of both octree guides: the octree, the exitance cache, and the learnt choices of lights. It also has
// the points of products and the counts by depth.
//
// Source: Yalciner and Akyuz (2024), section 3.2 and Algorithm 1. Choices of lights are wfpg's own.
//
// Cost: a sample's update takes O(deposits + nodes). Memory: octree and cache, some 40 bytes a node; a
// sample's deposits; 80 P^2 bytes of products; 32 bytes a depth.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/rank_agreement.hpp>
#include <wfpg/guide/recorded_fraction.hpp>
#include <wfpg/guides/octree/deposit_paths.hpp>
#include <wfpg/guides/octree/detail/rays_of_depth.hpp>
#include <wfpg/guides/octree/field_sinks.hpp>
#include <wfpg/guides/octree/gain_meter.hpp>
#include <wfpg/guides/octree/light_guide.hpp>
#include <wfpg/guides/octree/options.hpp>
#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/octree/leaf_codes.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxelizer.hpp>
#include <wfpg/sampling/product_sampler.hpp>

#include <vector>

namespace wfpg {

/// What kept_guide and transient_guide share. Movable, not copyable.
template <class Exec>
class octree_scene : public guide_base {
 public:
  /// Whether the scene has no octree, since it has no surface; nothing is guided then.
  bool empty() const { return octree_.view().empty(); }
  /// The exitance cache, which cones read. A host that deposits radiance without the recorder does so here,
  /// and sets `deposit_capacity`.
  ///
  /// Deposits are queued: cones see them after the sample's update(). Valid while the guide lives.
  exitance_cache_view cache() const { return cache_.view(); }
  /// Choices of lights for next-event estimation in this sample. Empty without options.lights.weights.
  light_guide_view lights() const { return lights_.view(); }
  /// Choices by weight alone, for samples in which choices of lights rest.
  light_guide_view resting_lights() const { return lights_.resting_view(); }
  /// The octree over the scene's surfaces. Its view goes to an svo_ray_caster. The guide must outlive that
  /// view.
  const sparse_voxel_octree<Exec>& octree() const { return octree_; }

  /// True: path_guider calls the members below, and the guide may rest.
  static constexpr bool measures_gain = true;
  /// Whether samples are compared. Not where a host deposits by itself: a guide that rests reads no deposits.
  bool measures() const { return meter_.size() >= guiding_gain::least_paths && !empty(); }
  /// log2 of the number of recorded paths of which one is compared.
  std::uint32_t rarer() const {
    return gain_meter<Exec>::rarer(recorded().paths(), detail::all_paths_of(options_));
  }
  /// Keeps what the paths of an unguided sample brought. `number`: among unguided ones, from 0. For 1
  /// it waits for the work before, and returns what unguided paths contribute to a gain. O(compared paths).
  guiding_gain keep_unguided(const Exec& exec, const path_recorder<Exec>& paths,
                             const recorded_runs& compared, std::uint32_t number) {
    return meter_.keep_unguided(exec, paths, compared, cache_.view(), number);
  }
  /// Compares the paths of a guided sample with those that keep_unguided() kept, and with those of the call
  /// before. Waits for the work before it. O(compared paths).
  guiding_gain gain(const Exec& exec, const path_recorder<Exec>& paths, const recorded_runs& compared) {
    return meter_.gain(exec, paths, compared, cache_.view());
  }
  /// Begins a sample that the guide rests in. Choices of lights may go on.
  /// Neither fields nor cache take part.
  void begin_rest(const sample_context<Exec>& at) { begin_scene_sample(at); }
  /// Ends a sample without the guide: light choices learn from it.
  void end_rest(const sample_context<Exec>& at) {
    exchange(at, false, [](const auto&) {});
    end_scene_sample(at);
  }

 protected:
  /// Builds octree and cache from fragments. `exec` allocates what is kept; `working` what each sample needs
  /// again. Throws std::invalid_argument for options out of range, and out_of_memory.
  octree_scene(const Exec& exec, const Exec& working, voxel_fragments<Exec> fragments,
               const octree_guide_options& options);
  /// Move constructor. The moved-from scene may only be assigned to or destroyed.
  octree_scene(octree_scene&&) = default;
  /// Move assignment. It frees what this scene had.
  octree_scene& operator=(octree_scene&&) = default;
  /// Protected: only guides derive from it, and no one deletes them through this base.
  ~octree_scene() = default;

  /// Throws std::invalid_argument for options out of range. It checks them before anything is allocated.
  WFPG_COLD static void require_valid(const octree_guide_options& options);
  /// Voxelizes a mesh for the constructor, after it checked the options. Reads the mesh during the call
  /// alone.
  static voxel_fragments<Exec> fragments_of(const Exec& exec, triangle_mesh_view mesh,
                                            const octree_guide_options& options) {
    require_valid(options);
    return voxelize(exec, mesh, options.octree_resolution);
  }
  /// Adds the octree, normals and the options that decide what is learnt, for ranks to compare.
  /// O(nodes) on the host. Waits for the work before it.
  WFPG_COLD void agree_scene(const Exec& exec, agreed_items& items) const;
  /// Index of this rank's path 0 among all paths; no_path without ranks.
  std::uint32_t first_path() const {
    return options_.ranks ? static_cast<std::uint32_t>(options_.first_path) : no_path;
  }
  /// Most rays of a wave: with ranks the sum over all of them. What depends on the size of waves depends on
  /// this one, so that it is equal for any number of ranks.
  std::size_t rays_of_ranks() const {
    return options_.ranks ? detail::all_paths_of(options_) : options_.max_rays.value_or(options_.max_paths);
  }
  /// P of the options' products; 0: none.
  static std::uint32_t product_resolution(const octree_guide_options& options) {
    return options.product_resolution.value_or(0);
  }

  /// Paths that are compared: 0 where the options, or a host that deposits by itself, leave no comparison.
  std::size_t compared_paths() const {
    const octree_guide_options& o = options_;
    const bool measures =
        o.least_gain.value_or(1.0f) > 0.0f && o.unguided_samples > 0 && o.deposit_capacity.value_or(0) == 0;
    return measures ? recorded().part(rarer()) : 0;
  }
  /// Which fraction of paths the recorder stores. `directions`: also directions and their fields.
  recording_needs recording(bool directions) const { return recorded().needs(directions); }
  /// Capacity of a sample's deposits: the option, or all vertices that the recorder stores. Throws
  /// std::invalid_argument where that exceeds 2^31.
  std::size_t deposits_of_sample() const;
  /// Fractions of guided directions: the option, or 0.5 in plain mode. In oriented mode 0.7, and 0.5 for bins
  /// of fewer than rays_per_bin rays.
  mixture_fraction fraction() const;
  /// Draws the points at which a wave's products evaluate BSDFs, anew for each sample and depth. Returns an
  /// empty set without products. O(P²).
  product_points draw_points(const sample_context<Exec>& at, std::uint32_t depth);
  /// Counters of one depth, in the policy's memory. Depths beyond max_depth count with the last.
  ///
  /// Kernels add to them; report_scene() reads them.
  depth_statistics* depth_counts(std::uint32_t depth) {
    return counts_.data() + min(depth, options_.max_depth - 1);
  }

  /// Begins a sample of the light choices.
  void begin_scene_sample(const sample_context<Exec>& at) {
    lights_.begin_sample(static_cast<std::uint32_t>(at.seed));
  }
  /// Deposits recorded paths, and lets `learnt` learn from them. The cache changes in update_cache().
  /// O(recorded paths * depth).
  void deposit(const sample_context<Exec>& at, path_recorder<Exec>& paths,
               const learnt_radiance_view& learnt) {
    has_deposits_ = true;
    deposit_paths(at.exec, paths, cache_.view(), learnt);
  }
  /// Whether the sample has deposits, which change the cache. A host that has its own may have made some in
  /// any sample.
  bool has_deposits() const { return has_deposits_ || options_.deposit_capacity.value_or(0) > 0; }
  /// Gives all ranks what each has found in the sample, and what they counted, for statistics and files.
  /// Call it before the cache and choices of lights change; without ranks it does nothing.
  ///
  /// `deposits`: whether update_cache() follows. `more`: (rank_exchange&), adds what a derived guide has, in
  /// an order that all ranks share. Waits for the work before it. Throws rank_error.
  template <class More>
  void exchange(const sample_context<Exec>& at, bool deposits, const More& more) {
    if (!options_.ranks) return;
    // Ranks add the parts in this order.
    detail::rank_exchange<Exec> all(*options_.ranks);
    cache_.share(at.exec, all, deposits && has_deposits());
    lights_.share(all);
    shared_counts_.add_to(at.exec, all, detail::rays_of_depth{counts_.data()});
    more(all);
    all.run(at.exec);
  }
  /// Folds the sample's deposits into the cache. Returns false where there cannot be any, and then does
  /// nothing. O(deposits + nodes).
  bool update_cache(const sample_context<Exec>& at) {
    const bool deposits = has_deposits();
    if (deposits) cache_.update(at.exec);
    return deposits;
  }
  /// Lets the choices of lights learn, and ends the sample.
  void end_scene_sample(const sample_context<Exec>& at) {
    lights_.end_sample(at.exec);
    has_deposits_ = false;
  }
  /// Forgets all cached light and all that light choices learnt. Deposits that are queued are lost too. The
  /// octree stays. For scenes whose lights moved.
  void forget_scene_light(const Exec& exec) {
    cache_.clear(exec);
    lights_.forget(exec);
    meter_.forget(exec);
  }

  /// Fills in counts by depth, dropped deposits, and the build's report. Waits for the work before it.
  void report_scene(const Exec& exec, guider_statistics& statistics) const {
    statistics.depths = counts_.to_host(exec);
    statistics.deposits = cache_.dropped(exec);
    statistics.build = build_;
  }
  /// Bytes of each part of memory, in the order in which they are reported. `kept`: parts of the derived
  /// guide, kept across samples. `values`, `binning`, `fields`: bytes that it needs during a sample.
  std::vector<memory_part> scene_memory(const std::vector<memory_part>& kept, std::size_t values,
                                        std::size_t binning, std::size_t fields) const;

 private:
  friend struct detail::guide_sections;

  // The paths that are recorded: as many as yield `deposits_per_leaf` vertices a leaf. All where that is
  // unset.
  detail::recorded_fraction recorded() const {
    return {options_, std::uint64_t(options_.deposits_per_leaf.value_or(0)) * octree_.leaf_count()};
  }

  // As given to the constructor. Its ranks outlive the guide.
  //
  // In the order of construction: the cache is built from the fragments that the octree sorted.
  octree_guide_options options_;
  build_report build_;
  sparse_voxel_octree<Exec> octree_;
  exitance_cache<Exec> cache_;
  light_guide<Exec> lights_;
  // Paths of samples that are compared. Empty where none is.
  gain_meter<Exec> meter_;
  // P² points over the hemisphere, then P² over the sphere.
  buffer<product_point, Exec> product_points_;  // P² over the hemisphere, then P² over the sphere
  // One element a depth, since the guide was made. Kernels add to it.
  buffer<depth_statistics, Exec> counts_;  // a depth, at most max_depth
  // With ranks: rays and unbinned rays of each depth. Bins and cones are equal on all ranks, since each makes
  // all fields.
  detail::rank_counters<Exec, std::uint64_t> shared_counts_;
  // Whether paths were deposited since the last update that was completed.
  bool has_deposits_ = false;
};

}  // namespace wfpg

#include <wfpg/guides/octree/detail/octree_scene_impl.hpp>
