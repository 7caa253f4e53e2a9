// A guide that knows where light comes from before the first path, and learns nothing from paths. Records
// hold the light that arrives at voxels, by direction. Cones through the octree gather it from emitters, and
// from the surfaces that emitters light directly.
//
//   wfpg::irradiance_records_options options;
//   options.max_rays = paths;
//   const wfpg::lit_scene<> scene{mesh, emitters};
//   wfpg::path_guider<Exec, wfpg::irradiance_records<Exec>> guider(exec, scene, options);
//
// The first guided wave builds the records, with its caster. The first guided wave after forget_light(),
// invalidate() or invalidate_all() builds them again. To move lights, the host changes the array `emitters`
// in place and calls forget_light().
//
// Building casts rays from emitters, which tag the voxels that they meet as lit. Caustics are voxels lit by
// way of smooth surfaces. They count where the host says how light goes on there. Only emission and direct
// illumination are stored; indirect light is missing. Cones that leave the octree gather the environment,
// which rays from beyond the scene ask the caster for.
//
// Source: Jhang & Chang, "An Unbiased Hybrid Rendering Approach to Path Guiding"; docs/guides.md lists what
// differs.
// Cost: to build, `emitter_rays` rays and one more for each smooth bounce, 2048 rays for the environment, and
// 128 `cones_per_direction` cones a record. A direction takes some 100 integer operations, and 200 more where
// the normal is not that of most of the record. A density beside it takes a few.
// Memory: 64 bytes a record and 48 for its row sums, 82 KiB for cosines. The octree and its tags take 11 a
// leaf and 12 an inner node. While it builds, 40 a leaf and 24 a node. Also 44 for each of at most 2^16 rays
// in flight, and 512 for each of at most 4096 records.
#pragma once

#include <wfpg/exec/buffer.hpp>
#include <wfpg/guide/guide.hpp>
#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/records/detail/voxel_light.hpp>
#include <wfpg/guides/records/emitters.hpp>
#include <wfpg/guides/records/irradiance_record.hpp>
#include <wfpg/guides/records/options.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/octree/voxelizer.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <cstdint>
#include <vector>

namespace wfpg {

/// The scene of irradiance_records: surfaces, the emitters among them, and what smooth surfaces do to light.
/// Smooth is a functor that kernels call, by value:
///   smooth_bounce operator()(std::uint32_t i, const ray& r, float distance, vec2 u) const;
/// Light came along `r` and met a surface at `distance`. The functor finds the surface with a ray of its own,
/// or in what the host's batch caster stored for ray `i` of that cast. It returns where light goes on, and
/// chooses by `u` in [0,1)² where there are several ways.
template <class Smooth = no_smooth_surfaces>
struct lit_scene {
  triangle_mesh_view mesh;  ///< all surfaces, emitters too; only the constructor reads it
  /// Emitters, in the policy's memory, which must outlive the guider. Read whenever records are built.
  array_view<const emitting_triangle> emitters{};
  Smooth smooth{};  ///< what smooth surfaces do to light; default: all surfaces are rough
};

/// Statistics of building records. All but `builds` and `records` are of the last build.
struct irradiance_records_statistics {
  std::uint32_t builds = 0;        ///< builds so far
  double seconds = 0.0;            ///< host time of the build, which waits for the device
  std::uint64_t rays = 0;          ///< rays cast, including those for the environment
  std::uint64_t cones = 0;         ///< cones traced through the octree
  std::uint32_t records = 0;       ///< records in memory
  std::uint32_t objects = 0;       ///< voxels with surface that are neither of the following
  std::uint32_t lights = 0;        ///< voxels with an emitter
  std::uint32_t directly_lit = 0;  ///< voxels without emitter that light from one reached
};

/// View of the records for kernels, from which rays sample. Trivially copyable. Valid until the guider's next
/// call. mixture_view adds sample() and pdf().
class irradiance_records_view : public mixture_view<irradiance_records_view> {
 public:
  /// A view that guides nothing.
  irradiance_records_view() = default;

  /// Whether a surface is guided: it lies in a node that has a record, or in a voxel beside a leaf. If not,
  /// its rays sample the BSDF alone. Descends the octree: O(record_level), or O(depth) beside a leaf.
  template <class Bsdf>
  WFPG_HD bool guides(const surface<Bsdf>& s) const {
    return fraction_ > 0.0f && can_be_guided(s) && record(s.position) != nullptr;
  }

