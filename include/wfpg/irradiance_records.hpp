// Forwards to where the header is now; gone in version 0.3.
#pragma once

#pragma message( \
    "wfpg/irradiance_records.hpp is deprecated: include wfpg/guides/records/irradiance_records.hpp")

#include <wfpg/guides/records/irradiance_records.hpp>
