// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message( \
    "wfpg/testing.hpp is deprecated: include wfpg/testing/check_bsdf.hpp and wfpg/testing/check_ray_caster.hpp and wfpg/testing/check_surfaces.hpp")

#include <wfpg/testing/check_bsdf.hpp>
#include <wfpg/testing/check_ray_caster.hpp>
#include <wfpg/testing/check_surfaces.hpp>
