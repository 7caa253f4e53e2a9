// Findings about the directions at one point: its field, the incident light, its samplers, and the noise that
// they cause.
#pragma once

#include "learnt_scene.hpp"
#include "pixel_sampler.hpp"

#include <vector>

namespace inspect {

/// Cost and resolution of a measurement.
struct finding_options {
  int reference_spp = 1024;   ///< paths for each cell of the reference, at least 2
  int histogram = 1 << 20;    ///< samples in the histogram, positive
  int reference_cells = 96;   ///< cells along the reference's side, at least; positive
  int field_resolution = 24;  ///< cells along a histogram's side at a point without a field
};

/// Relative standard deviation of one sample due to its first direction. Assumes the incident light's mean,
/// without its noise and without next-event estimation.
struct predicted_noise {
  double bsdf = 0.0;     ///< directions from the BSDF alone
  double sampler = 0.0;  ///< from the mixture as it is
};

/// Maps with a value per cell, which is a mean over the cell. Densities are per steradian; each integrates to
/// at most 1 over the cells.
struct findings {
  direction_grid cells{1};            ///< of the field
  direction_grid fine_cells{1};       ///< of the reference
  render::image arriving;             ///< the reference, on the fine cells, W/(m² sr)
  std::vector<double> field;          ///< empty without a field
  std::vector<double> reference;      ///< of the reference, with the cosine if the field has it
  std::vector<double> product;        ///< of field and BSDF; empty without a field
  std::vector<double> ideal;          ///< of reference and BSDF
  std::vector<double> sampler;        ///< pdf of the mixture
  sample_counts counted;              ///< histogram of samples
  std::vector<double> contributions;  ///< on the fine cells: a sample's contribution over the mean of all
  predicted_noise noise;
  double correlation = 0.0;       ///< of field and reference; NaN without a field, or if one is constant
  double divergence = 0.0;        ///< of the field from the reference, nats; NaN without a field
  double divergence_noise = 0.0;  ///< of the reference's halves: about what its noise adds to the divergence
};

/// Measures a pixel that hits a surface whose BSDF is not all delta. `progress` reports the reference's.
findings find(const learnt_scene& learnt, std::uint32_t pixel, const finding_options& options,
              const render::progress_callback& progress);

}  // namespace inspect
