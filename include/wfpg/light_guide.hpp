// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/light_guide.hpp is deprecated: include wfpg/guides/octree/light_guide.hpp")

#include <wfpg/guides/octree/light_guide.hpp>
