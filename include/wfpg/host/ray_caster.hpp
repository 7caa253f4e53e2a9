// The interface of a host's ray casters, in either of two forms:
//
//   inline   ray_hit operator()(const ray&) const;                 called inside a kernel, by value
//   batch    void cast(const Exec&, array_view<const ray>, array_view<ray_hit>) const;
//                                                                   launched by the host over a span
//
// An inline caster may take cones too.
// It is then given the solid angle of a field's cell, steradians:
//
//   cone     ray_hit operator()(const ray&, float solid_angle) const;
//
// A hit carries the distance.
// A miss carries the environment's radiance.
// Where next-event estimation samples the environment, a caster should answer 0 for it.
// Guiding then looks for light that next-event estimation does not find.
// A caster may ignore hits outside of (t_min, t_max).
// Cost: that of the host's own traversal, once a ray.
// Memory: a batch takes 40 bytes a ray, of the library.
#pragma once

#include <wfpg/base/types.hpp>

#include <cstddef>
#include <type_traits>
#include <utility>

namespace wfpg {
namespace detail {

/// Detects a call with a ray.
template <class C, class = void>
struct is_inline_caster : std::false_type {};
template <class C>
struct is_inline_caster<C,
                        std::void_t<decltype(ray_hit(std::declval<const C&>()(std::declval<const ray&>())))>>
    : std::true_type {};

/// Detects a call with a ray and a solid angle beside that with a ray alone.
template <class C, class = void>
struct is_cone_caster : std::false_type {};
template <class C>
struct is_cone_caster<
    C, std::void_t<decltype(ray_hit(std::declval<const C&>()(std::declval<const ray&>(), 0.0f)))>>
    : is_inline_caster<C> {};

/// Detects cast() for one execution policy.
template <class C, class Exec, class = void>
struct is_batch_caster : std::false_type {};
template <class C, class Exec>
struct is_batch_caster<C, Exec,
                       std::void_t<decltype(std::declval<const C&>().cast(
                           std::declval<const Exec&>(), array_view<const ray>(), array_view<ray_hit>()))>>
    : std::true_type {};

/// Functor that casts ray i by an inline caster.
/// `rays` and `hits` have one length, and lie in the policy's memory.
template <class Caster>
struct cast_each {
  Caster caster;
  array_view<const ray> rays;
  array_view<ray_hit> hits;
  WFPG_HD void operator()(std::size_t i) const { hits[i] = caster(rays[i]); }
};

}  // namespace detail

/// True where kernels can call C for one ray.
template <class C>
inline constexpr bool is_inline_caster_v = detail::is_inline_caster<C>::value;

/// True where kernels can call C for a ray with a solid angle.
/// Such a caster may stop at geometry that is coarser than the cone is wide.
template <class C>
inline constexpr bool is_cone_caster_v = detail::is_cone_caster<C>::value;

/// True where the host can call C for a span of rays in the memory of `Exec`.
template <class C, class Exec>
inline constexpr bool is_batch_caster_v = detail::is_batch_caster<C, Exec>::value;

/// True where C is a ray caster in at least one of its forms.
template <class C, class Exec>
inline constexpr bool is_ray_caster_v = is_inline_caster_v<C> || is_batch_caster_v<C, Exec>;

namespace detail {

/// Casts `rays` with an inline or a batch caster, and writes as many `hits`.
/// Both arrays lie in the policy's memory.
/// Allocates nothing by itself, and throws what the caster throws.
/// A caster that has both forms is called inline, in one kernel with the loop over rays.
template <class Exec, class Caster>
void cast_rays(const Exec& exec, const Caster& caster, array_view<const ray> rays, array_view<ray_hit> hits) {
  if constexpr (is_inline_caster_v<Caster>)
    exec.for_each(rays.size(), cast_each<Caster>{caster, rays, hits});
  else
    caster.cast(exec, rays, hits);
}

}  // namespace detail

}  // namespace wfpg
