// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/error.hpp is deprecated: include wfpg/base/error.hpp")

#include <wfpg/base/error.hpp>
