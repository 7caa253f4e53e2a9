// Parameters from the host for one launch of the device programs in optix_programs.cu.
#pragma once

#include <wfpg/base/types.hpp>

namespace render {

/// Trivially copyable. In device memory while the launch runs.
struct optix_parameters {
  const wfpg::ray* rays = nullptr;
  void* answers = nullptr;      ///< one per ray; the type depends on the program
  float environment = 0.0f;     ///< luminance, W/(m² sr)
  unsigned long long tree = 0;  ///< the acceleration structure; 0 without triangles
};

}  // namespace render
