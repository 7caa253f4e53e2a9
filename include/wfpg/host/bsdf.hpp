// The interface of a host's BSDFs and surfaces: the members that the library calls inside kernels.
// Directions are in world space, have unit length and point away from the surface.
// `outgoing` points to the previous vertex of the path.
// Source: the naming of pbrt-v4, chapter 9, with incident and outgoing as seen by light.
// Cost: that of the host's own functions, which kernels call for each guided ray.
// Memory: surfaces go by value.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>

#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace wfpg {

/// A direction drawn from a BSDF.
struct bsdf_sample {
  /// Unit length, world space.
  /// Not read where `pdf` is 0.
  vec3 direction{0.0f};
  /// Density per unit solid angle, or the probability of a delta lobe.
  /// 0: sampling failed.
  float pdf = 0.0f;
  /// A delta lobe drew the direction.
  /// eval() and pdf() do not know that lobe. A BSDF may have delta lobes beside others.
  bool is_delta = false;
};

/// The narrow part of a BSDF: a lobe that reflects about the mirrored direction, or delta lobes.
struct glossy_part {
  /// Fraction of sample()'s directions that the narrow part draws, in [0, 1].
  /// 0: there is no narrow part, and the rest is a cosine lobe.
  float fraction = 0.0f;
  /// GGX roughness of the narrow part, or of a lobe of that width, in [0, 1].
  /// 0: delta lobes, which are not guided.
  float alpha = 1.0f;

  /// Returns the part of a BSDF without narrow lobes. The guide has its full fraction.
  WFPG_HD static constexpr glossy_part none() { return {}; }
  /// Returns the part of a BSDF whose roughness the host does not know.
  ///
  /// `pdf_at_mirror`: density of sample() at the mirrored direction, per steradian, of all lobes that are not
  /// delta. The part is all of the BSDF, with the GGX roughness that has this density at normal incidence:
  /// pdf = 1 / (4 pi alpha^2). A cosine lobe has at most 1/pi there, and alpha is then at least 1/2, so it
  /// keeps its guide. A diffuse BSDF under a thin coat is guided less than by its true part.
  /// Where light refracts, give the larger of the densities at the mirrored and the refracted direction.
  /// A peak above 32 per steradian spans few of a field's cells. It counts as delta: the guide leaves it
  /// to the BSDF.
  /// A density that is not positive, or not finite, gives none(). Source: Heitz 2018, "Sampling the GGX
  /// Distribution of Visible Normals".
  WFPG_HD static glossy_part unknown(float pdf_at_mirror) {
    if (!is_finite(pdf_at_mirror) || !(pdf_at_mirror > 0.0f)) return none();
    if (pdf_at_mirror > 32.0f) return {1.0f, 0.0f};
    return {1.0f, min(0.28209479f / std::sqrt(pdf_at_mirror), 1.0f)};
  }
};

/// A point where a path goes on, as the host describes it.
template <class Bsdf>
struct surface {
  vec3 position{0.0f};          ///< world space, scene units
  vec3 geometric_normal{0.0f};  ///< unit length, on either side of the surface
  /// Shading normal, unit length, on the geometric normal's side.
  /// Decides a bin's orientation.
  vec3 normal{0.0f};
  vec3 outgoing{0.0f};  ///< toward the previous vertex, unit length
  Bsdf bsdf{};          ///< as is_bsdf_v describes it
  /// False: this ray of the capacity is not in use, and nothing else of it is read.
  bool active = true;
  /// Index of the ray's path, as the recorder knows it. A guide that is not sure that it pays guides a few
  /// paths. It asks for the same ones at all depths, so that it guides all where hosts leave this out.
  std::uint32_t path = no_path;
};

/// Returns whether `n` is finite and of about unit length: in (0.5, 2), which rounding never leaves.
WFPG_HD inline bool is_normal(vec3 n) {
  const float square = glm::dot(n, n);
  return is_finite(square) && square > 0.25f && square < 4.0f;
}

