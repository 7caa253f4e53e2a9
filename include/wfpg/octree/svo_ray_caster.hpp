// A ray caster of the octree itself, for hosts without one and for tests: it marches through the octree to
// the first leaf (paper, section 3.3, one of its alternatives; after Laine & Karras 2010).
//
// Cost: O(nodes passed * depth) a ray; no memory.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/octree/detail/octree_walk.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>

namespace wfpg {

/// An inline caster that needs no host: marches through the octree, over empty nodes in one step, to the
/// first leaf (one of the paper's alternatives in section 3.3, after Laine & Karras 2010). Leaves nearer than
/// `clearance` voxels are passed, since a ray starts in a voxel of its own surface. Cost: O(nodes passed ·
/// depth).
class svo_ray_caster {
 public:
  /// `environment`: radiance where a ray leaves the octree, luminance, W/(m² sr).
  WFPG_HD explicit svo_ray_caster(const sparse_voxel_octree_view& tree, float environment = 0.0f,
                                  float clearance = 2.0f)
      : tree_(tree), environment_(environment), clearance_(clearance) {}

  /// Casts a ray: the distance at which it enters a leaf's voxel. One that leads nowhere, since it is not
  /// finite or its direction is zero, leaves the octree.
  WFPG_HD ray_hit operator()(const ray& r) const {
    const vec3 origin = tree_.grid().to_grid(r.origin);
    const float per_unit = static_cast<float>(tree_.grid().resolution) / tree_.grid().side;
    const auto extent = static_cast<float>(tree_.grid().resolution);
    const float start = max(r.t_min * per_unit, clearance_);
    float t = max(start, detail::distance_to_exit(origin, r.direction, extent, true));
    const float exit = detail::distance_to_exit(origin, r.direction, extent, false);
    const bool leads = detail::leads_somewhere(r.origin, r.direction, exit);
    const float end = leads ? min(exit, r.t_max * per_unit) : 0.0f;
    for (t = detail::past_face(t); t < end && !tree_.empty(); t = detail::past_face(t)) {
      const vec3 p = origin + t * r.direction;
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
  sparse_voxel_octree_view tree_;
  float environment_;
  float clearance_;
};

}  // namespace wfpg
