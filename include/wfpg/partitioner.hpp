// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/partitioner.hpp is deprecated: include wfpg/bins/partitioner.hpp")

#include <wfpg/bins/partitioner.hpp>
