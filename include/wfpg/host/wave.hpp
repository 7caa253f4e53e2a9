// One depth of a wavefront, as the renderer describes it to the guider.
// Source: wavefront path tracing (Laine et al. 2013, "Megakernels Considered Harmful").
// Cost: surfaces and random numbers are asked inside kernels, when they are needed.
// Memory: that of the two functors, which go to kernels by value.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace wfpg {

/// Rays [0, ray_count) that have hit something and need a next direction.
/// Inactive rays may lie among them.
///   Surfaces  surface<Bsdf> operator()(std::uint32_t ray) const;
///             std::uint32_t path(std::uint32_t ray) const;   optional: surface::path, where that is cheaper
///   Random    vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const;   in [0,1)², dimensions 0
///   and 1
template <class Surfaces, class Random>
struct wave {
  std::uint32_t depth = 0;    ///< 0: the camera's first hits
  std::size_t ray_count = 0;  ///< rays, or a capacity of them
  Surfaces surfaces;          ///< where they have hit
  Random random;              ///< the numbers that directions are drawn from
};
/// Deduces both functor types from the arguments.
template <class Surfaces, class Random>
wave(std::uint32_t, std::size_t, Surfaces, Random) -> wave<Surfaces, Random>;

/// Stands for a wave's random numbers where nothing is drawn, as in path_guider::prepare().
struct no_random {
  /// Returns zeros.
  WFPG_HD vec2 operator()(std::uint32_t, std::uint32_t) const { return vec2(0.0f); }
};

/// Directions whose densities the renderer needs from the fields of a wave.
/// Next-event estimation chose them, and weighs them against the mixture by multiple importance sampling.
///   Query  vec3 operator()(std::uint32_t ray) const;   unit length, or zero for none
template <class Query>
struct density_queries {
  Query query;                  ///< direction for each ray index
  array_view<float> densities;  ///< output, one a ray: the whole mixture's density, per steradian; 0 for none
};
/// Deduces the functor's type from the argument.
template <class Query>
density_queries(Query, array_view<float>) -> density_queries<Query>;

/// Stands for a wave without density queries.
struct no_queries {};

namespace detail {

/// Detects a functor that gives a surface for a ray.
template <class S, class = void>
struct is_surfaces : std::false_type {};
template <class S>
struct is_surfaces<S, std::void_t<bsdf_of_t<S>>> : std::true_type {};

/// Detects surfaces that give a ray's path without its surface.
template <class S, class = void>
struct gives_paths : std::false_type {};
template <class S>
struct gives_paths<S, std::void_t<decltype(std::uint32_t(std::declval<const S&>().path(std::uint32_t(0))))>>
    : std::true_type {};

/// Detects a functor that gives two random numbers for a ray and a dimension.
template <class R, class = void>
struct is_random : std::false_type {};
template <class R>
struct is_random<R, std::void_t<decltype(vec2(std::declval<const R&>()(std::uint32_t(0), std::uint32_t(0))))>>
    : std::true_type {};

}  // namespace detail

/// True where S(ray) returns a wfpg::surface.
template <class S>
inline constexpr bool is_surfaces_v = detail::is_surfaces<S>::value;
/// True where S has std::uint32_t path(ray): surface::path, also of rays that are not active.
/// While the guide probes, it spares the surfaces of paths that the guide takes no part in.
template <class S>
inline constexpr bool gives_paths_v = detail::gives_paths<S>::value;
/// True where R(ray, dimension) converts to a vec2.
template <class R>
inline constexpr bool is_random_v = detail::is_random<R>::value;

}  // namespace wfpg
