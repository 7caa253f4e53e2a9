// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/voxelizer.hpp is deprecated: include wfpg/octree/voxelizer.hpp")

#include <wfpg/octree/voxelizer.hpp>
