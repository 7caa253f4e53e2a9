// The facade: what a wavefront path tracer needs to guide its paths, and with an exec/ header all it
// includes. Paper, Algorithm 1. A sample, from the renderer's side:
//
//   guider.begin_sample();
//   for (std::uint32_t depth = 0; depth < max_depth; ++depth) {
//     trace(...);              // the renderer's; records vertices in guider.recorder()
//     guider.sample_directions(wfpg::wave{depth, n, surfaces, random}, caster, directions);
//     shade(...);              // the renderer's; records radiance
//   }
//   guider.end_sample();
#pragma once

#include <wfpg/buffer.hpp>
#include <wfpg/detail/serve_rays.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/exitance_cache.hpp>
#include <wfpg/field_store.hpp>
#include <wfpg/guide_view.hpp>
#include <wfpg/light_guide.hpp>
#include <wfpg/path_recorder.hpp>
#include <wfpg/product_sampler.hpp>
#include <wfpg/radiance_field.hpp>
#include <wfpg/sparse_voxel_octree.hpp>
#include <wfpg/spatial_binner.hpp>
#include <wfpg/statistics.hpp>
#include <wfpg/voxelizer.hpp>
#include <wfpg/wave.hpp>

#include <memory>
#include <vector>

namespace wfpg {

/// How long fields live.
enum class field_lifetime : std::uint8_t {
  kept,      ///< in slots under a budget, across depths and samples, refreshed in part: wfpg's own
  transient  ///< made anew for every bin, depth and sample: the paper's
};

/// What a guider can be told. Every field has a default; ranges are checked when a guider is made.
struct guider_options {
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
  /// Share of guided samples, (0, 1], less than 1 with products; 0: 0.5 in plain mode, 0.7 in oriented mode,
  /// 0.5 in transient oriented bins of less than c_ray rays.
  float guide_fraction = 0.0f;
  /// Guide toward emitters themselves. Beside next-event estimation they count with their MIS weight, and
  /// false leaves them to it: better where fields do not learn.
  bool include_emission = true;
  std::uint32_t unguided_samples =
      1;  ///< samples at the beginning that only record ("PT first", section 3.7)
  /// Of all that the guider draws by itself.
  std::uint64_t seed = 0;
  std::size_t max_paths = 0;  ///< paths of a sample; 0: the renderer deposits by itself
  /// Of the paths of a sample so many are recorded, others in each, that leaves get about as many deposits on
  /// average, or up to twice as many, and after 32 samples a quarter of that; 0: all are. What they cost is
  /// bounded then, however many pixels.
  std::uint32_t deposits_per_leaf = 16;
  std::uint32_t max_depth =
      8;                     ///< vertices of a path that the recorder holds, and depths that statistics tell
  std::size_t max_rays = 0;  ///< of a wave; 0: max_paths
  std::size_t deposit_capacity = 0;  ///< deposits of a sample; 0: recorded paths · max_depth
  std::size_t caster_buffer_bytes = std::size_t(16) << 20;  ///< for the cones of a batch caster in flight
};

/// Guides the paths of a wavefront path tracer over one scene. Movable, not copyable; calls come from one
/// thread at a time. A throw leaves it usable. After the first sample of the largest wave nothing is
/// allocated from the policy.
template <class Exec>
class path_guider {
 public:
  static_assert(exec::is_execution_policy_v<Exec>,
                "Exec needs resource, with_resource, thrust, warp_width and warps_per_block");

  /// A guider over triangles, read only here. Throws std::invalid_argument for options out of range,
  /// out_of_memory.
  path_guider(const Exec& exec, triangle_mesh_view mesh, const guider_options& options = {})
      : path_guider(exec, voxelize(exec, mesh, checked(options).octree_resolution), options) {}

  /// A guider over fragments: of geometry that is not triangles, or of hit points (fragments_from_samples).
  path_guider(const Exec& exec, voxel_fragments<Exec> fragments, const guider_options& options = {});

  /// Begins a sample: one wave of paths, or several. Forgets recorded paths that were not deposited.
  void begin_sample();

  /// Draws the next directions of a wave's rays, fields and all, in one call: directions[ray] for each ray.
  /// `caster` is the host's ray caster, inline or batch. `queries`: directions whose densities the same
  /// fields answer. Throws std::invalid_argument where the wave exceeds max_rays or an output is smaller than
  /// the wave; what a caster throws.
  template <class Surfaces, class Random, class Caster, class Queries = no_queries>
  void sample_directions(const wave<Surfaces, Random>& w, const Caster& caster,
                         array_view<sampled_direction> directions, const Queries& queries = {});

  /// The same in two steps: what the renderer's kernels sample from. `w.random` is not read. Holds until the
  /// next call. Kept fields are only refreshed for it. Transient ones are made resident, in 4 F² bytes a
  /// bin of the wave with most bins, and half more.
  template <class Surfaces, class Random, class Caster>
  guide_view prepare(const wave<Surfaces, Random>& w, const Caster& caster);

