// What a host's BSDF and surface look like to the library. Directions are in world space, have unit length
// and point away from the surface; `outgoing` is toward the previous vertex of the path.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace wfpg {

/// A direction drawn from a BSDF.
struct bsdf_sample {
  vec3 direction{0.0f};  ///< unit length, world space
  float pdf = 0.0f;  ///< per unit solid angle, or the probability of a delta lobe; 0 where sampling failed
};

/// The narrow part of a BSDF: a lobe that reflects about a mirrored direction.
struct glossy_part {
  float share = 0.0f;  ///< of sample()'s directions that it draws, in [0, 1]; 0: the rest is the cosine's
  float alpha = 1.0f;  ///< its GGX roughness, or what is as wide, in (0, 1]
};

/// A point where a path goes on, as the host describes it.
template <class Bsdf>
struct surface {
  vec3 position{0.0f};          ///< world space
  vec3 geometric_normal{0.0f};  ///< unit length, either side
  vec3 normal{0.0f};    ///< shading normal, unit length, on the same side; decides a bin's orientation
  vec3 outgoing{0.0f};  ///< toward the previous vertex, unit length
  Bsdf bsdf{};          ///< what is_bsdf_v asks for
  bool active = true;   ///< false: this ray of the capacity is not in use, nothing else is read
};

/// Whether a vector is a normal: finite, and of about unit length.
WFPG_HD inline bool is_normal(vec3 n) {
  const float square = glm::dot(n, n);
  return is_finite(square) && square > 0.25f && square < 4.0f;
}

/// A surface's shading normal on the outgoing side.
template <class Bsdf>
WFPG_HD vec3 facing_normal(const surface<Bsdf>& s) {
  return glm::dot(s.normal, s.outgoing) >= 0.0f ? s.normal : -s.normal;
}

namespace detail {

template <class B, class = void>
struct is_bsdf : std::false_type {};

template <class B>
struct is_bsdf<B, std::void_t<decltype(float(std::declval<const B&>().eval(vec3(), vec3()))),
                              decltype(float(std::declval<const B&>().pdf(vec3(), vec3()))),
                              decltype(bsdf_sample(std::declval<const B&>().sample(vec3(), vec2()))),
                              decltype(bool(std::declval<const B&>().is_delta())),
                              decltype(bool(std::declval<const B&>().transmits()))>> : std::true_type {};

template <class B, class = void>
struct has_glossy_part : std::false_type {};
template <class B>
struct has_glossy_part<B, std::void_t<decltype(glossy_part(std::declval<const B&>().glossy(vec3())))>>
    : std::true_type {};

template <class B, class = void>
struct has_separate_parts : std::false_type {};
template <class B>
struct has_separate_parts<
    B, std::void_t<decltype(bsdf_sample(std::declval<const B&>().sample_part(true, vec3(), vec2()))),
                   decltype(float(std::declval<const B&>().pdf_part(true, vec3(), vec3())))>>
    : has_glossy_part<B> {};

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
template <class B>
inline constexpr bool is_bsdf_v = detail::is_bsdf<B>::value;

/// True where B tells of a narrow part, which is guided less:
///   glossy_part glossy(vec3 outgoing) const;
template <class B>
inline constexpr bool has_glossy_part_v = detail::has_glossy_part<B>::value;

/// True where B can draw that part and the rest alone, too:
///   bsdf_sample sample_part(bool glossy, vec3 outgoing, vec2 u) const;
///   float pdf_part(bool glossy, vec3 outgoing, vec3 incident) const;      of sample_part(), per steradian
/// share · pdf_part(true, ...) + (1 - share) · pdf_part(false, ...) is pdf(...).
// clang-format on
template <class B>
inline constexpr bool has_separate_parts_v = detail::has_separate_parts<B>::value;

/// The BSDF type of what a surfaces functor (std::uint32_t ray) -> surface<Bsdf> gives.
template <class Surfaces>
using bsdf_of_t = typename detail::surface_bsdf<
    std::decay_t<decltype(std::declval<const Surfaces&>()(std::uint32_t(0)))>>::type;

/// Whether a guide that knows directions by place and normal has something to say of a surface.
template <class Bsdf>
WFPG_HD bool can_be_guided(const surface<Bsdf>& s) {
  return !s.bsdf.is_delta() && is_finite(s.position) && is_normal(s.normal);
}

}  // namespace wfpg
