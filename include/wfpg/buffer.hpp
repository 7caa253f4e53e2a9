// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/buffer.hpp is deprecated: include wfpg/exec/buffer.hpp")

#include <wfpg/exec/buffer.hpp>
