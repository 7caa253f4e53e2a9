// A small spectral path tracer of the kind that production renderers are: hits are sorted into queues by
// material, a BSDF exists only in its material's kernel, geometry is behind an interface, a fog scatters. It
// shows what such a host adds for wfpg: the lines in #if KERNELS_GUIDE, and those that name it.
#pragma once

#include "scene/scene.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace kernels {

using render::vec3;

struct settings {
  int width = 0, height = 0;         ///< pixels, positive
  std::uint32_t max_depth = 8;       ///< most vertices of a path, at least 1
  std::uint32_t roulette_depth = 3;  ///< Russian roulette begins at this vertex; the camera's first hit is 0
  float fog = 0.0f;                  ///< scattering events of the fog per scene unit, at least 0
  bool guided = true;                ///< after unguided_samples
  std::uint32_t unguided_samples = 1;
  bool check = false;  ///< whether faults() and note() know anything
  std::uint64_t seed = 0;
};

class renderer {
 public:
  virtual ~renderer() = default;
  /// Renders one sample of each pixel and returns its colours, row by row from the top, linear RGB.
  virtual std::vector<vec3> sample() = 0;
  /// Weight that the last sample should have in the picture.
  virtual float weight() const { return 1.0f; }
  /// What the samples so far show to be wrong in the host's use of the guide, a sentence a line. Empty where
  /// nothing is, or nothing is checked.
  virtual std::string faults() const { return {}; }
  /// Says that guiding does not pay, where so, after two samples of each kind.
  virtual std::string note() const { return {}; }
};

enum class device { serial, tbb, cuda };

/// Throws std::invalid_argument for settings out of range, a material that the host does not have, or a
/// texture. Throws std::runtime_error where there is no GPU, or no code for one.
std::unique_ptr<renderer> make_renderer(device where, const render::scene& scene, const settings& wanted);

}  // namespace kernels
