// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/octahedral_map.hpp is deprecated: include wfpg/base/octahedral_map.hpp")

#include <wfpg/base/octahedral_map.hpp>
