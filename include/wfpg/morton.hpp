// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/morton.hpp is deprecated: include wfpg/base/morton.hpp")

#include <wfpg/base/morton.hpp>
