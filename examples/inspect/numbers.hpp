// Measured numbers, as JSON and as a table.
#pragma once

#include "findings.hpp"
#include "page.hpp"

#include <nlohmann/json.hpp>

namespace inspect {

using json = nlohmann::ordered_json;

/// How much of a pixel could be measured.
enum class pixel_kind {
  nothing,  ///< hits nothing
  delta,    ///< hits a BSDF that is sampled alone
  surface   ///< all others
};

/// Numbers of the rendering, the pixel's point and its bin. Leaves out names that do not apply to the kind of
/// pixel. Null if a number is not finite.
json numbers_of_place(const learnt_scene& learnt, std::uint32_t pixel);
/// Numbers of the directions there. numbers_of_place() has those of bins and memory.
json numbers_of(const findings& found, const pixel_sampler& sampler);

/// The kind of the pixel's hit.
pixel_kind kind_of(const learnt_scene& learnt, std::uint32_t pixel);

/// A number, or a list of them, in words.
std::string words(const json& value);
/// The numbers in words. The object may have the members of both functions, and of numbers_of_both_ends().
std::vector<number_row> rows_of(const json& numbers);

}  // namespace inspect
