// What a host's BSDF and surface look like to the library. Directions are in world space, have unit length
// and point away from the surface; `outgoing` is toward the previous vertex of the path.
#pragma once

#include <wfpg/types.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace wfpg {

/// A direction drawn from a BSDF.
struct bsdf_sample {
  vec3 direction{0.0f};
  float pdf = 0.0f;  ///< per unit solid angle, or the probability of a delta lobe; 0 where sampling failed
};

/// A point where a path goes on, as the host describes it.
template <class Bsdf>
struct surface {
  vec3 position{0.0f};          ///< world space
  vec3 geometric_normal{0.0f};  ///< unit length, either side
  vec3 normal{0.0f};            ///< shading normal, unit length, either side; decides a bin's orientation
  vec3 outgoing{0.0f};          ///< toward the previous vertex, unit length
  Bsdf bsdf{};
  bool active = true;  ///< false: this ray of the capacity is not in use, nothing else is read
};

namespace detail {

template <class B, class = void>
struct is_bsdf : std::false_type {};

template <class B>
struct is_bsdf<B, std::void_t<decltype(float(std::declval<const B&>().eval(vec3(), vec3()))),
                              decltype(float(std::declval<const B&>().pdf(vec3(), vec3()))),
                              decltype(bsdf_sample(std::declval<const B&>().sample(vec3(), vec2()))),
                              decltype(bool(std::declval<const B&>().is_delta())),
                              decltype(bool(std::declval<const B&>().transmits()))>> : std::true_type {};

template <class S>
struct surface_bsdf {};
template <class B>
struct surface_bsdf<surface<B>> {
  using type = B;
};

}  // namespace detail

// clang-format off
/// True where B is a BSDF:
///   float eval(vec3 outgoing, vec3 incident) const;       f |cos|, luminance, per steradian; 0 for delta lobes
///   float pdf(vec3 outgoing, vec3 incident) const;        of sample(), per steradian; 0 for delta lobes
///   bsdf_sample sample(vec3 outgoing, vec2 u) const;      u in [0,1)²
///   bool is_delta() const;                                all of it is delta lobes: sampled alone, not guided
///   bool transmits() const;                               light can come from below the normal
/// eval and pdf are zero, and sample fails, where the BSDF is black. Wherever eval is positive, pdf is too.
// clang-format on
template <class B>
inline constexpr bool is_bsdf_v = detail::is_bsdf<B>::value;

/// The BSDF type of what a surfaces functor (std::uint32_t ray) -> surface<Bsdf> gives.
template <class Surfaces>
using bsdf_of_t = typename detail::surface_bsdf<
    std::decay_t<decltype(std::declval<const Surfaces&>()(std::uint32_t(0)))>>::type;

}  // namespace wfpg
