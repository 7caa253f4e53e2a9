// A page of pictures and numbers, in one self-contained HTML file.
#pragma once

#include "colour_scale.hpp"
#include "directions.hpp"
#include "svg.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace inspect {

/// A picture's PNG or SVG in the page's folder, and its caption.
struct figure {
  std::string file, caption;
  bool starts_row = false;
};

/// Figures that share a scale, and a table.
struct section {
  std::string title, text;
  std::optional<colour_scale> scale;
  std::vector<figure> figures;
  std::vector<std::vector<std::string>> rows = {};  ///< of the table below; the first has the columns' names
};

/// A number's name, and its value in words.
using number_row = std::pair<std::string, std::string>;

struct page {
  std::string title;
  std::vector<std::string> notes;  ///< what the reader should know first
  std::vector<number_row> numbers;
  std::vector<section> sections;
};

/// Writes pictures into an existing folder.
class picture_folder {
 public:
  explicit picture_folder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& path() const { return folder_; }
  /// Writes NAME.png. Small pictures are enlarged. Throws std::runtime_error.
  figure write(const std::string& name, const std::string& caption, const render::image& picture,
               float exposure = 1.0f) const;
  /// Writes NAME.svg. Throws std::runtime_error.
  figure write(const std::string& name, const std::string& caption, const svg& drawing) const;
  /// Writes cells as NAME-octahedral and NAME-latlong: .png with the scale's colours, and .exr with the
  /// values. Throws std::runtime_error.
  std::vector<figure> write_cells(const std::string& name, const std::string& caption,
                                  const direction_grid& grid, const render::image& cells,
                                  const colour_scale& scale) const;

 private:
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

  std::filesystem::path folder_;
};

/// Values per cell as a grey picture.
render::image grey_cells(const std::vector<double>& values);

/// Writes index.html with all pictures and the scales' bars in it. Throws std::runtime_error.
void write_page(const picture_folder& folder, const page& shown);

}  // namespace inspect
