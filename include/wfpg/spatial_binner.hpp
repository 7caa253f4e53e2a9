// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/spatial_binner.hpp is deprecated: include wfpg/bins/spatial_binner.hpp")

#include <wfpg/bins/spatial_binner.hpp>
