// What draws a pixel's next directions: its field, or the product of that with its BSDF, and its BSDF.
#pragma once

#include "directions.hpp"
#include "scene/device_scene.hpp"

#include <wfpg/guides/octree/guide_view.hpp>

#include <cstdint>
#include <vector>

namespace inspect {

using render_surface = wfpg::surface<render::bsdf>;

/// The mixture of one ray, as the renderer draws from it. The view's guider stays as it is meanwhile.
class pixel_sampler {
 public:
  pixel_sampler(const wfpg::guide_view& view, std::uint32_t ray, const render_surface& at);
  pixel_sampler(const pixel_sampler&) = delete;  // its product reads its words
  pixel_sampler& operator=(const pixel_sampler&) = delete;

  const render_surface& surface() const { return surface_; }
  /// Empty where the ray has none.
  const wfpg::directional_field& field() const { return plain_.field; }
  /// Of guided samples, before glossy parts take theirs; 0 without a field.
  float fraction() const { return plain_.fraction; }
  /// What of the samples each part draws.
  wfpg::mixture_fractions shares() const;

  /// As basic_guide_mixture has them.
  wfpg::sampled_direction sample(float u_technique, vec2 u) const;
  float pdf(vec3 direction) const;

  /// The BSDF's value at a direction over the cosine that the field has in it already.
  double beside_field(vec3 direction) const;

 private:
  render_surface surface_;
  wfpg::guide_mixture plain_;
  wfpg::product_mixture product_;
  bool draws_product_;
  std::uint32_t words_[wfpg::max_product_words];
};

/// Samples of a mixture, counted.
struct sample_counts {
  std::vector<double> density;  ///< a cell: samples over their number and the cell's solid angle
  double below = 0.0;           ///< share of directions below the shading normal's horizon
  double outside = 0.0;         ///< share of directions that lie in no cell
  double failed = 0.0;          ///< share of samples without a direction
  double p =
      1.0;  ///< of a chi² test against pdf(): small where they disagree; of another half of the samples
};

/// Counts `samples` > 0 samples in cells. The same every time.
sample_counts count_samples(const pixel_sampler& sampler, const direction_grid& grid, int samples);

/// The p of a chi² test of directions against a sampler's pdf(), in shape: samples may fail. `hints`: others
/// of the same source, that tell where it is dense.
double chi_square_p(const pixel_sampler& sampler, const std::vector<vec3>& directions,
                    const std::vector<vec3>& hints);

/// Means over each cell of `f(direction) -> double`, at `points` x `points` places.
template <class F>
std::vector<double> cell_means(const direction_grid& grid, int points, const F& f) {
  std::vector<double> means(grid.size(), 0.0);
  for (std::size_t cell = 0; cell < means.size(); ++cell)
    for (int i = 0; i < points * points; ++i) {
      const vec2 at(float(i % points) + 0.5f, float(i / points) + 0.5f);
      means[cell] += double(f(grid.direction(cell, at / float(points)))) / double(points * points);
    }
  return means;
}

}  // namespace inspect
