// Which colour stands for which value, and the bar that says so.
#pragma once

#include "app/image_io.hpp"

#include <string>
#include <vector>

namespace inspect {

using render::vec3;

/// Heat colours over a range of values, by value or by its logarithm.
class colour_scale {
 public:
  /// The five powers of ten that end at or above `greatest`; at 1 where that is not positive and finite.
  static colour_scale logarithmic(double greatest, std::string unit);
  /// From 0 to `last` > 0, each whole number named.
  static colour_scale whole_numbers(int last, std::string unit);

  vec3 colour(double value) const;
  /// A picture's luminances as colours.
  render::image colours(const render::image& values) const;

  /// Of what is shown.
  const std::string& unit() const { return unit_; }
  /// Evenly spaced along the bar, both ends among them.
  const std::vector<std::string>& labels() const { return labels_; }
  /// Least to greatest, from left to right.
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
