// Mixtures with and without products behind one interface, and their statistics.
#include "pixel_sampler.hpp"

#include "tracer/rng.hpp"

#include <wfpg/testing/sphere_statistics.hpp>

#include <algorithm>

namespace inspect {
namespace {

constexpr float least_cosine = 1e-3f;
constexpr std::size_t tested = 100000;  // samples of the chi² test, and as many hints

}  // namespace

pixel_sampler::pixel_sampler(const wfpg::guide_view& view, std::uint32_t ray, const render_surface& at)
    : surface_(at), plain_(view.mixture(ray)), draws_product_(view.product_resolution() > 0) {
  if (draws_product_) product_ = view.product(ray, surface_, words_);
}

wfpg::mixture_fractions pixel_sampler::fractions() const {
  if (plain_.field.empty()) return {};
  return draws_product_ ? product_.fractions_of(surface_) : plain_.fractions_of(surface_);
}

wfpg::sampled_direction pixel_sampler::sample(float u_technique, vec2 u) const {
  return draws_product_ ? product_.sample(surface_, u_technique, u) : plain_.sample(surface_, u_technique, u);
}

float pixel_sampler::pdf(vec3 direction) const {
  return draws_product_ ? product_.pdf(surface_, direction) : plain_.pdf(surface_, direction);
}

double pixel_sampler::beside_field(vec3 direction) const {
  const float value = surface_.bsdf.eval(surface_.outgoing, direction);
  if (!plain_.field.hemisphere()) return value;
  return value / std::max(glm::dot(direction, plain_.field.normal()), least_cosine);
}

double chi_square_p(const pixel_sampler& sampler, const std::vector<vec3>& directions,
                    const std::vector<vec3>& hints) {
  if (directions.empty()) return 1.0;
  const auto densities = [&sampler](const std::vector<vec3>& at) {
    std::vector<float> values;
    for (const vec3 direction : at) values.push_back(sampler.pdf(direction));
    return values;
  };
  const wfpg::testing::sphere_bins bins(wfpg::frame(sampler.surface().normal), densities,
                                        static_cast<double>(directions.size()), hints);
  return wfpg::testing::test_directions(bins, directions).p;
}

sample_counts count_samples(const pixel_sampler& sampler, const direction_grid& grid, int samples) {
  const render::random_stream random{0x1a5bec7, 0};
  const vec3 up = wfpg::facing_normal(sampler.surface());
  sample_counts counts;
  counts.density.assign(grid.size(), 0.0);
  std::vector<vec3> directions, hints;
  const double fraction_of_one = 1.0 / samples;
  for (int i = 0; i < samples; ++i) {
    const auto path = static_cast<std::uint32_t>(i);
    const wfpg::sampled_direction drawn = sampler.sample(random(path, 0).x, random(path, 1));
    if (!(drawn.pdf > 0.0f)) {
      counts.failed += fraction_of_one;
      continue;
    }
    std::vector<vec3>& kept = i % 2 == 0 ? directions : hints;
    if (kept.size() < tested) kept.push_back(drawn.direction);
    if (glm::dot(drawn.direction, up) < 0.0f) counts.below += fraction_of_one;
    if (const auto cell = grid.cell_of(drawn.direction))
      counts.density[*cell] += fraction_of_one / double(grid.solid_angle());
    else
      counts.outside += fraction_of_one;
  }
  counts.p = chi_square_p(sampler, directions, hints);
  return counts;
}

}  // namespace inspect
