// Writes SVG: a frame, decades as grid lines, curves with names at their ends.
#include "app/plot.hpp"

#include "app/html.hpp"
#include "app/output_files.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <utility>

namespace render {
namespace {

// Sizes in pixels. The curves' names are to the right of the frame.
constexpr double frame_width = 440.0, height = 420.0;
constexpr double left = 80.0, top = 40.0, bottom = 55.0;  // margins
constexpr double right_end = left + frame_width;
constexpr double least_room = 120.0, letter_width = 7.5;
constexpr double line_height = 15.0;
constexpr const char* colours[] = {"#777777", "#d95f02", "#1b6ca8", "#2a9d5c",
                                   "#8e44ad", "#b8860b", "#c0392b", "#17a2b8"};

bool is_drawn(const std::pair<double, double>& point) {
  return point.first > 0.0 && point.second > 0.0 && std::isfinite(point.first) && std::isfinite(point.second);
}

/// The range around some values, and the place of a value in it.
struct log_axis {
  double low, high;   // powers of ten, at digits: 0.3 is twice 10^0
  double begin, end;  // pixels

  double position(double value) const {
    return begin + (std::log10(value) - low) / (high - low) * (end - begin);
  }
  bool contains(double value) const {
    constexpr double rounding = 1e-9;
    return std::log10(value) > low - rounding && std::log10(value) < high + rounding;
  }
  /// Whether the grid line at `digit` times a power of ten has a label. Axes with fewer powers have more
  /// labels.
  bool is_named(int digit) const {
    const double powers = high - low;
    return digit == 1 || powers < 0.7 || (powers < 2.0 && (digit == 2 || digit == 5));
  }
};

/// The axis ends at 1, 2, ... 9 times a power of ten.
log_axis make_axis(const std::vector<double>& values, double begin, double end) {
  log_axis axis{0.0, 1.0, begin, end};
  if (values.empty()) return axis;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const auto power_of = [](double value) { return std::pow(10.0, std::floor(std::log10(value))); };
  const double below = power_of(*least), above = power_of(*most);
  axis.low = std::log10(below * std::max(1.0, std::floor(*least / below)));
  axis.high = std::max(std::log10(above * std::ceil(*most / above)), axis.low + std::log10(2.0));
  return axis;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::string line(double x0, double y0, double x1, double y1) {
  return "<line x1='" + number(x0) + "' y1='" + number(y0) + "' x2='" + number(x1) + "' y2='" + number(y1) +
         "'/>\n";
}

std::string label(double x, double y, const std::string& text, const std::string& attributes = "") {
  return "<text x='" + number(x) + "' y='" + number(y) + "' " + attributes + ">" + escaped(text) +
         "</text>\n";
}

std::string grid_line(const log_axis& axis, bool vertical, double value, bool is_power, bool is_named) {
  const double at = axis.position(value);
  std::string result = is_power ? "<g stroke='#bbb'>" : "<g stroke='#eee'>";
  result +=
      (vertical ? line(at, top, at, height - bottom) : line(left, at, right_end, at)) + std::string("</g>");
  if (!is_named) return result;
  char name[32];
  std::snprintf(name, sizeof name, "%g", value);
  return result + (vertical ? label(at, height - bottom + 18.0, name, "text-anchor='middle'")
                            : label(left - 8.0, at + 4.0, name, "text-anchor='end'"));
}

/// Lines at 1, 2, ... 9 times each power of ten, and labels at the powers. Short axes also have labels at 2
/// and 5 times.
std::string grid(const log_axis& axis, bool vertical) {
  std::string result;
  for (double power = std::floor(axis.low); power <= axis.high; power += 1.0)
    for (int digit = 1; digit < 10; ++digit) {
      const double value = digit * std::pow(10.0, power);
      if (axis.contains(value)) result += grid_line(axis, vertical, value, digit == 1, axis.is_named(digit));
    }
  return result;
}

/// A curve's name at its last point.
struct end_label {
  std::string name, colour;
  double x, y;
};

std::string draw(const curve& drawn, const log_axis& x, const log_axis& y, const std::string& colour,
                 std::vector<end_label>& labels) {
  std::string points, dots;
  double px = 0.0, py = 0.0;
  for (const auto& point : drawn.points) {
    if (!is_drawn(point)) continue;
    px = x.position(point.first);
    py = y.position(point.second);
    points += number(px) + "," + number(py) + " ";
    dots += "<circle cx='" + number(px) + "' cy='" + number(py) + "' r='3' fill='" + colour + "'/>\n";
  }
  if (!points.empty()) labels.push_back({drawn.name, colour, px, py});
  return "<polyline fill='none' stroke-width='2' stroke='" + colour + "' points='" + points + "'/>\n" + dots;
}

bool overlap(const end_label& a, const end_label& b) {
  const end_label& leftmost = a.x < b.x ? a : b;
  const double end = leftmost.x + letter_width * static_cast<double>(leftmost.name.size());
  return std::abs(a.y - b.y) < line_height && std::max(a.x, b.x) < end;
}

/// Names beside their curves' ends. Overlapping names are moved up.
std::string draw(std::vector<end_label> labels) {
  std::sort(labels.begin(), labels.end(), [](const end_label& a, const end_label& b) { return a.y > b.y; });
  std::string result;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    end_label& l = labels[i];
    for (std::size_t placed = 0; placed < i; ++placed)
      if (overlap(labels[placed], l)) l.y = labels[placed].y - line_height;
    result += label(l.x + 8.0, l.y + 4.0, l.name, "fill='" + l.colour + "'");
  }
  return result;
}

double width_of(const plot& drawn) {
  std::size_t longest = 0;
  for (const curve& c : drawn.curves) longest = std::max(longest, c.name.size());
  return right_end + std::max(least_room, 16.0 + letter_width * static_cast<double>(longest));
}

}  // namespace

void write_svg(const std::string& path, const plot& drawn) {
  std::vector<double> xs, ys;
  for (const curve& c : drawn.curves)
    for (const auto& point : c.points)
      if (is_drawn(point)) {
        xs.push_back(point.first);
        ys.push_back(point.second);
      }
  const log_axis x = make_axis(xs, left, right_end);
  const log_axis y = make_axis(ys, height - bottom, top);
  std::ostringstream svg;
  svg << "<svg xmlns='http://www.w3.org/2000/svg' width='" << width_of(drawn) << "' height='" << height
      << "' font-family='sans-serif' font-size='13'>\n<rect width='100%' height='100%' fill='white'/>\n"
      << grid(x, true) << grid(y, false)
      << label(left, top - 15.0, drawn.title, "font-size='15' font-weight='bold'")
      << label((left + right_end) / 2.0, height - 15.0, drawn.x_label, "text-anchor='middle'")
      << label(0.0, 0.0, drawn.y_label,
               "text-anchor='middle' transform='translate(18 " + number((top + height - bottom) / 2.0) +
                   ") rotate(-90)'");
  std::vector<end_label> labels;
  for (std::size_t i = 0; i < drawn.curves.size(); ++i)
    svg << draw(drawn.curves[i], x, y, colours[i % (sizeof colours / sizeof colours[0])], labels);
  svg << draw(std::move(labels)) << "</svg>\n";
  write_file(path, svg.str());
}

}  // namespace render
