// Summary of many renderings of a scene: means, spreads and ratios, as JSON.
#pragma once

#include "runs.hpp"
#include "statistic.hpp"

#include <array>
#include <functional>
#include <optional>
#include <vector>

namespace quality {

/// An error measure of render::image_error.
struct measure {
  const char* name;
  const char* title;
  double render::image_error::*value;
  bool is_squared;  ///< the reference's noise adds to it and is subtracted
};
inline constexpr std::array<measure, 4> measures = {
    {{"mse_reinhard", "MSE after c / (1 + c)", &render::image_error::mse_reinhard, true},
     {"relmse_robust", "relative MSE without the worst 0.01%", &render::image_error::relmse_robust, true},
     {"mae", "mean absolute error", &render::image_error::mae, false},
     {"smape", "SMAPE", &render::image_error::smape, false}}};

/// Tables report a reference's noise if it is larger than this fraction of an error.
inline constexpr double large_noise_fraction = 0.1;

/// One rendering, measured.
struct measured_run {
  std::size_t method = 0, budget = 0;  ///< indices into settings
  int seed = 0;
  run_record record;
  std::filesystem::path picture;
  std::optional<double> flip;
};

/// A reference's noise in each measure.
struct reference_noise {
  render::image_error error;
  std::optional<double> flip;  ///< half of the halves' difference
};

/// An object for each budget, with one for each method: samples, seconds, segments, bytes, cones, hits of
/// lights and errors. Ratios are to the baseline, which is the method called pt, or the first. Squared errors
/// have the reference's noise subtracted. An error below the noise is null.
json summary_of(const settings& given, const std::vector<measured_run>& runs, const reference_noise& noise);

/// The index of the baseline of ratios.
std::size_t baseline_of(const std::vector<method>& methods);

/// A squared error without noise. Other errors are unchanged.
double without_noise(double error, double noise, bool is_squared);

}  // namespace quality
