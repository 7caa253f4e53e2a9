// Differences of pictures after each sample.
#include "single_samples.hpp"

#include "app/option_names.hpp"
#include "summary.hpp"

#include <limits>

namespace quality {
namespace {

using pixels = std::vector<glm::dvec3>;

/// The pictures of single samples 1, 2, ... Computed from pictures after each sample, in which all have equal
/// weight.
std::vector<render::image> render_alone(const render::scene& scene, render::render_options options,
                                        wfpg::sample_combination combination) {
  options.combine = combination;
  options.checkpoints = render::checkpoint_times::all;
  std::vector<render::image> pictures;
  for (render::checkpoint& at : render::render(scene, options, {}).checkpoints)
    pictures.push_back(std::move(at.picture));
  for (std::size_t k = pictures.size() - 1; k > 0; --k)
    for (std::size_t i = 0; i < pictures[k].pixels.size(); ++i)
      pictures[k].pixels[i] = render::vec3(double(k + 1) * glm::dvec3(pictures[k].pixels[i]) -
                                           double(k) * glm::dvec3(pictures[k - 1].pixels[i]));
  return pictures;
}

void append(error_series& series, const render::image& picture, const render::image& reference) {
  const render::image_error error = render::compare(picture, reference);
  for (const measure& m : measures) series.by_measure[m.name].push_back(error.*m.value);
}

/// Errors of the picture after each sample. Infinite while no sample has weight.
error_series combine(const std::vector<render::image>& alone, wfpg::sample_combination combination,
                     const render::image& reference) {
  error_series series;
  pixels sums(reference.pixels.size(), glm::dvec3(0.0));
  double weights = 0.0;
  render::image picture = reference;
  for (std::size_t k = 0; k < alone.size(); ++k) {
    const double weight = wfpg::sample_weight(combination, static_cast<std::uint32_t>(k + 1));
    weights += weight;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] += weight * glm::dvec3(alone[k].pixels[i]);
      picture.pixels[i] = weights > 0.0 ? render::vec3(sums[i] / weights)
                                        : render::vec3(std::numeric_limits<float>::infinity());
    }
    append(series, picture, reference);
  }
  return series;
}

json to_json(const error_series& series) {
  json object;
  for (const auto& [name, errors] : series.by_measure) object[name] = errors;
  return object;
}

error_series series_from_json(const json& object) {
  error_series series;
  for (const measure& m : measures)
    for (const json& error : object.at(m.name))
      series.by_measure[m.name].push_back(error.is_null() ? std::numeric_limits<double>::infinity()
                                                          : error.get<double>());
  return series;
}

void add(error_series& sum, const error_series& added, double factor) {
  for (const auto& [name, errors] : added.by_measure) {
    std::vector<double>& sums = sum.by_measure[name];
    sums.resize(errors.size(), 0.0);
    for (std::size_t i = 0; i < errors.size(); ++i) sums[i] += factor * errors[i];
  }
}

}  // namespace

json to_json(const single_samples& samples) {
  json combined = json::object();
  for (const auto& [name, series] : samples.combined) combined[name] = to_json(series);
  return {{"alone", to_json(samples.alone)}, {"combined", combined}};
}

single_samples single_samples_from_json(const json& object) {
  single_samples samples{series_from_json(object.at("alone")), {}};
  for (const auto& [name, series] : object.at("combined").items())
    samples.combined[name] = series_from_json(series);
  return samples;
}

planned_run plan_single_samples(const scene_choice& scene, const std::string& identity, const method& sampled,
                                int samples, int seed, const std::string& reference_hash) {
  planned_run run = plan_run(scene, identity, sampled, {samples, 0.0}, seed, reference_hash);
  run.title = scene.title + ", " + sampled.name + ", each of " + title_of(budget{samples, 0.0}) + ", seed " +
              std::to_string(seed);
  run.rate += ", each";
  run.key.label += "-each";
  run.key.content["each_sample"] = true;
  return run;
}

single_samples measure_single_samples(const render::scene& scene, const render::render_options& options,
                                      const render::image& reference) {
  using wfpg::sample_combination;
  single_samples result;
  const std::vector<render::image> guided = render_alone(scene, options, sample_combination::constant);
  for (const render::image& picture : guided) append(result.alone, picture, reference);
  if (options.method == render::sampling_method::pt) return result;
  const std::vector<render::image> first_unguided =
      render_alone(scene, options, sample_combination::pt_first);
  for (const auto& [name, combination] : render::combination_names())
    if (combination != sample_combination::inverse_variance)  // the guide alone knows its weights
      result.combined[name] =
          combine(wfpg::unguided_samples(combination) > 0 ? first_unguided : guided, combination, reference);
  return result;
}

single_samples mean_of(const std::vector<single_samples>& seeds) {
  single_samples mean;
  const double factor = 1.0 / static_cast<double>(seeds.size());
  for (const single_samples& seed : seeds) {
    add(mean.alone, seed.alone, factor);
    for (const auto& [name, series] : seed.combined) add(mean.combined[name], series, factor);
  }
  return mean;
}

}  // namespace quality
