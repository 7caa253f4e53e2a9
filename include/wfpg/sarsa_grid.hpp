// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/sarsa_grid.hpp is deprecated: include wfpg/guides/sarsa/sarsa_grid.hpp")

#include <wfpg/guides/sarsa/sarsa_grid.hpp>
