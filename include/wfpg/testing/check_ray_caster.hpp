// Checks a host's ray caster, in both of its forms. For a host's own tests, in any framework.
// Checks run through an execution policy, so that they test what a device will call.
// They throw out_of_memory, and std::invalid_argument for options out of range.
// Source: none; each check is a property that the library relies on.
// Cost: up to four casts of all rays, allocations and copies to the host. Not for a frame's time.
// Memory: 40 bytes a ray in the policy's memory, and a few times that on the host.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/testing/check_report.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::testing {

/// Options of check_ray_caster(): its inputs and how strict it is.
struct caster_check_options {
  std::size_t rays = std::size_t(1) << 14;  ///< rays that are cast; positive
  std::uint64_t seed = 1;                   ///< seed of the rays' origins and directions
  /// Difference allowed between two hits of one ray, as a fraction of the bounds' diagonal, in [0, 1).
  /// For the environment's radiance it is relative.
  float tolerance = 1.0e-4f;
  /// Rays whose second half is shorter are not cast anew: scene units, at least 0.
  /// Of use where a caster passes what is near, as svo_ray_caster does.
  float least_distance = 0.0f;
  /// Fraction of the rays that must hit, in [0, 1]. 1 suits a closed scene.
  double least_hits = 0.01;
  /// Fraction of the rays that order, anew, limits and leaves may find wrong, in [0, 1].
  /// Edges and cracks make a few.
  double exceptions = 1.0e-3;
  /// True: t_max is checked too, which the guider itself never sets.
  bool limits = false;
};

/// Checks a ray caster with rays from random points of `bounds` in random directions.
/// A caster that has both forms, inline and batch, is checked in each:
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

/// Checks a ray caster inside an octree's cube, less one voxel at each face.
/// To the checks by bounds it adds:
///
///   leaves   a hit lies in a leaf's voxel or in one of the 26 around it
///
/// Precondition: the tree is not empty and lies in the policy's memory.
template <class Exec, class Caster>
check_report check_ray_caster(const Exec& exec, const Caster& caster, const sparse_voxel_octree_view& tree,
                              const caster_check_options& options = {});

}  // namespace wfpg::testing

#include <wfpg/testing/detail/check_ray_caster_impl.hpp>
