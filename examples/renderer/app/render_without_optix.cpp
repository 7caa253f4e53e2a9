// Replaces render_optix.cu in builds without OptiX's headers.
#include "app/render.hpp"

#include <stdexcept>

namespace render {

render_result render_on_optix(const scene&, const render_options&, const progress_callback&) {
  throw std::runtime_error(
      "--device optix: this program was built without OptiX; configure with -DOptiX_ROOT=DIRECTORY, which "
      "holds the SDK's include/optix.h, where nvcc is found, and build again");
}

}  // namespace render
