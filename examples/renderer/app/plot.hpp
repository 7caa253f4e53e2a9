// Plots of curves on logarithmic axes, as SVG.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace render {

struct curve {
  std::string name;
  std::vector<std::pair<double, double>> points;  ///< both positive and finite; others are left out
};

struct plot {
  std::string title, x_label, y_label;
  std::vector<curve> curves;
};

/// Throws std::runtime_error that names the path.
void write_svg(const std::string& path, const plot& drawn);

}  // namespace render
