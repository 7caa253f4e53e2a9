// Makes results.md from the content of results.json.
#pragma once

#include "system.hpp"

#include <string>

namespace quality {

/// A table per scene and budget, with pictures and plots.
std::string markdown_of(const json& results);

}  // namespace quality
