// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/product_sampler.hpp is deprecated: include wfpg/sampling/product_sampler.hpp")

#include <wfpg/sampling/product_sampler.hpp>
