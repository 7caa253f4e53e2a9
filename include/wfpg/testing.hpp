// Checks of what a host hands to the guider: BSDFs whose sample, density and value disagree, ray casters that
// answer for another ray, surfaces whose vectors are no unit vectors. Most wrong pictures with guiding come
// from one of these, since a guide believes densities that a plain path tracer never asks for. For a host's
// own tests, of any framework:
//
//   const auto report = wfpg::testing::check_bsdf(exec, my_bsdf, {normal});
//   if (!report) std::puts(report.message.c_str());
//
// Checks run through an execution policy, so that what a device will call is what is checked. They allocate,
// copy to the host and take up to seconds: not for a frame's time. All throw out_of_memory, and
// std::invalid_argument for options out of range.
#pragma once

#include <wfpg/bsdf.hpp>
#include <wfpg/buffer.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/ray_caster.hpp>
#include <wfpg/sparse_voxel_octree.hpp>
#include <wfpg/types.hpp>

#include <cstddef>
#include <cstdint>
#include <string>

/// Checks of what a host hands to the guider.
namespace wfpg::testing {

/// The outcome of a check.
struct check_report {
  std::string message;  ///< the first violation: where, what was found, what was expected; empty: all holds

  /// True where all holds.
  explicit operator bool() const { return message.empty(); }
};

/// What check_bsdf asks, and how strictly.
struct bsdf_check_options {
  vec3 normal{0.0f, 0.0f, 1.0f};               ///< the BSDF's shading normal, unit length
  bool reciprocal = true;                      ///< false: reciprocity is not asked
  float ior = 1.0f;                            ///< index of refraction below the normal over above, positive
  float albedo_limit = 1.0f;                   ///< of the light that goes on, at least 0
  std::size_t samples = std::size_t(1) << 16;  ///< drawn for each outgoing direction, at least 1024
  std::uint64_t seed = 1;                      ///< of all random numbers
  float tolerance = 1.0e-3f;                   ///< relative, between two ways to compute one value, in (0, 1)
  double significance = 1.0e-3;                ///< the probability that a correct BSDF is rejected, in (0, 1)
};

/// Checks that a BSDF is one as <wfpg/bsdf.hpp> says, in this order:
///
///   values       eval(), pdf() and sample() give nothing that is NaN, infinite or negative; sampled
///                directions have unit length; a sample's pdf is pdf() of it; where eval() is positive pdf()
///                is too; nothing comes from below the normal unless transmits(). Where is_delta(): eval()
///                and pdf() are 0, a sample's pdf is at most 1, and nothing else is asked.
///   frequencies  of sample()'s directions are integrals of pdf() (chi² on adaptive bins)
///   integral     of pdf() is the share of samples that succeed
///   energy       the integral of eval() over incident directions is at most `albedo_limit`, and the mean of
///                eval() / pdf over the samples
///   reciprocity  eval(a, b) / |cos b| / n_a² is eval(b, a) / |cos a| / n_b²
///   parts        glossy() gives a share in [0, 1] and an alpha in (0, 1]; the parts' densities, in their
///                shares, add up to pdf(); each part's samples, frequencies and integral, as of the whole
///
/// n is the index of refraction on a direction's side of the normal, 1 above and `ior` below. A BSDF carries
/// radiance: from incident to outgoing, f / n_outgoing² is what is symmetric (Veach 1997, section 5.2), so
/// light that enters the denser side gains n², and energy counts light from the other side times
/// (n_incident / n_outgoing)². Reciprocity is not asked within 0.06 degrees of the surface.
///
/// Outgoing directions are the normal, 3, 30, 60 and 80 degrees from it at several azimuths, and below it
/// where transmits(); for values, reciprocity and the parts' sum random ones too. Each statistical test is
/// made at `significance` over their number (Bonferroni), with an allowance of 0.05% and the quadrature's own
/// error for integrals; numbers follow from `seed`, so that a verdict does not change from run to run.
///
/// The BSDF is called inside kernels, by value. Cost: 11 outgoing directions, 22 where transmits(), times
/// `samples` samples and as many evaluations again for the quadratures; three times that with separate
/// parts. Lobes narrower than a GGX alpha of 0.01 exceed the quadrature, and the report says so.
template <class Exec, class Bsdf>
check_report check_bsdf(const Exec& exec, const Bsdf& bsdf, const bsdf_check_options& options = {});

/// What check_ray_caster asks, and how strictly.
struct caster_check_options {
  std::size_t rays = std::size_t(1) << 14;  ///< positive
  std::uint64_t seed = 1;                   ///< of the rays
  float tolerance = 1.0e-4f;    ///< between two hits of one ray, of the diagonal of the bounds, in [0, 1)
  float least_distance = 0.0f;  ///< nearer hits are not cast anew, scene units, at least 0; of use where a
                                ///< caster passes what is near, as svo_ray_caster does
  double least_hits = 0.01;     ///< share of the rays that have to hit, in [0, 1]; 1 in a closed scene
  double exceptions = 1.0e-3;   ///< share of the rays that order, anew, limits and leaves may find wrong:
                                ///< edges and cracks; in [0, 1]
  bool limits = false;          ///< t_max is asked too, which the guider itself never sets
};

/// Checks a ray caster, inline or batch (of one that is both, each form), with rays from random points of
/// `bounds` in random directions:
///
///   values   a hit has a finite positive distance, a miss a finite environment that is not negative, and
///            every hit is written; at least `least_hits` of the rays hit
///   order    a batch gives each ray its own hit: the same for the same rays in another order
///   anew     a ray from halfway to its hit finds the same point
///   limits   where options ask: a ray with t_max at half the distance misses
///
/// The report names the first ray that violates, where more than `exceptions` of the rays do.
/// Precondition: bounds are not empty.
template <class Exec, class Caster>
check_report check_ray_caster(const Exec& exec, const Caster& caster, const bounds3& bounds,
                              const caster_check_options& options = {});

/// The same inside an octree's cube, less one voxel at each face; and
///
///   leaves   a hit lies in a leaf's voxel or in one of the 26 around it
///
/// Precondition: the tree is not empty and lies in the policy's memory.
template <class Exec, class Caster>
check_report check_ray_caster(const Exec& exec, const Caster& caster, const sparse_voxel_octree_view& tree,
                              const caster_check_options& options = {});

/// Checks a surface: all is finite; normals and outgoing have unit length, to 0.1%; outgoing does not lie in
/// the surface; both normals are on one side; with a tree, the position lies in a leaf's voxel or in one of
/// the 26 around it. An inactive surface is right whatever it holds. The tree has to lie in host memory.
template <class Bsdf>
check_report check_surface(const surface<Bsdf>& s, const sparse_voxel_octree_view& tree = {});

/// The same of rays [0, count) of a wave, called inside a kernel; the report names the first ray. The tree
/// lies in the policy's memory.
template <class Exec, class Surfaces>
check_report check_surfaces(const Exec& exec, const Surfaces& surfaces, std::size_t count,
                            const sparse_voxel_octree_view& tree = {});

}  // namespace wfpg::testing

#include <wfpg/detail/check_bsdf.hpp>
#include <wfpg/detail/check_ray_caster.hpp>
#include <wfpg/detail/check_surface.hpp>
