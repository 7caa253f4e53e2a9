// Maps values to colours, and draws the bar that explains them.
#pragma once

#include "app/image_io.hpp"

#include <string>
#include <vector>

namespace inspect {

using render::vec3;

/// Heat colours over a range of values, by value or by its logarithm.
class colour_scale {
 public:
  /// Five powers of ten. The last is at or above `greatest`, or 1 if that is not positive and finite.
  static colour_scale logarithmic(double greatest, std::string unit);
  /// From 0 to `last` > 0, with a label at each whole number.
  static colour_scale whole_numbers(int last, std::string unit);

  vec3 colour(double value) const;
  /// A picture's luminances as colours.
  render::image colours(const render::image& values) const;

  /// The unit of the values.
  const std::string& unit() const { return unit_; }
  /// Labels evenly spaced along the bar, including both ends.
  const std::vector<std::string>& labels() const { return labels_; }
  /// The bar from least to greatest, from left to right.
  render::image bar() const;

 private:
  colour_scale(double low, double high, bool is_logarithmic, std::string unit)
      : low_(low), high_(high), is_logarithmic_(is_logarithmic), unit_(std::move(unit)) {}

  double low_, high_;  ///< of the value, or of its logarithm to base 10
  bool is_logarithmic_;
  std::string unit_;
  std::vector<std::string> labels_;
};

}  // namespace inspect