  /// Returns the mixture of record and BSDF at a surface; the BSDF alone where the surface is not guided. It
  /// does not depend on the ray.
  template <class Bsdf>
  WFPG_HD basic_guide_mixture<detail::record_distribution> mixture(std::uint32_t,
                                                                   const surface<Bsdf>& s) const {
    if (!(fraction_ > 0.0f && can_be_guided(s))) return {};
    return {distribution(s.position, facing_normal(s), s.bsdf.transmits()), fraction_, no_field};
  }

  /// Returns the distribution of directions at a position, world space: the record times the cosine to
  /// `normal`. That is of unit length and points to the side that light comes from. If the surface
  /// `transmits`, light comes from both sides and the distribution is the record alone. Empty where there is
  /// no record, or no light in it.
  WFPG_HD detail::record_distribution distribution(vec3 position, vec3 normal, bool transmits) const {
    const std::uint32_t at = index(position);
    if (at == none) return {};
    const std::uint32_t above = transmits ? normals_.size() : normals_.index(glm::normalize(normal));
    // Row sums are stored above one normal, that of the record's surfaces; above others they are summed here.
    const detail::record_rows& known = rows_[at];
    return {records_ + at, cosines_ + above,
            known.normal == above ? known : detail::record_rows(records_[at], floor_, cosines_, above)};
  }

  /// Returns the record at a position, in the policy's memory; null far from all surface.
  WFPG_HD const irradiance_record* record(vec3 position) const {
    const std::uint32_t at = index(position);
    return at == none ? nullptr : records_ + at;
  }
  /// Returns the tag of the voxel that a position lies in, as of the last build. Before the first build,
  /// voxels with surface are `object`.
  WFPG_HD voxel_tag tag(vec3 position) const {
    const node_id leaf = tree_.leaf_at(position);
    return leaf == invalid_node ? voxel_tag::empty : tags_[leaf - tree_.first_leaf()];
  }

 private:
  template <class Exec, class Smooth>
  friend class irradiance_records;

  static constexpr std::uint32_t none = 0xffffffffu;

  /// Index of the record at a position, or `none`: of the node around it, else of the nearest leaf's.
  WFPG_HD std::uint32_t index(vec3 position) const {
    uvec3 voxel;
    node_id node = tree_.grid().voxel_of(position, voxel) ? tree_.node_at(voxel, level_) : invalid_node;
    if (node == invalid_node) {
      const node_id leaf = tree_.nearest_leaf(position);
      if (leaf == invalid_node) return none;
      node = tree_.ancestor(leaf, level_);
    }
    return node - tree_.level_begin(level_);
  }

  sparse_voxel_octree_view tree_;
  std::uint32_t level_ = 0;             // of records
  detail::normal_lattice normals_{16};  // of cosines
  const detail::cell_cosines* cosines_ = nullptr;
  const irradiance_record* records_ = nullptr;
  const detail::record_rows* rows_ = nullptr;  // a record: above its voxels' normal
  const voxel_tag* tags_ = nullptr;
  float floor_ = 0.0f;
  float fraction_ = 0.0f;
};

/// A guide by irradiance records; path_guider calls its members. Movable, not copyable.
template <class Exec, class Smooth = no_smooth_surfaces>
class irradiance_records : public guide_base {
 public:
  using options_type = irradiance_records_options;  ///< resolutions, and the work of building
  using view_type = irradiance_records_view;        ///< what kernels sample from

  /// A guide for a scene with emitters. Builds the octree; records follow with the first guided wave. `exec`
  /// allocates what is kept, `working` serves temporary memory. Throws std::invalid_argument for options out
  /// of range, and out_of_memory.
  irradiance_records(const Exec& exec, const Exec& working, const lit_scene<Smooth>& scene,
                     const irradiance_records_options& options);
  /// A guide for a scene whose only light is the environment.
  irradiance_records(const Exec& exec, const Exec& working, triangle_mesh_view mesh,
                     const irradiance_records_options& options)
      : irradiance_records(exec, working, lit_scene<Smooth>{mesh}, options) {}

