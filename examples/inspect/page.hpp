// A page of pictures and numbers, in one HTML file that needs nothing else.
#pragma once

#include "colour_scale.hpp"
#include "directions.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace inspect {

/// A picture's PNG in the page's folder, and what is below it.
struct figure {
  std::string file, caption;
  bool starts_row = false;
};

/// Figures that share a scale.
struct section {
  std::string title, text;
  std::optional<colour_scale> scale;
  std::vector<figure> figures;
};

/// What the numbers say: a name, and a value in words.
using number_row = std::pair<std::string, std::string>;

struct page {
  std::string title;
  std::vector<std::string> notes;  ///< what the reader should know first
  std::vector<number_row> numbers;
  std::vector<section> sections;
};

/// Writes pictures into a folder that is there.
class picture_folder {
 public:
  explicit picture_folder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& path() const { return folder_; }
  /// NAME.png, small pictures enlarged. Throws std::runtime_error.
  figure write(const std::string& name, const std::string& caption, const render::image& picture,
               float exposure = 1.0f) const;
  /// Cells as NAME-octahedral and NAME-latlong, .png by the scale and .exr as they are. Throws
  /// std::runtime_error.
  std::vector<figure> write_cells(const std::string& name, const std::string& caption,
                                  const direction_grid& grid, const render::image& cells,
                                  const colour_scale& scale) const;

 private:
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

  std::filesystem::path folder_;
};

/// A value a cell as a grey picture.
render::image grey_cells(const std::vector<double>& values);

/// Writes index.html with all pictures in it, and the scales' bars. Throws std::runtime_error.
void write_page(const picture_folder& folder, const page& shown);

}  // namespace inspect
