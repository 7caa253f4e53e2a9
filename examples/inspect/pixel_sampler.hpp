// The sampler of a pixel's next directions. It mixes its field, or the product of field and BSDF, with its
// BSDF.
#pragma once

#include "directions.hpp"
#include "scene/device_scene.hpp"

#include <wfpg/guides/octree/guide_view.hpp>

#include <cstdint>
#include <vector>

namespace inspect {

using render_surface = wfpg::surface<render::bsdf>;

/// The mixture of one ray, as the renderer samples it. The view's guider must not change meanwhile.
class pixel_sampler {
 public:
  pixel_sampler(const wfpg::guide_view& view, std::uint32_t ray, const render_surface& at);
  pixel_sampler(const pixel_sampler&) = delete;  // its product reads its words
  pixel_sampler& operator=(const pixel_sampler&) = delete;

  const render_surface& surface() const { return surface_; }
  /// Empty if the ray has none.
  const wfpg::directional_field& field() const { return plain_.field; }
  /// The fraction of guided samples, without that of glossy parts. 0 without a field.
  float fraction() const { return plain_.fraction; }
  /// The fractions of samples that each part gets.
  wfpg::mixture_fractions fractions() const;

  /// Samples and evaluates as basic_guide_mixture does.
  wfpg::sampled_direction sample(float u_technique, vec2 u) const;
  float pdf(vec3 direction) const;

  /// The BSDF's value at a direction, without the cosine that the field includes.
  double beside_field(vec3 direction) const;

 private:
  render_surface surface_;
  wfpg::guide_mixture plain_;
  wfpg::product_mixture product_;
  bool draws_product_;
  std::uint32_t words_[wfpg::max_product_words];
};

/// Counted samples of a mixture.
struct sample_counts {
  std::vector<double> density;  ///< per cell: samples over their number and the cell's solid angle
  double below = 0.0;           ///< fraction of directions below the shading normal's horizon
  double outside = 0.0;         ///< fraction of directions in no cell
  double failed = 0.0;          ///< fraction of samples without a direction
  double p = 1.0;  ///< p of a chi² test against pdf(), with separate samples; small if they disagree
};

/// Counts `samples` > 0 samples in cells. Deterministic.
sample_counts count_samples(const pixel_sampler& sampler, const direction_grid& grid, int samples);

/// The p of a chi² test of directions against a sampler's pdf(). Only the shape counts, since samples may
/// fail. `hints` are other directions of the same source that tell where it is dense.
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
