// Statistics of measured renderings.
#include "summary.hpp"

#include <algorithm>
#include <cmath>

namespace quality {
namespace {

using runs_of_method = std::vector<const measured_run*>;
using value_of_run = std::function<double(const measured_run&)>;

runs_of_method select(const std::vector<measured_run>& runs, std::size_t budget, std::size_t method) {
  runs_of_method selected;
  for (const measured_run& run : runs)
    if (run.budget == budget && run.method == method) selected.push_back(&run);
  return selected;
}

statistic over(const runs_of_method& runs, const value_of_run& value) {
  std::vector<double> values;
  for (const measured_run* run : runs) values.push_back(value(*run));
  return statistic_of(values);
}

json or_null(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? json(*value) : json();
}

json to_json(const statistic& s) {
  return {{"mean", or_null(s.mean)},
          {"deviation", or_null(s.deviation)},
          {"standard_error", or_null(s.standard_error)}};
}

/// A measure of one method's runs and of the baseline's.
struct compared {
  value_of_run value;
  double noise;
  bool is_squared;
  const runs_of_method &runs, &baseline;
};

statistic error_of(const compared& c, const runs_of_method& runs) {
  statistic error = over(runs, c.value);
  error.mean = without_noise(error.mean, c.noise, c.is_squared);
  return error;
}

double seconds_of(const measured_run& run) {
  return run.record.cost.seconds;
}

json summary_of_measure(const compared& c) {
  const statistic error = error_of(c, c.runs), baseline = error_of(c, c.baseline);
  const std::optional<ratio> gain = ratio_of(baseline, error);
  json result = to_json(error);
  if (!(error.mean > 0.0)) result["mean"] = json();
  result["measured"] = or_null(over(c.runs, c.value).mean);
  result["noise"] = or_null(c.noise);
  result["noise_is_large"] = !(c.noise <= large_noise_fraction * error.mean);
  result["ratio"] = gain ? json(gain->value) : json();
  result["ratio_standard_error"] = gain ? or_null(gain->standard_error) : json();
  const std::optional<ratio> slowness = ratio_of(over(c.runs, seconds_of), over(c.baseline, seconds_of));
  if (c.is_squared && gain && slowness) result["equal_time_ratio"] = gain->value / slowness->value;
  return result;
}

json errors_of(const runs_of_method& runs, const runs_of_method& baseline, const reference_noise& noise) {
  json errors;
  for (const measure& m : measures)
    errors[m.name] =
        summary_of_measure({[&m](const measured_run& r) { return r.record.points.back().error.*m.value; },
                            noise.error.*m.value, m.is_squared, runs, baseline});
  const auto has_flip = [](const measured_run* run) { return run->flip.has_value(); };
  if (noise.flip && std::all_of(runs.begin(), runs.end(), has_flip) &&
      std::all_of(baseline.begin(), baseline.end(), has_flip))
    errors["flip"] = summary_of_measure(
        {[](const measured_run& r) { return *r.flip; }, *noise.flip, false, runs, baseline});
  return errors;
}

json summary_of_method(const runs_of_method& runs, const runs_of_method& baseline,
                       const reference_noise& noise) {
  const auto cost = [&runs](auto member) {
    return over(runs, [member](const measured_run& r) { return static_cast<double>(r.record.cost.*member); });
  };
  return {{"samples", to_json(cost(&run_cost::samples))},
          {"seconds", to_json(cost(&run_cost::seconds))},
          {"total_seconds", to_json(cost(&run_cost::total_seconds))},
          {"segments", cost(&run_cost::segments).mean},
          {"persistent_bytes", cost(&run_cost::persistent_bytes).mean},
          {"used_bytes", cost(&run_cost::used_bytes).mean},
          {"transient_bytes", cost(&run_cost::transient_bytes).mean},
          {"cones_per_segment", cost(&run_cost::cones_per_segment).mean},
          {"light_hits_per_path", cost(&run_cost::light_hits_per_path).mean},
          {"worst_share",
           over(runs, [](const measured_run& r) { return r.record.points.back().error.worst_share; }).mean},
          {"non_finite_pixels",
           over(runs, [](const measured_run& r) { return double(r.record.points.back().error.non_finite); })
               .mean},
          {"errors", errors_of(runs, baseline, noise)}};
}

}  // namespace

std::size_t baseline_of(const std::vector<method>& methods) {
  for (std::size_t m = 0; m < methods.size(); ++m)
    if (methods[m].name == "pt") return m;
  return 0;
}

double without_noise(double error, double noise, bool is_squared) {
  return is_squared ? error - noise : error;
}

json summary_of(const settings& given, const std::vector<measured_run>& runs, const reference_noise& noise) {
  json result = json::array();
  for (std::size_t b = 0; b < given.budgets.size(); ++b) {
    const runs_of_method baseline = select(runs, b, baseline_of(given.methods));
    json methods = json::array();
    for (std::size_t m = 0; m < given.methods.size(); ++m) {
      json object{{"method", given.methods[m].name}};
      object.update(summary_of_method(select(runs, b, m), baseline, noise));
      methods.push_back(object);
    }
    result.push_back({{"budget", title_of(given.budgets[b])}, {"methods", methods}});
  }
  return result;
}

}  // namespace quality
