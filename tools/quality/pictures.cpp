// Crops and colours of pictures.
#include "pictures.hpp"

#include "app/colour_map.hpp"

#include <wfpg/base/types.hpp>

#include <algorithm>
#include <cmath>

namespace quality {
namespace {

using render::vec3;

constexpr float middle = 0.25f;  // about half of sRGB's range
constexpr double shown_fraction = 0.99;
constexpr int least_crop = 24;

double percentile(std::vector<double> values, double fraction) {
  const auto at = values.begin() + std::ptrdiff_t(fraction * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Sums over the rectangles from the upper left corner. The first row and column are zeros.
std::vector<double> summed_area(const std::vector<double>& errors, int width, int height) {
  double greatest = 0.0;
  for (const double e : errors)
    if (std::isfinite(e)) greatest = std::max(greatest, e);
  const std::size_t stride = std::size_t(width) + 1;
  std::vector<double> sums(stride * (std::size_t(height) + 1), 0.0);
  for (std::size_t y = 0; y < std::size_t(height); ++y)
    for (std::size_t x = 0; x < std::size_t(width); ++x) {
      const double error = errors[y * std::size_t(width) + x];
      sums[(y + 1) * stride + x + 1] = (std::isfinite(error) ? error : greatest) + sums[y * stride + x + 1] +
                                       sums[(y + 1) * stride + x] - sums[y * stride + x];
    }
  return sums;
}

}  // namespace

float exposure_for(const render::image& reference) {
  std::vector<double> luminances;
  for (const vec3& pixel : reference.pixels) {
    const double luminance = wfpg::luminance(pixel);
    if (luminance > 0.0 && std::isfinite(luminance)) luminances.push_back(luminance);
  }
  return luminances.empty() ? 1.0f : middle / float(percentile(std::move(luminances), 0.5));
}

window worst_window(const std::vector<double>& errors, int width, int height) {
  const int w = std::min(width, std::max(least_crop, width / 4));
  const int h = std::min(height, std::max(least_crop, height / 4));
  const std::vector<double> sums = summed_area(errors, width, height);
  const auto sum = [&](int x, int y) {
    return sums[std::size_t(y) * (std::size_t(width) + 1) + std::size_t(x)];
  };
  window worst{0, 0, w, h};
  double most = -1.0;
  for (int y = 0; y + h <= height; ++y)
    for (int x = 0; x + w <= width; ++x) {
      const double inside = sum(x + w, y + h) - sum(x, y + h) - sum(x + w, y) + sum(x, y);
      if (inside <= most) continue;
      most = inside;
      worst.left = x;
      worst.top = y;
    }
  return worst;
}

render::image error_map(const std::vector<double>& errors, int width, int height, double greatest) {
  render::image map = render::make_image(width, height);
  for (std::size_t i = 0; i < map.pixels.size(); ++i)
    map.pixels[i] =
        render::heat_colour(std::isfinite(errors[i]) ? std::sqrt(float(errors[i] / greatest)) : 1.0f);
  return map;
}

double shown_greatest(const std::vector<double>& errors) {
  std::vector<double> positive;
  for (const double e : errors)
    if (e > 0.0 && std::isfinite(e)) positive.push_back(e);
  return positive.empty() ? 1.0 : percentile(std::move(positive), shown_fraction);
}

render::image framed(render::image picture, const window& at, float exposure) {
  const vec3 yellow = vec3(1.0f, 0.8f, 0.0f) / exposure;
  const auto pixel = [&](int x, int y) -> vec3& {
    return picture.pixels[std::size_t(y) * std::size_t(picture.width) + std::size_t(x)];
  };
  for (int x = at.left; x < at.left + at.width; ++x)
    pixel(x, at.top) = pixel(x, at.top + at.height - 1) = yellow;
  for (int y = at.top; y < at.top + at.height; ++y)
    pixel(at.left, y) = pixel(at.left + at.width - 1, y) = yellow;
  return picture;
}

render::image enlarged_to(const render::image& picture, int least) {
  const int side = std::max(picture.width, picture.height);
  return render::enlarged(picture, std::max(1, (least + side - 1) / side));
}

}  // namespace quality
