// The octree as the camera sees it: the voxel at each pixel's centre gives the colour.
#pragma once

#include "colour_scale.hpp"
#include "learnt_scene.hpp"

#include <cstdint>

namespace inspect {

/// The cached luminance of the voxels' sides, W/(m² sr).
struct exitance_pictures {
  render::image facing;   ///< of the side toward the camera; negative without data or without a hit
  render::image turned;   ///< of the other side
  double greatest = 0.0;  ///< of both
};

exitance_pictures exitance_of(const learnt_scene& learnt);
/// Heat colours; blue where there is no data.
render::image coloured_exitance(const render::image& exitance, const colour_scale& scale);

/// The voxels' normals toward the camera, [-1, 1] as [0, 1]. Black where nothing is hit.
render::image normal_picture(const learnt_scene& learnt);
/// A random colour for each bin. Black where there is none.
render::image bin_picture(const learnt_scene& learnt);
/// The level of the bins' nodes, on a scale that ends at the leaves' level. Blue where there is no bin.
render::image level_picture(const learnt_scene& learnt, const colour_scale& scale);

/// Exposure of a picture, by its median luminance.
float exposure_of(const render::image& picture);
render::image exposed(render::image picture, float exposure);

/// A picture with a frame around a pixel. Coordinates are from the upper left.
render::image marked(render::image picture, int x, int y);

}  // namespace inspect
