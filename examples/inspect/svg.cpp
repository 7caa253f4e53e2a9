// Writes SVG 1.1.
#include "svg.hpp"

#include "app/html.hpp"

#include <cstdio>

namespace inspect {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

/// ` NAMEx="..." NAMEy="..."`, with a number at its end.
std::string point(vec2 p, const std::string& before, const std::string& after) {
  return " " + before + "x" + after + "=\"" + number(double(p.x)) + "\" " + before + "y" + after + "=\"" +
         number(double(p.y)) + "\"";
}

}  // namespace

void svg::line(vec2 from, vec2 to, const std::string& attributes) {
  body_ += "<line" + point(from, "", "1") + point(to, "", "2") + " " + attributes + "/>\n";
}

void svg::circle(vec2 centre, double radius, const std::string& attributes) {
  body_ += "<circle" + point(centre, "c", "") + " r=\"" + number(radius) + "\" " + attributes + "/>\n";
}

void svg::text(vec2 at, const std::string& words, const std::string& attributes) {
  body_ += "<text" + point(at, "", "") + " " + attributes + ">" + render::escaped(words) + "</text>\n";
}

std::string svg::content() const {
  const std::string w = std::to_string(width_), h = std::to_string(height_);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + w + "\" height=\"" + h + "\" viewBox=\"0 0 " +
         w + " " + h + "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"" + w +
         "\" height=\"" + h + "\" fill=\"#fff\" stroke=\"#ccc\"/>\n" + body_ + "</svg>\n";
}

}  // namespace inspect
