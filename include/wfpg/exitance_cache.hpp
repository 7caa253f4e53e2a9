// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/exitance_cache.hpp is deprecated: include wfpg/octree/exitance_cache.hpp")

#include <wfpg/octree/exitance_cache.hpp>
