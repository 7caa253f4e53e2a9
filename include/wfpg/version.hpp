// The library's version, as macros for the preprocessor: a host can ask for a version with #if.
//
// Source: semantic versioning. Cost and memory: none.
#pragma once

/// Raised by every incompatible change, once it is 1.
#define WFPG_VERSION_MAJOR 0
/// Raised by new features. While the major version is 0, incompatible changes raise it too.
#define WFPG_VERSION_MINOR 2
/// Raised by corrections that change no interface.
#define WFPG_VERSION_PATCH 0
