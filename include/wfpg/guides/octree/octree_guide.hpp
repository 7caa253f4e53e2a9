// The paper's guide, which path_guider has unless told otherwise: an octree that caches exitance, bins of
// rays and a field of incident radiance for each, kept or transient; and choices of lights, which learn by
// node.
#pragma once

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guide/recorded_fraction.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/octree/deposit_paths.hpp>
#include <wfpg/guides/octree/detail/sample_fields.hpp>
#include <wfpg/guides/octree/field_sinks.hpp>
#include <wfpg/guides/octree/field_store.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/guides/octree/light_guide.hpp>
#include <wfpg/guides/octree/transient_fields.hpp>
#include <wfpg/octree/exitance_cache.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxelizer.hpp>
#include <wfpg/sampling/product_sampler.hpp>

#include <vector>

namespace wfpg {

/// How long fields live.
enum class field_lifetime : std::uint8_t {
  kept,      ///< in slots under a budget, across depths and samples, refreshed in part: wfpg's own
  transient  ///< made anew for every bin, depth and sample: the paper's
};

/// What a guider can be told, beside sampling_options. Every field has a default; ranges are checked when a
/// guider is made. guide_fraction, (0, 1] and less than 1 with products, is by default 0.5 in plain mode, 0.7
/// in oriented mode, 0.5 in transient oriented bins of less than c_ray rays.
struct guider_options : sampling_options {
  std::uint32_t octree_resolution =
      128;  ///< voxels along the scene's longest side; a power of two in [1, 4096]
  /// How rays form bins, and what their fields cover.
  guiding_mode mode = guiding_mode::oriented;
  /// How long fields live.
  field_lifetime fields = field_lifetime::kept;
  kept_field_options kept;          ///< resolution, budget and refresh of kept fields
  std::uint32_t min_bin_level = 3;  ///< l_min: no bin is larger than a node of this level (root 0)
  std::uint32_t rays_per_bin =
      64;  ///< c_ray, at least 1: rays of a wave that make a node a bin; of kept fields
           ///< about what a bin gets in a sample, or more for their budget to suffice
  std::uint32_t field_resolution =
      32;  ///< cells along a transient field's side at depth 0, in [2, 128]; halves at each depth
  std::uint32_t min_field_resolution = 16;  ///< down to this, in [2, 128]
  field_options field;                      ///< filter and floor
  light_guide_options lights;               ///< groups of lights that next-event estimation chooses from
  /// P: draw from products of field and BSDF in P x P blocks, 4, 8 or 16, a divisor of the fields'
  /// resolutions (16 is none of kept.resolution's default); 0: from fields.
  std::uint32_t product_resolution = 0;
  /// Of the paths of a sample so many are recorded, others in each, that leaves get about as many deposits on
  /// average, or up to twice as many; once means have settled a quarter of that, in one sample of four, or in
  /// two or all where there are few paths. 0: all are, in all samples. What they cost is bounded then,
  /// however many pixels.
  std::uint32_t deposits_per_leaf = 16;
  /// Room for a sample's deposits, and values that fields learn. 0: for those of the recorder alone. A host
  /// that deposits by itself sets it, and may do so in any sample.
  std::size_t deposit_capacity = 0;
  std::size_t caster_buffer_bytes = std::size_t(16) << 20;  ///< for the cones of a batch caster in flight
  /// A host's number for its scene, such as a checksum: load_guide() refuses a guide that was saved with
  /// another.
  std::uint64_t scene_tag = 0;
};

/// A guide as guide.hpp describes them. Movable, not copyable.
template <class Exec>
class octree_guide : public guide_base {
 public:
  using options_type = guider_options;  ///< what it can be told
  using view_type = guide_view;         ///< what kernels draw from

  /// Over triangles, read only here. Throws std::invalid_argument for options out of range, out_of_memory.
  octree_guide(const Exec& exec, const Exec& working, triangle_mesh_view mesh, const guider_options& options)
      : octree_guide(exec, working, voxelize(exec, mesh, checked(options).octree_resolution), options) {}
  /// Over fragments: of geometry that is not triangles, or of hit points (fragments_from_samples).
  octree_guide(const Exec& exec, const Exec& working, voxel_fragments<Exec> fragments,
               const guider_options& options);

  /// Whether there is no octree.
  bool empty() const { return octree_.view().empty(); }
  /// Of many paths a part; directions where fields learn.
  recording_needs recording() const { return recorded().needs(keeps_fields() && options_.kept.learn); }

