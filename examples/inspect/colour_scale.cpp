// Scales of powers of ten and of whole numbers.
#include "colour_scale.hpp"

#include "app/colour_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace inspect {
namespace {

constexpr int decades = 4;
constexpr int bar_width = 512, bar_height = 12;

}  // namespace

colour_scale colour_scale::logarithmic(double greatest, std::string unit) {
  const bool is_usable = greatest > 0.0 && std::isfinite(greatest);
  const double high = is_usable ? std::ceil(std::log10(greatest) - 1e-6) : 0.0;
  colour_scale scale(high - decades, high, true, std::move(unit));
  for (int i = 0; i <= decades; ++i) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", std::pow(10.0, high - decades + i));
    scale.labels_.emplace_back(text);
  }
  return scale;
}

colour_scale colour_scale::whole_numbers(int last, std::string unit) {
  colour_scale scale(0.0, last, false, std::move(unit));
  for (int i = 0; i <= last; ++i) scale.labels_.push_back(std::to_string(i));
  return scale;
}

vec3 colour_scale::colour(double value) const {
  if (is_logarithmic_ && !(value > 0.0)) return render::heat_colour(0.0f);
  const double at = is_logarithmic_ ? std::log10(value) : value;
  return render::heat_colour(static_cast<float>((at - low_) / (high_ - low_)));
}

render::image colour_scale::colours(const render::image& values) const {
  render::image picture = values;
  for (vec3& pixel : picture.pixels) pixel = colour(wfpg::luminance(pixel));
  return picture;
}

render::image colour_scale::bar() const {
  render::image picture = render::make_image(bar_width, bar_height);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    picture.pixels[i] = render::heat_colour(float(i % bar_width) / float(bar_width - 1));
  return picture;
}

}  // namespace inspect
