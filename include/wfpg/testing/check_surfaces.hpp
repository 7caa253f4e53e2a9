// Checks the surfaces that a host describes to the guider.
//
// Checks run through an execution policy, so that what a device will call is what is checked. They allocate,
// copy to the host and take up to seconds: not for a frame's time. They throw out_of_memory, and
// std::invalid_argument for options out of range.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/octree/sparse_voxel_octree.hpp>
#include <wfpg/testing/check_report.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::testing {

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

#include <wfpg/testing/detail/check_surfaces_impl.hpp>
