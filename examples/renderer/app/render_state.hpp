// What a rendering needs to go on later as if it had never stopped: the film, the samples so far, the guide,
// and what it was rendered with. State files are sections as in wfpg/state/section_file.hpp:
//   options  the scene's name and checksum (8); an option's name and value, for each that decides the picture
//   film     samples (4), their weight (8), segments (8), of them hits of lights (8), a pixel's sums (3 x 8)
//   guide    a guide file, or nothing
// Texts, and the guide, follow their lengths (8).
#pragma once

#include "app/render.hpp"
#include "scene/scene.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <istream>
#include <string>
#include <vector>

namespace render {

/// The samples of a picture, added up.
struct film_state {
  double weight = 0.0;           ///< of all samples
  std::uint64_t segments = 0;    ///< rays that paths were extended by
  std::uint64_t light_hits = 0;  ///< of them, those that ended at a light
  std::vector<glm::dvec3> sums;  ///< a pixel, row by row: weighted radiance
};

struct render_state {
  int samples = 0;
  film_state film;
  std::string guide;  ///< bytes of a guide file; empty for path tracing
};

/// Hash of all that ranks that render one picture must have in common. Precondition: options.ranks is not
/// null.
std::uint64_t checksum_of(const scene& scene, const render_options& options);

/// A state file's bytes. `options` are complete: width, height and max_depth are the picture's own.
std::string state_bytes(const scene& scene, const render_options& options, const render_state& state);

/// The state that a rendering of these options goes on from. Throws wfpg::file_error that says what is wrong
/// with the file, or which option differs from what it was rendered with.
render_state read_state(const std::string& path, const scene& scene, const render_options& options);
/// The same from a stream, which errors call `name`.
render_state read_state(std::istream& in, const std::string& name, const scene& scene,
                        const render_options& options);

}  // namespace render
