// Maps over cells, and integrals of them.
#include "findings.hpp"

#include "measures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inspect {
namespace {

constexpr int points = 4;       // of a mean over a cell, along a side
constexpr int fine_points = 2;  // over a cell of the reference
constexpr double none = std::numeric_limits<double>::quiet_NaN();

using map = std::vector<double>;

map times(map a, const map& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] *= b[i];
  return a;
}

/// Values per steradian, scaled to integrate to 1.
map density(map values, const direction_grid& cells) {
  values = normalised(std::move(values));
  for (double& value : values) value /= double(cells.solid_angle());
  return values;
}

map luminances(const render::image& picture) {
  map values;
  for (const vec3& pixel : picture.pixels) values.push_back(wfpg::luminance(pixel));
  return values;
}

direction_grid cells_of(const pixel_sampler& sampler, const finding_options& options) {
  if (!sampler.field().empty()) return direction_grid(sampler.field());
  const render_surface& at = sampler.surface();
  if (at.bsdf.transmits()) return direction_grid(options.field_resolution);
  return {options.field_resolution, wfpg::facing_normal(at)};
}

/// The cosine that the field includes.
double cosine_of_field(const pixel_sampler& sampler, vec3 direction) {
  const wfpg::directional_field& field = sampler.field();
  return field.hemisphere() ? std::max(glm::dot(direction, field.normal()), 0.0f) : 1.0f;
}

double eval(const pixel_sampler& sampler, vec3 direction) {
  return sampler.surface().bsdf.eval(sampler.surface().outgoing, direction);
}

/// Both halves of the light as luminances on the fine cells. Their product is an unbiased square.
struct light_maps {
  map first, second, mean;

  explicit light_maps(const incident_light& light)
      : first(luminances(light.first)), second(luminances(light.second)), mean(luminances(light.mean())) {}
};

/// Relative standard deviation of a sampler with density `pdf(fine cell, direction)`.
template <class Pdf>
double relative_deviation(const pixel_sampler& sampler, const direction_grid& fine, const light_maps& light,
                          const Pdf& pdf) {
  double sum = 0.0, squares = 0.0;
  for (std::size_t cell = 0; cell < fine.size(); ++cell) {
    for (int i = 0; i < fine_points * fine_points; ++i) {
      const vec2 at(float(i % fine_points) + 0.5f, float(i / fine_points) + 0.5f);
      const vec3 direction = fine.direction(cell, at / float(fine_points));
      const double value = eval(sampler, direction);
      if (!(value > 0.0)) continue;
      sum += value * light.mean[cell];
      squares += value * value * light.first[cell] * light.second[cell] / pdf(cell, direction);
    }
  }
  const double weight = double(fine.solid_angle()) / double(fine_points * fine_points);
  sum *= weight;
  return sum > 0.0 ? std::sqrt(std::max(squares * weight / (sum * sum) - 1.0, 0.0)) : none;
}

predicted_noise predict(const pixel_sampler& sampler, const findings& found, const light_maps& light) {
  const direction_grid& fine = found.fine_cells;
  const render_surface& at = sampler.surface();
  predicted_noise noise;
  noise.bsdf = relative_deviation(sampler, fine, light, [&](std::size_t, vec3 direction) {
    return double(at.bsdf.pdf(at.outgoing, direction));
  });
  noise.sampler = relative_deviation(
      sampler, fine, light, [&](std::size_t, vec3 direction) { return double(sampler.pdf(direction)); });
  return noise;
}

/// A sample's contribution in each fine cell over the mean of all samples.
map contributions_of(const pixel_sampler& sampler, const findings& found, const light_maps& light,
                     const map& bsdf_values) {
  map values = times(cell_means(found.fine_cells, fine_points,
                                [&](vec3 direction) {
                                  const double value = eval(sampler, direction);
                                  return value > 0.0 ? value / sampler.pdf(direction) : 0.0;
                                }),
                     light.mean);
  const map whole = times(bsdf_values, light.mean);
  double sum = 0.0;
  for (const double value : whole) sum += value * double(found.fine_cells.solid_angle());
  if (sum > 0.0)
    for (double& value : values) value /= sum;
  return values;
}

/// Compares the field with the reference, and estimates what the reference's own noise adds.
void compare(const map& cosines, const light_maps& light, int refinement, findings& found) {
  const auto half = [&](const map& of) { return normalised(coarsened(times(cosines, of), refinement)); };
  const map mean = half(light.mean);
  found.divergence_noise =
      0.5 * (kl_divergence(half(light.first), mean) + kl_divergence(half(light.second), mean));
  found.correlation = found.divergence = none;
  if (found.field.empty()) return;
  found.correlation = correlation(found.field, found.reference);
  found.divergence = kl_divergence(normalised(found.reference), normalised(found.field));
}

}  // namespace

findings find(const learnt_scene& learnt, std::uint32_t pixel, const finding_options& options,
              const render::progress_callback& progress) {
  const render::hit_surface& hit = learnt.hits()[pixel];
  const pixel_sampler sampler(learnt.fields(), pixel, hit.surface);
  findings found;
  found.cells = cells_of(sampler, options);
  const int refinement = std::max(1, (options.reference_cells - 1) / found.cells.resolution() + 1);
  found.fine_cells = found.cells.refined(refinement);
  const incident_light arriving = learnt.arriving(hit, found.fine_cells, options.reference_spp, progress);
  const light_maps light(arriving);
  found.arriving = arriving.mean();

  const auto over_fine = [&](const auto& f) { return cell_means(found.fine_cells, fine_points, f); };
  const map cosines = over_fine([&](vec3 d) { return cosine_of_field(sampler, d); });
  const map values = over_fine([&](vec3 d) { return eval(sampler, d); });
  found.reference = density(coarsened(times(cosines, light.mean), refinement), found.cells);
  found.ideal = density(coarsened(times(values, light.mean), refinement), found.cells);
  if (!sampler.field().empty()) {
    found.field = cell_means(found.cells, 1, [&](vec3 d) { return sampler.field().pdf(d); });
    found.product = density(
        times(found.field, cell_means(found.cells, points, [&](vec3 d) { return sampler.beside_field(d); })),
        found.cells);
  }
  found.sampler = cell_means(found.cells, 2 * points, [&](vec3 d) { return sampler.pdf(d); });
  found.counted = count_samples(sampler, found.cells, options.histogram);
  found.contributions = contributions_of(sampler, found, light, values);
  found.noise = predict(sampler, found, light);
  compare(cosines, light, refinement, found);
  return found;
}

}  // namespace inspect
