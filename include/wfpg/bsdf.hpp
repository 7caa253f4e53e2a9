// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/bsdf.hpp is deprecated: include wfpg/host/bsdf.hpp")

#include <wfpg/host/bsdf.hpp>
