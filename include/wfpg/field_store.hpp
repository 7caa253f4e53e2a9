// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message("wfpg/field_store.hpp is deprecated: include wfpg/guides/octree/field_store.hpp")

#include <wfpg/guides/octree/field_store.hpp>
