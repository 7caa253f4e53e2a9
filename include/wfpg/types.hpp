// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/types.hpp is deprecated: include wfpg/base/types.hpp")

#include <wfpg/base/types.hpp>
