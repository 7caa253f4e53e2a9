// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/sparse_voxel_octree.hpp is deprecated: include wfpg/octree/sparse_voxel_octree.hpp")

#include <wfpg/octree/sparse_voxel_octree.hpp>
