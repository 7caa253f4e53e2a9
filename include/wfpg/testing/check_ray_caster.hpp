// Checks a host's ray caster, in both of its forms.
//
// Checks run through an execution policy, so that what a device will call is what is checked. They allocate,
// copy to the host and take up to seconds: not for a frame's time. They throw out_of_memory, and
// std::invalid_argument for options out of range.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/testing/check_report.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::testing {

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

}  // namespace wfpg::testing

#include <wfpg/testing/detail/check_ray_caster_impl.hpp>
