// A ray caster of the octree itself, for hosts without one and for tests. It marches through the octree to
// the first leaf. Section 3.3 of the paper names this way and finds it slower than ray tracing hardware.
// Source: Laine & Karras 2010, "Efficient Sparse Voxel Octrees".
//
// Cost: O(nodes passed · depth) a ray. No memory besides the octree's.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/octree/detail/octree_walk.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg {

/// An inline caster that needs no host: it answers where a ray enters the first leaf. Empty nodes are passed
/// in one step. Leaves nearer than `clearance` voxels are passed too, since a ray starts in a voxel of its
/// own surface. Thin geometry is thickened to a voxel. The octree must outlive the caster.
class svo_ray_caster {
 public:
  /// Caster of an octree. `environment`: radiance where a ray leaves the octree, luminance, W/(m² sr).
  /// `clearance`: distance in voxels, at least 0, below which leaves are passed.
  WFPG_HD explicit svo_ray_caster(const sparse_voxel_octree_view& tree, float environment = 0.0f,
                                  float clearance = 2.0f)
      : tree_(tree), environment_(environment), clearance_(clearance) {}

  /// Casts a ray of unit direction. Returns the distance at which it enters a leaf's voxel, scene units, or a
  /// miss with the environment's radiance. A ray that is not finite, or whose direction is zero, is a miss.
  /// So is every ray in an empty octree.
  WFPG_HD ray_hit operator()(const ray& r) const {
    // The march is in units of voxels: t times per_unit.
    const vec3 origin = tree_.grid().to_grid(r.origin);
    const float per_unit = static_cast<float>(tree_.grid().resolution) / tree_.grid().side;
    const auto extent = static_cast<float>(tree_.grid().resolution);
    const float start = max(r.t_min * per_unit, clearance_);
    float t = max(start, detail::distance_to_exit(origin, r.direction, extent, true));
    const float exit = detail::distance_to_exit(origin, r.direction, extent, false);
    // A ray that leads nowhere gets an empty range and is a miss.
    const bool has_direction = detail::is_direction(r.origin, r.direction, exit);
    const float end = has_direction ? min(exit, r.t_max * per_unit) : 0.0f;
    // Each step ends on a face of an empty cube, and past_face() moves the next one beyond it.
    for (t = detail::past_face(t); t < end && !tree_.empty(); t = detail::past_face(t)) {
      const vec3 p = origin + t * r.direction;
      // Rounding may put a point at the octree's border outside.
      const vec3 cell = glm::clamp(p, vec3(0.0f), vec3(extent - 0.5f));
      vec3 lower;
      float size;
      if (detail::node_or_gap(tree_, uvec3(cell), tree_.depth(), lower, size) != invalid_node)
        return {t / per_unit, 0.0f};
      t = max(detail::distance_to_exit(origin - lower, r.direction, size, false), t);
    }
    return {-1.0f, environment_};
  }

 private:
  sparse_voxel_octree_view tree_;  ///< not owned
  float environment_;              ///< radiance of misses, W/(m² sr)
  float clearance_;                ///< voxels
};

}  // namespace wfpg
