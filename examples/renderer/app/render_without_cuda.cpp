// Replaces render_cuda.cu in builds without a CUDA compiler.
#include "app/render.hpp"

#include <stdexcept>

namespace render {

render_result render_on_cuda(const scene&, const render_options&, const progress_callback&) {
  throw std::runtime_error(
      "--device cuda: this program was built without CUDA; install the CUDA toolkit (nvcc 12 or newer), "
      "configure with -DWFPG_CUDA=ON and build again");
}

}  // namespace render
