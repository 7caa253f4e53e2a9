// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message( \
    "wfpg/path_recorder.hpp is deprecated: include wfpg/guide/path_recorder.hpp and wfpg/guides/octree/deposit_paths.hpp")

#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guides/octree/deposit_paths.hpp>
