// A guide that knows where light comes from before the first path: records of the light that arrives at
// voxels, by direction, which cones through the octree gather from emitters and from what they light directly
// (Jhang & Chang, "An Unbiased Hybrid Rendering Approach to Path Guiding"). It learns nothing from paths.
//
//   wfpg::irradiance_records_options options;
//   options.max_rays = paths;
//   const wfpg::lit_scene<> scene{mesh, emitters};
//   wfpg::path_guider<Exec, wfpg::irradiance_records<Exec>> guider(exec, scene, options);
//
// Records are built with the first wave that is guided, by the caster that comes with it, and again with the
// first guided one after forget_light(), invalidate() or invalidate_all(): for lights that moved, the host
// changes `emitters` where they lie. Rays from emitters are cast, and tag the voxels that they meet; voxels
// lit by way of smooth surfaces, caustics, count as lit where the host says how light goes on there. All
// other light is that which voxels are known to send, so what is lit indirectly is dark. Where light leaves
// the octree, rays from beyond the scene ask the caster for the environment.
//
// Memory: 64 bytes a record and 48 for sums of it, 82 KiB for cosines; of the octree and its tags 11 a leaf,
// 12 an inner node. While it builds 40 a leaf, 24 a node, 44 a ray in flight (2^16 of them), 512 a record
// (4096 of them). Time: `emitter_rays` rays, with smooth surfaces one for each bounce more, 2048 for the
// environment, and 128 `cones_per_direction` cones a record. Directions: some 100 integer operations each,
// and 200 more where the normal is not that of most of the record; a density beside one, a few.
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

/// Triangles and the emitters among them, in the policy's memory, and how light goes on at smooth surfaces:
///   smooth_bounce operator()(std::uint32_t i, const ray& r, float distance, vec2 u) const;
/// called in kernels, by value. Light came along `r`, the i-th of the rays that were cast together, and met a
/// surface at `distance`. The host finds out what is there, by a ray of its own or by what its batch caster
/// wrote down for i, and says where light goes on, by u in [0,1)² where there is a choice.
template <class Smooth = no_smooth_surfaces>
struct lit_scene {
  triangle_mesh_view mesh;  ///< all surfaces, emitters too; read by the constructor only
  array_view<const emitting_triangle> emitters{};  ///< read whenever records are built
  Smooth smooth{};                                 ///< how light goes on
};

/// What building records took and found.
struct irradiance_records_statistics {
  std::uint32_t builds = 0;        ///< so far; what follows is of the last one
  double seconds = 0.0;            ///< until it was done
  std::uint64_t rays = 0;          ///< cast, those for the environment too
  std::uint64_t cones = 0;         ///< through the octree
  std::uint32_t records = 0;       ///< in memory
  std::uint32_t objects = 0;       ///< voxels that are only that
  std::uint32_t lights = 0;        ///< voxels that emit
  std::uint32_t directly_lit = 0;  ///< other voxels that emitters light
};

/// What a wave's rays draw from. Trivially copyable; holds until the guider's next call.
class irradiance_records_view : public mixture_view<irradiance_records_view> {
 public:
  irradiance_records_view() = default;

  /// Whether a surface is guided: it lies in a node that has a record, or in a voxel beside one. Without it
  /// is its BSDF's.
  template <class Bsdf>
  WFPG_HD bool guides(const surface<Bsdf>& s) const {
    return fraction_ > 0.0f && can_be_guided(s) && record(s.position) != nullptr;
  }

  /// The mixture at a surface, whatever the ray; of one that is not guided, the BSDF alone.
  template <class Bsdf>
  WFPG_HD basic_guide_mixture<detail::record_distribution> mixture(std::uint32_t,
                                                                   const surface<Bsdf>& s) const {
    if (!(fraction_ > 0.0f && can_be_guided(s))) return {};
    return {distribution(s.position, facing_normal(s), s.bsdf.transmits()), fraction_, no_field};
  }

  /// What is drawn at a place with a normal on the side of the light: the record times the cosine; where
  /// light comes from both sides, the record alone. Empty where there is none, or no light.
  WFPG_HD detail::record_distribution distribution(vec3 position, vec3 normal, bool transmits) const {
    const std::uint32_t at = index(position);
    if (at == none) return {};
    const std::uint32_t above = transmits ? normals_.size() : normals_.index(glm::normalize(normal));
    const detail::record_rows& known = rows_[at];
    return {records_ + at, cosines_ + above,
            known.normal == above ? known : detail::record_rows(records_[at], floor_, cosines_, above)};
  }

