// results.md from results.json's content.
#pragma once

#include "system.hpp"

#include <string>

namespace quality {

/// A table a scene and budget, pictures and plots beside it.
std::string markdown_of(const json& results);

}  // namespace quality
