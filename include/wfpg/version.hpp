// The library's version.
#pragma once

#define WFPG_VERSION_MAJOR 0
#define WFPG_VERSION_MINOR 1
#define WFPG_VERSION_PATCH 0
