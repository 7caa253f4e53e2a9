// What the host tells one launch of the device programs in optix_programs.cu.
#pragma once

#include <wfpg/base/types.hpp>

namespace render {

/// Trivially copyable; in device memory while the launch runs.
struct optix_parameters {
  const wfpg::ray* rays = nullptr;
  void* answers = nullptr;      ///< one a ray; the program knows of what type
  float environment = 0.0f;     ///< luminance, W/(m² sr)
  unsigned long long tree = 0;  ///< the acceleration structure; 0 where there are no triangles
};

}  // namespace render
