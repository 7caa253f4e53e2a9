// What is found about the directions of one point: its field, the light that arrives, what draws samples, and
// how noisy that makes a pixel.
#pragma once

#include "learnt_scene.hpp"
#include "pixel_sampler.hpp"

#include <vector>

namespace inspect {

/// What a measurement takes.
struct finding_options {
  int reference_spp = 1024;   ///< paths for each cell of the reference, at least 2
  int histogram = 1 << 20;    ///< samples in the histogram, positive
  int reference_cells = 96;   ///< cells along the reference's side, at least, positive
  int field_resolution = 24;  ///< cells along the side of the histograms of a point without a field
};

/// Relative standard deviation of one sample, as far as its first direction makes it: of what the light sum
/// is where lights are not asked, and the light's own noise left out.
struct predicted_noise {
  double bsdf = 0.0;     ///< directions from the BSDF alone
  double sampler = 0.0;  ///< from the mixture as it is
};

/// Maps are values a cell, means over it: densities per steradian, of which each integrates to 1 over the
/// cells at most.
struct findings {
  direction_grid cells{1};            ///< of the field
  direction_grid fine_cells{1};       ///< of the reference
  render::image arriving;             ///< the reference, on the fine cells, W/(m² sr)
  std::vector<double> field;          ///< empty without a field
  std::vector<double> reference;      ///< of the reference, with the cosine where the field has it
  std::vector<double> product;        ///< of field and BSDF; empty without a field
  std::vector<double> ideal;          ///< of reference and BSDF
  std::vector<double> sampler;        ///< pdf of what draws samples
  sample_counts counted;              ///< histogram of samples
  std::vector<double> contributions;  ///< on the fine cells: a sample's contribution over the mean of all
  predicted_noise noise;
  double correlation = 0.0;       ///< of field and reference; NaN without a field, or where one is constant
  double divergence = 0.0;        ///< of the field from the reference, nats; NaN without a field
  double divergence_noise = 0.0;  ///< of the reference from its halves: about what its noise makes of that
};

/// Measures a pixel that hits a surface whose BSDF is not all delta. `progress` is of the reference.
findings find(const learnt_scene& learnt, std::uint32_t pixel, const finding_options& options,
              const render::progress_callback& progress);

}  // namespace inspect
