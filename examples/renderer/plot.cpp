// SVG by hand: a frame, decades as grid lines, curves with their names at their ends.
#include "plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace render {
namespace {

constexpr double width = 640.0, height = 420.0;                          // pixels
constexpr double left = 80.0, right = 120.0, top = 40.0, bottom = 55.0;  // margins
constexpr const char* colours[] = {"#777777", "#d95f02", "#1b6ca8", "#2a9d5c",
                                   "#8e44ad", "#b8860b", "#c0392b"};

bool is_drawn(const std::pair<double, double>& point) {
  return point.first > 0.0 && point.second > 0.0;
}

/// The decades around some values, and where a value lies between them.
struct log_axis {
  double low = 0.0, high = 1.0;  // powers of ten
  double begin, end;             // pixels

  double position(double value) const {
    return begin + (std::log10(value) - low) / (high - low) * (end - begin);
  }
};

log_axis make_axis(const std::vector<double>& values, double begin, double end) {
  log_axis axis{0.0, 1.0, begin, end};
  if (values.empty()) return axis;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  axis.low = std::floor(std::log10(*least));
  axis.high = std::max(std::ceil(std::log10(*most)), axis.low + 1.0);
  return axis;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return result;
}

std::string line(double x0, double y0, double x1, double y1) {
  return "<line x1='" + number(x0) + "' y1='" + number(y0) + "' x2='" + number(x1) + "' y2='" + number(y1) +
         "'/>\n";
}

std::string label(double x, double y, const std::string& text, const std::string& attributes = "") {
  return "<text x='" + number(x) + "' y='" + number(y) + "' " + attributes + ">" + escaped(text) +
         "</text>\n";
}

/// Lines at 1, 2, ... 9 times each power of ten, and the powers' names.
std::string grid(const log_axis& axis, bool vertical) {
  std::string result;
  for (double power = axis.low; power <= axis.high; power += 1.0) {
    for (int digit = 1; digit < 10 && (digit == 1 || power < axis.high); ++digit) {
      const double at = axis.position(digit * std::pow(10.0, power));
      const char* colour = digit == 1 ? "<g stroke='#bbb'>" : "<g stroke='#eee'>";
      result += colour + (vertical ? line(at, top, at, height - bottom) : line(left, at, width - right, at)) +
                "</g>";
    }
    char name[32];
    std::snprintf(name, sizeof name, "%g", std::pow(10.0, power));
    const double at = axis.position(std::pow(10.0, power));
    result += vertical ? label(at, height - bottom + 18.0, name, "text-anchor='middle'")
                       : label(left - 8.0, at + 4.0, name, "text-anchor='end'");
  }
  return result;
}

std::string draw(const curve& drawn, const log_axis& x, const log_axis& y, const std::string& colour) {
  std::string points, dots, name;
  for (const auto& point : drawn.points) {
    if (!is_drawn(point)) continue;
    const double px = x.position(point.first), py = y.position(point.second);
    points += number(px) + "," + number(py) + " ";
    dots += "<circle cx='" + number(px) + "' cy='" + number(py) + "' r='3' fill='" + colour + "'/>\n";
    name = label(px + 8.0, py + 4.0, drawn.name, "fill='" + colour + "'");
  }
  return "<polyline fill='none' stroke-width='2' stroke='" + colour + "' points='" + points + "'/>\n" + dots +
         name;
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
  const log_axis x = make_axis(xs, left, width - right);
  const log_axis y = make_axis(ys, height - bottom, top);
  std::ofstream file(path);
  file << "<svg xmlns='http://www.w3.org/2000/svg' width='" << width << "' height='" << height
       << "' font-family='sans-serif' font-size='13'>\n<rect width='100%' height='100%' fill='white'/>\n"
       << grid(x, true) << grid(y, false)
       << label(left, top - 15.0, drawn.title, "font-size='15' font-weight='bold'")
       << label((left + width - right) / 2.0, height - 15.0, drawn.x_label, "text-anchor='middle'")
       << label(0.0, 0.0, drawn.y_label,
                "text-anchor='middle' transform='translate(18 " + number((top + height - bottom) / 2.0) +
                    ") rotate(-90)'");
  for (std::size_t i = 0; i < drawn.curves.size(); ++i)
    file << draw(drawn.curves[i], x, y, colours[i % (sizeof colours / sizeof colours[0])]);
  file << "</svg>\n";
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace render
