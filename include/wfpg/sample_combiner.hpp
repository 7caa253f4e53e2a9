// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/sample_combiner.hpp is deprecated: include wfpg/sampling/sample_combiner.hpp")

#include <wfpg/sampling/sample_combiner.hpp>
