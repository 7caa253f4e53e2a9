// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/guide_view.hpp is deprecated: include wfpg/guides/octree/guide_view.hpp")

#include <wfpg/guides/octree/guide_view.hpp>
