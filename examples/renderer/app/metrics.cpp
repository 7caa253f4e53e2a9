// Error measures, accumulated in double pixel by pixel.
#include "app/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

namespace render {
namespace {

constexpr double relative_floor = 1e-2;
constexpr double trimmed_fraction = 1e-3;
constexpr double robust_fraction = 1e-4;

/// One pixel's measures, means over its channels.
struct pixel_error {
  double squared = 0.0;
  double relative = 0.0;
  double reinhard = 0.0;
  double absolute = 0.0;
  double symmetric = 0.0;
};

bool finite(vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

double reinhard(double value) {
  const double positive = std::max(value, 0.0);
  return positive / (1.0 + positive);
}

pixel_error error_of(vec3 test, vec3 reference) {
  pixel_error sum;
  for (int c = 0; c < 3; ++c) {
    const double t = test[c], r = reference[c];
    const double mapped = reinhard(t) - reinhard(r);
    sum.squared += (t - r) * (t - r) / 3.0;
    sum.relative += (t - r) * (t - r) / (r * r + relative_floor) / 3.0;
    sum.reinhard += mapped * mapped / 3.0;
    sum.absolute += std::abs(t - r) / 3.0;
    sum.symmetric += std::abs(t - r) / (std::abs(t) + std::abs(r) + relative_floor) / 3.0;
  }
  return sum;
}

pixel_error error_where_finite(vec3 test, vec3 reference) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  if (finite(test) && finite(reference)) return error_of(test, reference);
  return {infinite, infinite, infinite, infinite, infinite};
}

/// The mean without the largest `fraction` of the values. Reorders them.
double trimmed_mean(std::vector<double>& values, double fraction) {
  const auto dropped = static_cast<std::size_t>(fraction * static_cast<double>(values.size()));
  const auto first_kept = values.begin() + static_cast<std::ptrdiff_t>(dropped);
  std::nth_element(values.begin(), first_kept, values.end(), std::greater<double>());
  double sum = 0.0;
  for (auto value = first_kept; value != values.end(); ++value) sum += *value;
  return sum / static_cast<double>(values.size() - dropped);
}

/// Sums relative errors of pixels. Reorders them.
void add_relative(std::vector<double>& relative, image_error& error) {
  const double count = static_cast<double>(relative.size());
  const double sum = std::accumulate(relative.begin(), relative.end(), 0.0);
  error.relmse = sum / count;
  error.relmse_trimmed = trimmed_mean(relative, trimmed_fraction);
  error.relmse_robust = trimmed_mean(relative, robust_fraction);
  if (std::isinf(sum)) {
    error.worst_share = 1.0;
  } else if (sum > 0.0) {
    const double kept = error.relmse_robust * (count - std::floor(robust_fraction * count));
    error.worst_share = std::max(0.0, 1.0 - kept / sum);
  }
}

std::string size_of(const image& picture) {
  return std::to_string(picture.width) + " x " + std::to_string(picture.height);
}

void require_comparable(const image& test, const image& reference) {
  if (test.width != reference.width || test.height != reference.height)
    throw std::invalid_argument("pictures of different sizes: " + size_of(test) + " and " +
                                size_of(reference));
  const std::size_t pixels = std::size_t(std::max(test.width, 0)) * std::size_t(std::max(test.height, 0));
  if (pixels == 0 || test.pixels.size() != pixels || reference.pixels.size() != pixels)
    throw std::invalid_argument("a picture is empty or its size does not match its pixels");
}

}  // namespace

image_error compare(const image& test, const image& reference) {
  require_comparable(test, reference);
  image_error error;
  std::vector<double> relative;
  relative.reserve(test.pixels.size());
  for (std::size_t i = 0; i < test.pixels.size(); ++i) {
    const pixel_error pixel = error_where_finite(test.pixels[i], reference.pixels[i]);
    if (!finite(test.pixels[i]) || !finite(reference.pixels[i])) ++error.non_finite;
    error.mse += pixel.squared;
    error.mse_reinhard += pixel.reinhard;
    error.mae += pixel.absolute;
    error.smape += pixel.symmetric;
    relative.push_back(pixel.relative);
  }
  const double count = static_cast<double>(test.pixels.size());
  error.mse /= count;
  error.mse_reinhard /= count;
  error.mae /= count;
  error.smape /= count;
  add_relative(relative, error);
  return error;
}

std::vector<double> reinhard_errors(const image& test, const image& reference) {
  require_comparable(test, reference);
  std::vector<double> errors;
  errors.reserve(test.pixels.size());
  for (std::size_t i = 0; i < test.pixels.size(); ++i)
    errors.push_back(error_where_finite(test.pixels[i], reference.pixels[i]).reinhard);
  return errors;
}

image_error noise_of_halves(const image& half_a, const image& half_b) {
  require_comparable(half_a, half_b);
  image mean = half_a;
  for (std::size_t i = 0; i < mean.pixels.size(); ++i)
    mean.pixels[i] = 0.5f * (half_a.pixels[i] + half_b.pixels[i]);
  image_error error = compare(half_a, mean);
  const image_error other = compare(half_b, mean);
  for (double image_error::*const value :
       {&image_error::mse, &image_error::relmse, &image_error::relmse_trimmed, &image_error::relmse_robust,
        &image_error::mse_reinhard, &image_error::mae, &image_error::smape})
    error.*value = 0.5 * (error.*value + other.*value);
  return error;
}

image read_reference(const std::string& path, int width, int height) {
  const auto size_name = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h); };
  image reference = read_exr(path);
  if (reference.width != width || reference.height != height)
    throw std::invalid_argument("--reference: " + path + " has " +
                                size_name(reference.width, reference.height) +
                                " pixels, the picture will have " + size_name(width, height));
  return reference;
}

}  // namespace render
