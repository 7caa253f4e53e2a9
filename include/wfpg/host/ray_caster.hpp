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

#include <wfpg/base/types.hpp>

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

}  // namespace wfpg
