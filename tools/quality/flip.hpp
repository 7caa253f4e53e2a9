// HDR-FLIP (Andersson et al. 2021), by the Python package flip-evaluator where there is one.
#pragma once

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

namespace quality {

/// The mean HDR-FLIP error of each pair of OpenEXR files, reference first; nothing of a picture that is not
/// finite. No list where python3 or the package is missing or fails. Files between the two programs lie in
/// `folder`.
std::optional<std::vector<std::optional<double>>> flip_errors(
    const std::vector<std::pair<std::filesystem::path, std::filesystem::path>>& pairs,
    const std::filesystem::path& folder);

}  // namespace quality
