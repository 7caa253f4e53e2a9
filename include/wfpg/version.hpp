// The library's version.
#pragma once

/// Changes with every incompatible version, once it is 1.
#define WFPG_VERSION_MAJOR 0
/// Changes with what is new, and, while the major version is 0, with what is incompatible.
#define WFPG_VERSION_MINOR 1
/// Changes with corrections.
#define WFPG_VERSION_PATCH 0
