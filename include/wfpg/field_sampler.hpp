// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/field_sampler.hpp is deprecated: include wfpg/sampling/field_sampler.hpp")

#include <wfpg/sampling/field_sampler.hpp>
