// What paths from both ends bring to a pixel: by technique over all samples, and photon by photon in one of
// them. The renderer's tracer and kernels find it.
#pragma once

#include "app/render.hpp"
#include "merge_recorder.hpp"
#include "tracer/found_light.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace inspect {

/// Samples of a pixel's radiance, W/(m² sr).
struct sample_statistics {
  int samples = 0;
  vec3 mean{0.0f};
  double variance = 0.0;  ///< of one sample's luminance
  double lit = 0.0;       ///< share of samples that are not black
  double greatest = 0.0;  ///< luminance of the brightest sample
  int brightest = 0;      ///< its number, from 1; 0: all are black
};

/// One technique's part of a pixel.
struct technique_findings {
  render::technique by;
  sample_statistics weighted;
  vec3 plain{0.0f};                 ///< mean without weights
  double share = 0.0;               ///< of the pixel's luminance
  render::technique_sum in_sample;  ///< what it found in the sample that is shown
};

/// Radius of a technique's merges, scene units.
struct shrinking_radius {
  render::technique by;
  int dimension = 2;  ///< of its kernel
  float first = 0.0f, shown = 0.0f, last = 0.0f;
};

/// A photon in reach of the camera path.
struct found_photon {
  near_photon near;
  float distance = 0.0f, radius = 0.0f;  ///< scene units
  vec3 point{0.0f};                      ///< on the camera path
  vec3 photon{0.0f};                     ///< the photon, or the nearest point of its beam
  std::uint32_t light_segments = 0;      ///< of the light path
  vec3 flux{0.0f};                       ///< that it carries there; in media with scattering

  vec3 contribution() const { return near.value * near.weight; }
};

/// Positions of all photons of the sample that is shown.
struct stored_photons {
  std::vector<vec3> on_surfaces, in_media;
  std::vector<wfpg::path_beam> beams;
};

struct both_ends {
  render::image picture;
  std::vector<render::technique_images> by_technique;
  int samples = 0;
  int shown = 1;  ///< number of the sample that is shown, from 1
  sample_statistics all;
  std::vector<technique_findings> techniques;
  std::vector<shrinking_radius> radii;  ///< of techniques that merge
  recorded_path path;
  std::vector<found_photon> photons;  ///< in the order of path.near
  stored_photons stored;
  std::uint64_t dropped = 0;  ///< vertices and beams without memory, over all samples
  float pixel_width = 0.0f;   ///< at the path's first vertex, scene units; 0 where it has none

  /// Radius of a technique in the sample that is shown. 0 where it does not merge.
  float radius_of(render::technique by) const;
  /// Distance from a vertex to the nearest photon of its kind, on surfaces or in media. Infinite without one.
  float nearest_to(const path_step& step) const;
};

/// Which pixel to look at, and which of its samples.
struct pixel_request {
  std::size_t pixel = 0;  ///< row by row from the top
  int sample = 0;         ///< from 1; 0: the one to which merges bring most
};

/// Renders on exec::tbb with Embree, and looks at a pixel. `options` must be complete, of a method of paths
/// from both ends. Throws what render::render throws, and std::invalid_argument for a sample that is not
/// rendered.
both_ends look_at(const render::scene& scene, const render::render_options& options,
                  const pixel_request& asked, const render::progress_callback& progress);

}  // namespace inspect
