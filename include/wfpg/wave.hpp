// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/wave.hpp is deprecated: include wfpg/host/wave.hpp and wfpg/guide/statistics.hpp")

#include <wfpg/guide/statistics.hpp>
#include <wfpg/host/wave.hpp>
