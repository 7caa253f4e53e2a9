// A page that compares pictures with a slider, in one self-contained HTML file. A browser opens it from disk.
#pragma once

#include "app/image_io.hpp"

#include <string>
#include <vector>

namespace render {

/// A picture, its name on the page, and what the page says of it, such as its error.
struct named_picture {
  std::string name;
  image picture;
  std::string note = {};
};

/// Pictures of one scene. All have one size. The last is the reference, which errors are shown against.
struct comparison {
  std::string scene;
  std::vector<named_picture> pictures;
};

/// Throws std::invalid_argument where there are less than two pictures, two have one name, or their sizes
/// differ. The message has the names.
void require_comparable(const comparison& shown);

/// The page's text. It shows two pictures of a scene at a time, with a slider between them, exposure, zoom,
/// values of pixels, and maps of relative errors. It contains all pictures as 16-bit floats, 8 bytes a pixel
/// in base64. Finite values beyond 65504 become that. NaN and infinities stay, and are shown in magenta.
/// Throws std::invalid_argument where there is no scene, and as require_comparable() does.
std::string comparison_page(const std::string& title, const std::vector<comparison>& comparisons);

}  // namespace render
