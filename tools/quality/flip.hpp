// HDR-FLIP (Andersson et al. 2021), by the Python package flip-evaluator if it is installed.
#pragma once

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

namespace quality {

/// The mean HDR-FLIP error of each pair of OpenEXR files, reference first. A picture that is not finite has
/// no error. Returns no list if python3 or the package is missing or fails. Temporary files are in `folder`.
std::optional<std::vector<std::optional<double>>> flip_errors(
    const std::vector<std::pair<std::filesystem::path, std::filesystem::path>>& pairs,
    const std::filesystem::path& folder);

}  // namespace quality
