// What was measured, as JSON and as a table.
#pragma once

#include "findings.hpp"
#include "page.hpp"

#include <nlohmann/json.hpp>

namespace inspect {

using json = nlohmann::ordered_json;

/// How far a pixel could be looked into.
enum class pixel_kind {
  nothing,  ///< hits nothing
  delta,    ///< hits a BSDF that is sampled alone
  surface   ///< all else
};

/// Of the rendering, the pixel's point and its bin; names that no pixel of the kind has are left out. What is
/// not finite is null.
json numbers_of_place(const learnt_scene& learnt, std::uint32_t pixel);
/// Of the directions there; bins and bytes are numbers_of_place's.
json numbers_of(const findings& found, const pixel_sampler& sampler);

/// What the pixel hits.
pixel_kind kind_of(const learnt_scene& learnt, std::uint32_t pixel);

/// The same in words, of an object with the members of both.
std::vector<number_row> rows_of(const json& numbers);

}  // namespace inspect
