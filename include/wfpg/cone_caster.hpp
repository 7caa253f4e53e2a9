// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/cone_caster.hpp is deprecated: include wfpg/octree/svo_cone_caster.hpp")

#include <wfpg/octree/svo_cone_caster.hpp>