/// Returns the shading normal, turned to the side of `outgoing`.
/// Where they are perpendicular, it stays.
template <class Bsdf>
WFPG_HD vec3 facing_normal(const surface<Bsdf>& s) {
  return glm::dot(s.normal, s.outgoing) >= 0.0f ? s.normal : -s.normal;
}

namespace detail {

/// Detects the five members of a BSDF.
template <class B, class = void>
struct is_bsdf : std::false_type {};

template <class B>
struct is_bsdf<B, std::void_t<decltype(float(std::declval<const B&>().eval(vec3(), vec3()))),
                              decltype(float(std::declval<const B&>().pdf(vec3(), vec3()))),
                              decltype(bsdf_sample(std::declval<const B&>().sample(vec3(), vec2()))),
                              decltype(bool(std::declval<const B&>().is_delta())),
                              decltype(bool(std::declval<const B&>().transmits()))>> : std::true_type {};

/// Detects glossy().
template <class B, class = void>
struct has_glossy_part : std::false_type {};
template <class B>
struct has_glossy_part<B, std::void_t<decltype(glossy_part(std::declval<const B&>().glossy(vec3())))>>
    : std::true_type {};

/// Detects sample_part() and pdf_part() beside glossy().
template <class B, class = void>
struct has_separate_parts : std::false_type {};
template <class B>
struct has_separate_parts<
    B, std::void_t<decltype(bsdf_sample(std::declval<const B&>().sample_part(true, vec3(), vec2()))),
                   decltype(float(std::declval<const B&>().pdf_part(true, vec3(), vec3())))>>
    : has_glossy_part<B> {};

/// Takes the BSDF's type from a surface's type.
template <class S>
struct surface_bsdf {};
template <class B>
struct surface_bsdf<surface<B>> {
  using type = B;
};

}  // namespace detail

// clang-format off
/// True where B is a BSDF:
///   float eval(vec3 outgoing, vec3 incident) const;     f |cos|, luminance, per steradian; 0 for delta lobes
///   float pdf(vec3 outgoing, vec3 incident) const;      of sample(), per steradian; 0 for delta lobes
///   bsdf_sample sample(vec3 outgoing, vec2 u) const;    u in [0,1)²
///   bool is_delta() const;                              all of it is delta lobes: sampled alone, not guided.
///                                                       Lobes of other BSDFs say it in bsdf_sample
///   bool transmits() const;                             light can come from below the normal
/// eval and pdf are zero, and sample fails, where the BSDF is black.
/// Wherever eval is positive, pdf is too.
template <class B>
inline constexpr bool is_bsdf_v = detail::is_bsdf<B>::value;

/// True where B describes a narrow part, which is guided less:
///   glossy_part glossy(vec3 outgoing) const;
template <class B>
inline constexpr bool has_glossy_part_v = detail::has_glossy_part<B>::value;

/// True where B can also draw the narrow part and the rest separately:
///   bsdf_sample sample_part(bool glossy, vec3 outgoing, vec2 u) const;
///   float pdf_part(bool glossy, vec3 outgoing, vec3 incident) const;      of sample_part(), per steradian
/// A delta lobe's pdf is its probability: in the part for sample_part(), in the whole BSDF for sample().
/// With the part's fraction p, p · pdf_part(true, ...) + (1 - p) · pdf_part(false, ...) is pdf(...).
// clang-format on
template <class B>
inline constexpr bool has_separate_parts_v = detail::has_separate_parts<B>::value;

/// The BSDF type of a surfaces functor: one with surface<Bsdf> operator()(std::uint32_t ray) const.
template <class Surfaces>
using bsdf_of_t = typename detail::surface_bsdf<
    std::decay_t<decltype(std::declval<const Surfaces&>()(std::uint32_t(0)))>>::type;

/// Returns whether a guide that knows directions by place and normal can serve a surface.
/// False for delta BSDFs, and where the position or the normal is not finite.
template <class Bsdf>
WFPG_HD bool can_be_guided(const surface<Bsdf>& s) {
  return !s.bsdf.is_delta() && is_finite(s.position) && is_normal(s.normal);
}

}  // namespace wfpg
