// What a host's ray caster looks like to the library, in either of two forms:
//
//   inline   ray_hit operator()(const ray&) const;                 called inside a kernel, by value
//   batch    void cast(const Exec&, array_view<const ray>, array_view<ray_hit>) const;
//                                                                   launched by the host over a span
//
// An inline caster may take cones too, and is then told how wide those of fields are, in steradians:
//
//   cone     ray_hit operator()(const ray&, float solid_angle) const;
//
// A hit carries the distance or, on a miss, the environment's radiance; where next-event estimation samples
// the environment, a caster answers 0 for it so that guiding looks for what that does not find. Hits may be
// ignored outside (t_min, t_max).
#pragma once

#include <wfpg/detail/octree_walk.hpp>
#include <wfpg/sparse_voxel_octree.hpp>
#include <wfpg/types.hpp>

#include <cstddef>
#include <type_traits>
#include <utility>

namespace wfpg {
namespace detail {

template <class C, class = void>
struct is_inline_caster : std::false_type {};
template <class C>
struct is_inline_caster<C,
                        std::void_t<decltype(ray_hit(std::declval<const C&>()(std::declval<const ray&>())))>>
    : std::true_type {};

template <class C, class = void>
struct is_cone_caster : std::false_type {};
template <class C>
struct is_cone_caster<
    C, std::void_t<decltype(ray_hit(std::declval<const C&>()(std::declval<const ray&>(), 0.0f)))>>
    : is_inline_caster<C> {};

template <class C, class Exec, class = void>
struct is_batch_caster : std::false_type {};
template <class C, class Exec>
struct is_batch_caster<C, Exec,
                       std::void_t<decltype(std::declval<const C&>().cast(
                           std::declval<const Exec&>(), array_view<const ray>(), array_view<ray_hit>()))>>
    : std::true_type {};

/// Rays through an inline caster.
template <class Caster>
struct cast_each {
  Caster caster;
  array_view<const ray> rays;
  array_view<ray_hit> hits;
  WFPG_HD void operator()(std::size_t i) const { hits[i] = caster(rays[i]); }
};

}  // namespace detail

/// True where C can be called inside a kernel for one ray.
template <class C>
inline constexpr bool is_inline_caster_v = detail::is_inline_caster<C>::value;

/// True where C is such a caster that is told how wide cones are.
template <class C>
inline constexpr bool is_cone_caster_v = detail::is_cone_caster<C>::value;

/// True where C casts a span of rays when the host asks.
template <class C, class Exec>
inline constexpr bool is_batch_caster_v = detail::is_batch_caster<C, Exec>::value;

/// True where C is a ray caster in one of its forms.
template <class C, class Exec>
inline constexpr bool is_ray_caster_v = is_inline_caster_v<C> || is_batch_caster_v<C, Exec>;

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
    const float start = detail::max(r.t_min * per_unit, clearance_);
    float t = detail::max(start, detail::distance_to_exit(origin, r.direction, extent, true));
    const float exit = detail::distance_to_exit(origin, r.direction, extent, false);
    const bool leads = detail::leads_somewhere(r.origin, r.direction, exit);
    const float end = leads ? detail::min(exit, r.t_max * per_unit) : 0.0f;
    for (t = detail::past_face(t); t < end && !tree_.empty(); t = detail::past_face(t)) {
      const vec3 p = origin + t * r.direction;
      const vec3 cell = glm::clamp(p, vec3(0.0f), vec3(extent - 0.5f));
      vec3 lower;
      float size;
      if (detail::node_or_gap(tree_, uvec3(cell), tree_.depth(), lower, size) != invalid_node)
        return {t / per_unit, 0.0f};
      t = detail::max(detail::distance_to_exit(origin - lower, r.direction, size, false), t);
    }
    return {-1.0f, environment_};
  }

 private:
  sparse_voxel_octree_view tree_;
  float environment_;
  float clearance_;
};

}  // namespace wfpg
