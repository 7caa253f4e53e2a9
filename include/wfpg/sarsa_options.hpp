// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/sarsa_options.hpp is deprecated: include wfpg/guides/sarsa/options.hpp")

#include <wfpg/guides/sarsa/options.hpp>