  /// Deposits what was recorded and updates the cache.
  void end_sample();

  /// Geometry moved inside `bounds` (world space, old and new place): kept fields that may see it are cast
  /// anew when they are next used. Until the octree is built anew the cache knows the old geometry only.
  void invalidate(const bounds3& bounds) {
    if (keeps_fields()) store_.invalidate(exec_, bounds);
  }
  /// The same of all fields.
  void invalidate_all() {
    if (keeps_fields()) store_.invalidate_all(exec_);
  }
  /// Forgets all cached light, and what kept fields and choices of lights learnt: for lights that moved.
  /// Fields follow without being cast anew.
  void forget_light() {
    cache_.clear(exec_);
    if (keeps_fields()) store_.forget(exec_);
    lights_.forget(exec_);
  }

  /// Where the renderer's kernels record their paths.
  path_recorder_view recorder() const { return recorder_.view(); }
  /// Where they deposit, and what they read, without it.
  exitance_cache_view cache() const { return cache_.view(); }
  /// Where they tell kept fields what their directions found, without it; empty where fields do not learn.
  learnt_radiance_view learnt() const { return store_.learnt(); }
  /// Which lights next-event estimation is to ask, in this sample; empty without options.lights.weights.
  light_guide_view lights() const { return lights_.view(); }
  /// The octree; its view goes to an svo_ray_caster.
  const sparse_voxel_octree<Exec>& octree() const { return octree_; }
  /// What it was told, with max_rays completed.
  const guider_options& options() const { return options_; }
  /// Whether the sample that has begun is guided, and how many cells transient fields have at a depth.
  bool guided() const { return samples_ > options_.unguided_samples && !octree_.view().empty(); }
  /// Cells along a side of transient fields at a depth.
  std::uint32_t field_resolution(std::uint32_t depth) const { return resolution_at(options_, depth); }

  /// Wait for the work before them.
  guider_statistics statistics() const;
  /// A kept field, by the number that mixtures and directions have of it: node · orientations + orientation,
  /// or 0xffffffff where the number is not in use. Empty where fields are transient. Waits for the work
  /// before it.
  std::vector<std::uint32_t> field_keys() const { return store_.keys(exec_); }
  /// What it holds, by part. Waits for the work before it.
  memory_report memory() const;

 private:
  friend struct detail::state_access;

  static const guider_options& checked(const guider_options& options);
  static guider_options completed(guider_options options);
  std::uint32_t share_shift() const;
  std::size_t deposits_of_sample() const;
  static std::uint32_t resolution_at(const guider_options& options, std::uint32_t depth);

  bool keeps_fields() const { return options_.fields == field_lifetime::kept; }
  template <class Surfaces, class Random, class Caster>
  guide_view keep_wave(const wave<Surfaces, Random>& w, const Caster& caster);
  template <class Surfaces, class Random, class Caster>
  guide_view make_resident(const wave<Surfaces, Random>& w, const Caster& caster);
  template <class Surfaces, class Random, class Caster, class Serve>
  void serve_transient(const wave<Surfaces, Random>& w, const Caster& caster, const Serve& serve);
  template <class Surfaces, class Random>
  detail::bin_fields<Surfaces> bin_wave(const wave<Surfaces, Random>& w);
  product_points points_at(std::uint32_t depth);
  detail::mixture_fraction fraction() const;
  depth_statistics* depth_counts(std::uint32_t depth) {
    return counts_.data() + detail::min(depth, options_.max_depth - 1);
  }
  /// New memory, whose old content is lost.
  template <class T>
  void reallocate(buffer<T, Exec>& memory, std::size_t size) {
    memory = {};
    memory = buffer<T, Exec>(exec_, size);
  }
  std::uint64_t wave_seed(std::uint32_t depth) const {
    return detail::hash(detail::hash(options_.seed, samples_), depth);
  }

  guider_options options_;
  detail::stage_clock clock_;
  build_report build_;
  sparse_voxel_octree<Exec> octree_;
  exitance_cache<Exec> cache_;
  std::unique_ptr<retaining_resource> working_memory_;  // of everything below
  Exec exec_;                                           // allocates there
  path_recorder<Exec> recorder_;
  field_store<Exec> store_;      // of kept fields
  light_guide<Exec> lights_;     // of both
  spatial_binner<Exec> binner_;  // of transient ones, and what follows
  buffer<std::uint32_t, Exec> resident_words_;
  buffer<resident_field, Exec> resident_fields_;
  buffer<std::uint32_t, Exec> field_of_ray_;
  buffer<product_point, Exec> product_points_;
  buffer<depth_statistics, Exec> counts_;
  std::uint32_t samples_ = 0;
};

}  // namespace wfpg

#include <wfpg/detail/path_guider_impl.hpp>
