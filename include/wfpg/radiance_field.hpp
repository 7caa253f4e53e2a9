// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message( \
    "wfpg/radiance_field.hpp is deprecated: include wfpg/guides/octree/field_cells.hpp and wfpg/guides/octree/transient_fields.hpp")

#include <wfpg/guides/octree/field_cells.hpp>
#include <wfpg/guides/octree/transient_fields.hpp>
