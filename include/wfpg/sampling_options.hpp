// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/sampling_options.hpp is deprecated: include wfpg/guide/sampling_options.hpp")

#include <wfpg/guide/sampling_options.hpp>
