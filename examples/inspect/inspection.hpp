// An inspection from a scene to a folder of pictures, numbers and a page: of the field that guides a pixel,
// after the thesis's tool (section 5.3), or of what paths from both ends bring to it.
#pragma once

#include "app/render.hpp"
#include "findings.hpp"

#include <filesystem>
#include <iosfwd>
#include <string>

namespace inspect {

struct inspection {
  render::render_options learning;  ///< the rendering that the guider learns from, or that is looked at
  int x = 0, y = 0;                 ///< pixel, from the upper left
  int reference_spp = 256;          ///< paths for each of the reference's cells, 2 or more
  int histogram = 1 << 20;          ///< samples in the histogram, positive
  int sample = 0;  ///< of paths from both ends, from 1; 0: the one to which merges bring most
  std::filesystem::path output = "inspection";
  std::string vdb;  ///< OpenVDB file of the octree; empty: none
};

/// Writes pictures, numbers.json and index.html into the output folder, which it makes. Stages and warnings
/// go to `log`, progress to stderr. Throws std::invalid_argument before it renders, if the pixel is outside
/// of the picture, the sample is none of the rendering, or the folder cannot be written to. Throws what
/// render::render throws, and std::runtime_error if a file cannot be written.
void run(const render::scene& scene, const inspection& asked, std::ostream& log);

}  // namespace inspect
