// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/guide.hpp is deprecated: include wfpg/guide/guide.hpp")

#include <wfpg/guide/guide.hpp>
