// Checks the surfaces that a host describes to the guider. For a host's own tests, in any framework.
// check_surfaces() runs through an execution policy, so that it tests what a device will call.
// It throws out_of_memory.
// Source: none; each check is a property that the library relies on.
// Cost: one kernel, an allocation and a copy to the host. Not for a frame's time.
// Memory: 52 bytes a surface, in the policy's memory and on the host.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/testing/check_report.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::testing {

/// Checks one surface, on the host:
///
/// - position, normals and outgoing are finite;
/// - normals and outgoing have unit length, to 0.1%;
/// - outgoing does not lie in the surface;
/// - both normals are on one side;
/// - with a tree, the position lies in a leaf's voxel or in one of the 26 around it.
///
/// An inactive surface is right whatever it holds. The tree must lie in host memory.
template <class Bsdf>
check_report check_surface(const surface<Bsdf>& s, const sparse_voxel_octree_view& tree = {});

/// Checks the surfaces of rays [0, count) of a wave, which a kernel asks for.
/// The report names the first ray whose surface is wrong.
/// The tree must lie in the policy's memory; an empty one is not asked.
template <class Exec, class Surfaces>
check_report check_surfaces(const Exec& exec, const Surfaces& surfaces, std::size_t count,
                            const sparse_voxel_octree_view& tree = {});

}  // namespace wfpg::testing

#include <wfpg/testing/detail/check_surfaces_impl.hpp>
