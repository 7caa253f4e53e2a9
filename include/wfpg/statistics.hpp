// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/statistics.hpp is deprecated: include wfpg/guide/statistics.hpp")

#include <wfpg/guide/statistics.hpp>
