// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message( \
    "wfpg/octree_guide.hpp is deprecated: include wfpg/guides/octree/kept_guide.hpp and wfpg/guides/octree/transient_guide.hpp")

#include <wfpg/guides/octree/kept_guide.hpp>
#include <wfpg/guides/octree/transient_guide.hpp>