  /// The record of a place, in the policy's memory; null far from all surface.
  WFPG_HD const irradiance_record* record(vec3 position) const {
    const std::uint32_t at = index(position);
    return at == none ? nullptr : records_ + at;
  }
  /// What the voxel is that a point lies in. As of the last build; before it no voxel is known to be lit.
  WFPG_HD voxel_tag tag(vec3 position) const {
    const node_id leaf = tree_.leaf_at(position);
    return leaf == invalid_node ? voxel_tag::empty : tags_[leaf - tree_.first_leaf()];
  }

 private:
  template <class Exec, class Smooth>
  friend class irradiance_records;

  static constexpr std::uint32_t none = 0xffffffffu;

  /// Of the record of a place.
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

/// A guide as guide.hpp describes them. Movable, not copyable.
template <class Exec, class Smooth = no_smooth_surfaces>
class irradiance_records : public guide_base {
 public:
  using options_type = irradiance_records_options;  ///< what it can be told
  using view_type = irradiance_records_view;        ///< what kernels draw from

  /// Over triangles and emitters. Throws std::invalid_argument for options out of range, out_of_memory.
  irradiance_records(const Exec& exec, const Exec& working, const lit_scene<Smooth>& scene,
                     const irradiance_records_options& options);
  /// Without emitters: only the environment guides.
  irradiance_records(const Exec& exec, const Exec& working, triangle_mesh_view mesh,
                     const irradiance_records_options& options)
      : irradiance_records(exec, working, lit_scene<Smooth>{mesh}, options) {}

  /// Whether there is no octree.
  bool empty() const { return octree_.view().empty(); }
  /// It learns nothing from paths.
  static constexpr bool records_paths = false;

  /// What the wave's rays draw from. Builds records where they are not, or no longer; throws what the caster
  /// throws, and then builds them in the next wave.
  template <class Surfaces, class Random, class Caster>
  irradiance_records_view prepare(const guide_sample<Exec>& at, const wave<Surfaces, Random>& w,
                                  const Caster& caster);

  /// Emitters changed: records are built anew with the next guided wave.
  void forget_light(const Exec&) { is_built_ = false; }
  /// Geometry moved; the octree stays as it is. The same.
  void invalidate(const Exec&, const bounds3&) { is_built_ = false; }
  /// The same.
  void invalidate_all(const Exec&) { is_built_ = false; }

  /// The octree.
  const sparse_voxel_octree<Exec>& octree() const { return octree_; }
  /// What all rays draw from: for those who look at records and tags.
  irradiance_records_view view() const { return view_; }
  /// Of records and voxels.
  const irradiance_records_statistics& statistics() const { return statistics_; }
  /// Adds what of the geometry was left out.
  void report(const Exec&, guider_statistics& statistics) const { statistics.build = build_; }
  /// Records; sums that rays need of them; cosines that they are multiplied by; the octree with its tags.
  std::vector<memory_part> memory() const;

 private:
  static const irradiance_records_options& checked(const irradiance_records_options& options);
  irradiance_records(const Exec& exec, const Exec& working, const lit_scene<Smooth>& scene,
                     voxel_fragments<Exec> fragments, const irradiance_records_options& options);

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
  float off_surface() const { return 1.0e-3f * octree_.view().grid().voxel_size(); }
  /// Radiance times faces of leaves that a ray which arrives brings, per unit of its power.
  float arrived_unit(const detail::emitter_set& from) const;
  /// The same of what emitters leave where they are.
  static float emitted_unit(const detail::emitter_set& from, float face);

  irradiance_records_options options_;
  array_view<const emitting_triangle> emitters_;
  Smooth smooth_;
  build_report build_;
  sparse_voxel_octree<Exec> octree_;
  buffer<std::uint16_t, Exec> normals_;  // a node
  buffer<std::uint8_t, Exec> swapped_;   // an inner node
  buffer<float, Exec> areas_;            // a leaf: in faces
  buffer<voxel_tag, Exec> tags_;         // a leaf
  buffer<irradiance_record, Exec> records_;
  buffer<detail::record_rows, Exec> rows_;  // a record
  buffer<detail::cell_cosines, Exec> cosines_;
  irradiance_records_view view_;
  irradiance_records_statistics statistics_;
  bool is_built_ = false;
};

}  // namespace wfpg

#include <wfpg/guides/records/detail/irradiance_records_impl.hpp>
