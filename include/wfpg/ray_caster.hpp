// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message( \
    "wfpg/ray_caster.hpp is deprecated: include wfpg/host/ray_caster.hpp and wfpg/octree/svo_ray_caster.hpp")

#include <wfpg/host/ray_caster.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>