  /// Before the waves of a sample.
  void begin_sample(const guide_sample<Exec>& at);
  /// Fields for a wave, in memory.
  template <class Surfaces, class Random, class Caster>
  guide_view prepare(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster) {
    return keeps_fields() ? keep_wave(at, w, caster) : make_resident(at, w, caster);
  }
  static constexpr bool serves_waves = true;  ///< transient fields in scratch memory, kept ones in one pass
  /// Draws the directions of a wave; Serve is serve_ray.
  template <class Surfaces, class Random, class Caster, class Serve>
  void serve(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster,
             const Serve& serve);
  /// Deposits what was recorded.
  void learn(const guide_sample<Exec>& at, path_recorder<Exec>& paths) {
    told_ = true;
    deposit_paths(at.exec, paths, cache_.view(), store_.learnt());
  }
  /// Updates the cache, and what fields and choices of lights learn.
  void update(const guide_sample<Exec>& at);

  /// What path_guider says of these.
  void invalidate(const Exec& exec, const bounds3& bounds) {
    if (keeps_fields()) store_.invalidate(exec, bounds);
  }
  /// The same of all fields.
  void invalidate_all(const Exec& exec) {
    if (keeps_fields()) store_.invalidate_all(exec);
  }
  /// Forgets all light.
  void forget_light(const Exec& exec);

  /// What path_guider says of these.
  exitance_cache_view cache() const { return cache_.view(); }
  /// Where kernels tell kept fields what their directions found.
  learnt_radiance_view learnt() const { return store_.learnt(); }
  /// Which lights next-event estimation is to ask.
  light_guide_view lights() const { return lights_.view(); }
  /// The octree.
  const sparse_voxel_octree<Exec>& octree() const { return octree_; }
  /// Cells along a side of transient fields at a depth.
  std::uint32_t field_resolution(std::uint32_t depth) const { return resolution_at(options_, depth); }
  /// Nodes and orientations of kept fields.
  std::vector<std::uint32_t> field_keys(const Exec& exec) const { return store_.keys(exec); }

  /// Adds depths, kept fields, deposits and the build.
  void report(const Exec& exec, guider_statistics& statistics) const;
  /// Octree, cache, fields, lights, and what a sample needs.
  std::vector<memory_part> memory() const;

 private:
  friend struct detail::state_access;

  static const guider_options& checked(const guider_options& options);
  detail::recorded_fraction recorded() const {
    return {options_, std::uint64_t(options_.deposits_per_leaf) * octree_.leaf_count()};
  }
  std::size_t deposits_of_sample() const;
  static std::uint32_t resolution_at(const guider_options& options, std::uint32_t depth);

  bool keeps_fields() const { return options_.fields == field_lifetime::kept; }
  template <class Surfaces, class Random>
  kept_field_wave<Surfaces> kept_wave(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w);
  template <class ServeField, class Surfaces, class Random, class Caster, class Serve>
  void serve_kept(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster,
                  const Serve& serve);
  template <class Surfaces, class Random, class Caster>
  guide_view keep_wave(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster);
  template <class Surfaces, class Random, class Caster>
  guide_view make_resident(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w,
                           const Caster& caster);
  template <class Surfaces, class Random, class Caster, class Serve>
  void serve_transient(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w, const Caster& caster,
                       const Serve& serve);
  template <class Surfaces, class Random>
  bin_fields<Surfaces> bin_wave(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w);
  product_points points_at(const guide_sample<Exec>& at, std::uint32_t depth);
  mixture_fraction fraction() const;
  depth_statistics* depth_counts(std::uint32_t depth) {
    return counts_.data() + min(depth, options_.max_depth - 1);
  }
  /// New memory, whose old content is lost.
  template <class T>
  static void reallocate(const Exec& exec, buffer<T, Exec>& memory, std::size_t size) {
    memory = {};
    memory = buffer<T, Exec>(exec, size);
  }

  guider_options options_;
  build_report build_;
  sparse_voxel_octree<Exec> octree_;
  exitance_cache<Exec> cache_;
  field_store<Exec> store_;      // of kept fields
  light_guide<Exec> lights_;     // of both
  spatial_binner<Exec> binner_;  // of transient ones, and what follows
  buffer<std::uint32_t, Exec> resident_words_;
  buffer<resident_field, Exec> resident_fields_;
  buffer<std::uint32_t, Exec> field_of_ray_;
  buffer<product_point, Exec> product_points_;
  buffer<depth_statistics, Exec> counts_;
  bool told_ = false;  // of paths, since the last update that was completed
};

}  // namespace wfpg

#include <wfpg/guides/octree/detail/octree_guide_impl.hpp>
