// The octree as the camera sees it: each pixel coloured by the voxel that its middle hits.
#pragma once

#include "colour_scale.hpp"
#include "learnt_scene.hpp"

#include <cstdint>

namespace inspect {

/// Luminance that the cache has of the voxels' sides, W/(m² sr).
struct exitance_pictures {
  render::image facing;   ///< of the side toward the camera; negative where it has no data or nothing is hit
  render::image turned;   ///< of the other side
  double greatest = 0.0;  ///< of both
};

exitance_pictures exitance_of(const learnt_scene& learnt);
/// Heat colours; blue where there is no data.
render::image coloured_exitance(const render::image& exitance, const colour_scale& scale);

/// The voxels' normals toward the camera, [-1, 1] as [0, 1]; black where nothing is hit.
render::image normal_picture(const learnt_scene& learnt);
/// A colour a bin, at random; black where there is none.
render::image bin_picture(const learnt_scene& learnt);
/// The level of the bins' nodes, by a scale that ends at the leaves'; blue where there is no bin.
render::image level_picture(const learnt_scene& learnt, const colour_scale& scale);

/// A picture with a frame around a pixel; coordinates from the upper left.
render::image marked(render::image picture, int x, int y);

}  // namespace inspect
