// Pictures become JSON in the page, which its script decodes when they are first shown.
#include "app/comparison_page.hpp"

#include "app/colour_map.hpp"
#include "app/comparison_script.hpp"
#include "app/html.hpp"

#include <half.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace render {
namespace {

using json = nlohmann::ordered_json;

constexpr float largest = 65504.0f;  // of 16-bit floats
constexpr int heat_steps = 256;

std::string size_of(const image& picture) {
  return std::to_string(picture.width) + " x " + std::to_string(picture.height);
}

/// Three 16-bit floats a pixel, low bytes first.
std::string half_floats(const image& picture) {
  std::string bytes;
  bytes.reserve(picture.pixels.size() * 6);
  for (const vec3& pixel : picture.pixels)
    for (int c = 0; c < 3; ++c) {
      const float value = pixel[c];
      const bool is_finite = std::isfinite(value);
      const auto bits = half(is_finite ? std::clamp(value, -largest, largest) : value).bits();
      bytes += static_cast<char>(bits & 255);
      bytes += static_cast<char>(bits >> 8);
    }
  return bytes;
}

/// Colours of errors from 0 to 1, three bytes each.
std::string heat_bytes() {
  std::string bytes;
  for (int i = 0; i < heat_steps; ++i) {
    const vec3 colour = heat_colour(static_cast<float>(i) / (heat_steps - 1));
    for (int c = 0; c < 3; ++c)
      bytes += static_cast<char>(
          static_cast<unsigned char>(linear_to_srgb(std::clamp(colour[c], 0.0f, 1.0f)) * 255.0f + 0.5f));
  }
  return bytes;
}

json data_of(const comparison& shown) {
  json pictures = json::array();
  for (const named_picture& p : shown.pictures)
    pictures.push_back({{"name", p.name}, {"note", p.note}, {"halves", base64(half_floats(p.picture))}});
  return {{"scene", shown.scene},
          {"width", shown.pictures.back().picture.width},
          {"height", shown.pictures.back().picture.height},
          {"pictures", std::move(pictures)}};
}

/// JSON that may stand in a script element: no tag and no comment begins in it.
std::string in_script(const json& data) {
  std::string text = data.dump(-1, ' ', false, json::error_handler_t::replace);
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
    text.replace(at, 1, "\\u003c");
  return text;
}

}  // namespace

void require_comparable(const comparison& shown) {
  if (shown.pictures.size() < 2)
    throw std::invalid_argument(shown.scene + " has " + std::to_string(shown.pictures.size()) +
                                " pictures, at least 2 are compared");
  const named_picture& last = shown.pictures.back();
  for (auto p = shown.pictures.begin(); p != shown.pictures.end(); ++p) {
    if (p->picture.width != last.picture.width || p->picture.height != last.picture.height)
      throw std::invalid_argument(p->name + " has " + size_of(p->picture) + " pixels, and " + last.name +
                                  " has " + size_of(last.picture) + ": only equal sizes are compared");
    const auto is_same = [&](const named_picture& other) { return other.name == p->name; };
    if (std::any_of(shown.pictures.begin(), p, is_same))
      throw std::invalid_argument("two pictures of " + shown.scene + " are called " + p->name +
                                  ": name them by NAME=FILE");
  }
}

namespace {

/// Throws std::invalid_argument where a browser could not read the page. Firefox and Chromium hold texts of
/// less than 2^29 characters.
void require_readable(const std::vector<comparison>& comparisons) {
  constexpr std::size_t most_pixels = 45'000'000;  // 8 bytes each, which take 32 / 3 characters
  std::size_t pixels = 0;
  for (const comparison& shown : comparisons)
    for (const named_picture& p : shown.pictures) pixels += p.picture.pixels.size();
  if (pixels > most_pixels)
    throw std::invalid_argument("the pictures have " + std::to_string(pixels / 1'000'000) +
                                " million pixels in all, and browsers read pages of up to " +
                                std::to_string(most_pixels / 1'000'000) +
                                " million: compare fewer or smaller ones");
}

}  // namespace

std::string comparison_page(const std::string& title, const std::vector<comparison>& comparisons) {
  if (comparisons.empty()) throw std::invalid_argument("there are no pictures to compare");
  require_readable(comparisons);
  json data{{"heat", base64(heat_bytes())}, {"comparisons", json::array()}};
  for (const comparison& shown : comparisons) {
    require_comparable(shown);
    data["comparisons"].push_back(data_of(shown));
  }
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width\"><title>" +
         escaped(title) + "</title>\n<style>" + comparison_style + "</style></head>\n<body>\n" +
         comparison_body + "<script type=\"application/json\" id=\"data\">" + in_script(data) +
         "</script>\n<script>" + comparison_script + "</script>\n</body>\n</html>\n";
}

}  // namespace render
