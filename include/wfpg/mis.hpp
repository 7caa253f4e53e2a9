// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/mis.hpp is deprecated: include wfpg/sampling/mis.hpp and wfpg/sampling/mixture.hpp")

#include <wfpg/sampling/mis.hpp>
#include <wfpg/sampling/mixture.hpp>