  /// Whether the scene has no surface, so that there are no records.
  bool empty() const { return octree_.view().empty(); }
  /// Paths are not recorded, since the guide does not learn from them.
  static constexpr bool records_paths = false;

  /// Returns the view for a wave. Builds the records first if the wave is guided and they are missing or out
  /// of date. If the caster throws, so does this, and the next guided wave builds them.
  template <class Surfaces, class Random, class Caster>
  irradiance_records_view prepare(const sample_context<Exec>& at, const wave<Surfaces, Random>& w,
                                  const Caster& caster);

  /// Emitters changed: the next guided wave builds the records anew.
  void forget_light(const Exec&) { is_built_ = false; }
  /// Geometry moved: the next guided wave builds all records anew. The octree keeps the old geometry.
  void invalidate(const Exec&, const bounds3&) { is_built_ = false; }
  /// Geometry moved anywhere; as expensive as invalidate(), which does not look at its bounds.
  void invalidate_all(const Exec&) { is_built_ = false; }

  /// The octree of the scene's surfaces, whose leaves are the tagged voxels.
  const sparse_voxel_octree<Exec>& octree() const { return octree_; }
  /// A view for looking at records and tags. It guides nothing.
  irradiance_records_view view() const { return view_; }
  /// Counts and time of the last build.
  const irradiance_records_statistics& statistics() const { return statistics_; }
  /// Adds the triangles that were left out of the octree.
  void report(const Exec&, guider_statistics& statistics) const { statistics.build = build_; }
  /// Four parts, all kept: "records", "sums of records", "cosines", and "octree" with its tags.
  std::vector<memory_part> memory() const;

 private:
  /// Throws std::invalid_argument for options out of range.
  static const irradiance_records_options& checked(const irradiance_records_options& options);
  irradiance_records(const Exec& exec, const Exec& working, const lit_scene<Smooth>& scene,
                     voxel_fragments<Exec> fragments, const irradiance_records_options& options);

  // build() calls those below it, in their order.
  template <class Caster>
  void build(const Exec& exec, const Caster& caster);
  detail::emitter_set weigh(const Exec& exec, buffer<std::uint64_t, Exec>& weights) const;
  template <class Caster>
  void send_light(const Exec& exec, const Caster& caster, const detail::emitter_set& from,
                  const buffer<detail::leaf_light, Exec>& light);
  void light_voxels(const Exec& exec, const detail::emitter_set& from,
                    const buffer<detail::leaf_light, Exec>& light,
                    const buffer<detail::voxel_light, Exec>& nodes);
  template <class Caster>
  void see_environment(const Exec& exec, const Caster& caster, const buffer<float, Exec>& environment);
  void fill_records(const Exec& exec, const buffer<detail::voxel_light, Exec>& nodes,
                    const buffer<float, Exec>& environment);
  void count_tags(const Exec& exec);
  /// How far from a surface rays start, scene units: a thousandth of a voxel.
  float off_surface() const { return 1.0e-3f * octree_.view().grid().voxel_size(); }
  /// Radiance times faces of a leaf that one unit of arriving power stands for, after reflection.
  float arrived_unit(const detail::emitter_set& from) const;
  /// Radiance times faces of a leaf that one unit of emitted light stands for; `face` is in square scene
  /// units.
  static float emitted_unit(const detail::emitter_set& from, float face);

  irradiance_records_options options_;
  array_view<const emitting_triangle> emitters_;
  Smooth smooth_;
  build_report build_;
  sparse_voxel_octree<Exec> octree_;
  buffer<std::uint16_t, Exec> normals_;  // of a node, packed
  buffer<std::uint8_t, Exec> swapped_;   // of an inner node: a bit a child
  buffer<float, Exec> areas_;            // of a leaf: surface, in its faces
  buffer<voxel_tag, Exec> tags_;         // of a leaf
  buffer<irradiance_record, Exec> records_;
  buffer<detail::record_rows, Exec> rows_;  // of a record
  buffer<detail::cell_cosines, Exec> cosines_;
  irradiance_records_view view_;
  irradiance_records_statistics statistics_;
  bool is_built_ = false;
};

}  // namespace wfpg

#include <wfpg/guides/records/detail/irradiance_records_impl.hpp>
