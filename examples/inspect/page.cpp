// Writes HTML with pictures as base64.
#include "page.hpp"

#include "app/html.hpp"
#include "app/output_files.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace inspect {
namespace {

using render::base64;
using render::escaped;

constexpr int least_side = 256;  // pixels, of cells
constexpr int map_height = 256;
const vec3 no_cell(0.2f, 0.2f, 0.2f);

constexpr const char* style =
    "body{font:15px/1.5 system-ui,sans-serif;max-width:75rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "h1{font-size:1.5rem}h2{font-size:1.15rem;margin:2.5rem 0 .3rem}p{max-width:50rem}"
    "figure{display:inline-block;margin:0 1rem 1rem 0;vertical-align:top}"
    "figcaption{font-size:.85rem;max-width:32rem}img{display:block;max-width:100%;image-rendering:pixelated}"
    "td,th{padding:.1rem 1.5rem .1rem 0;border-bottom:1px solid #ddd;text-align:left}"
    "td+td{font-variant-numeric:tabular-nums}"
    ".note{background:#fff3cd;padding:.5rem 1rem}.bar{width:512px;font-size:.8rem;margin:.5rem 0 1rem}"
    ".bar div{display:flex;justify-content:space-between}";

std::string embedded(const picture_folder& folder, const std::string& name, const std::string& about) {
  const std::string path = (folder.path() / name).string();
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (bytes.empty()) throw std::runtime_error(path + ": cannot be read");
  const bool is_svg = std::filesystem::path(name).extension() == ".svg";
  return std::string("<img src=\"data:image/") + (is_svg ? "svg+xml" : "png") + ";base64," + base64(bytes) +
         "\" alt=\"" + escaped(about) + "\">\n";
}

std::string bar(const picture_folder& folder, const colour_scale& scale, std::size_t number) {
  const figure drawn = folder.write("bar-" + std::to_string(number), scale.unit(), scale.bar());
  std::string text = "<div class=\"bar\">" + embedded(folder, drawn.file, drawn.caption) + "<div>";
  for (const std::string& label : scale.labels()) text += "<span>" + escaped(label) + "</span>";
  return text + "</div>" + escaped(scale.unit()) + "</div>\n";
}

std::string table(const std::vector<number_row>& rows) {
  std::string text = "<table>\n";
  for (const auto& [name, value] : rows)
    text += "<tr><td>" + escaped(name) + "</td><td>" + escaped(value) + "</td></tr>\n";
  return text + "</table>\n";
}

std::string table(const std::vector<std::vector<std::string>>& rows) {
  std::string text = "<table>\n";
  for (const std::vector<std::string>& row : rows) {
    const std::string cell = &row == &rows.front() ? "th>" : "td>";
    text += "<tr>";
    for (const std::string& value : row) text += "<" + cell + escaped(value) + "</" + cell;
    text += "</tr>\n";
  }
  return text + "</table>\n";
}

}  // namespace

figure picture_folder::write(const std::string& name, const std::string& caption,
                             const render::image& picture, float exposure) const {
  const int times = std::max(1, (least_side - 1) / std::max(picture.width, picture.height) + 1);
  render::write_png(file(name + ".png"), times > 1 ? render::enlarged(picture, times) : picture, exposure);
  return {name + ".png", caption, false};
}

figure picture_folder::write(const std::string& name, const std::string& caption, const svg& drawing) const {
  render::write_file(file(name + ".svg"), drawing.content());
  return {name + ".svg", caption, false};
}

std::vector<figure> picture_folder::write_cells(const std::string& name, const std::string& caption,
                                                const direction_grid& grid, const render::image& cells,
                                                const colour_scale& scale) const {
  render::write_exr(file(name + "-octahedral.exr"), cells);
  render::write_exr(file(name + "-latlong.exr"), latitude_longitude(grid, cells, map_height, vec3(0.0f)));
  const render::image coloured = scale.colours(cells);
  figure square = write(name + "-octahedral", caption, coloured);
  square.starts_row = true;
  return {square, write(name + "-latlong", "the same, latitude and longitude",
                        latitude_longitude(grid, coloured, map_height, no_cell))};
}

render::image grey_cells(const std::vector<double>& values) {
  const int side = static_cast<int>(std::lround(std::sqrt(double(values.size()))));
  render::image picture = render::make_image(side, side);
  for (std::size_t i = 0; i < values.size(); ++i) picture.pixels[i] = vec3(static_cast<float>(values[i]));
  return picture;
}

void write_page(const picture_folder& folder, const page& shown) {
  std::string body = "<h1>" + escaped(shown.title) + "</h1>\n";
  for (const std::string& note : shown.notes) body += "<p class=\"note\">" + escaped(note) + "</p>\n";
  body += table(shown.numbers);
  for (std::size_t i = 0; i < shown.sections.size(); ++i) {
    const section& s = shown.sections[i];
    body += "<h2>" + escaped(s.title) + "</h2>\n<p>" + escaped(s.text) + "</p>\n";
    if (s.scale) body += bar(folder, *s.scale, i);
    for (const figure& f : s.figures)
      body += std::string(f.starts_row ? "<br>" : "") + "<figure>" + embedded(folder, f.file, f.caption) +
              "<figcaption>" + escaped(f.caption) + "</figcaption></figure>\n";
    if (!s.rows.empty()) body += table(s.rows);
  }
  render::write_file((folder.path() / "index.html").string(),
                     "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>" +
                         escaped(shown.title) + "</title><style>" + style + "</style></head>\n<body>\n" +
                         body + "</body>\n</html>\n");
}

}  // namespace inspect
