// Sections of a page, and numbers, on what paths from both ends bring to a pixel.
#pragma once

#include "both_ends.hpp"
#include "numbers.hpp"
#include "page.hpp"

namespace inspect {

/// Members of numbers.json: of the pixel, each technique, radii, the camera path, and each photon in reach.
json numbers_of_both_ends(const both_ends& found);

/// Adds tables and drawings. `x`, `y`: the pixel from the upper left. `up`: of the camera.
void show_both_ends(const both_ends& found, int x, int y, vec3 up, const picture_folder& folder, page& shown);

}  // namespace inspect
