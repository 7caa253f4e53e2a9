// Replaces wavefront_cuda.cu in builds without a CUDA compiler.
#include "on_devices.hpp"

#include <stdexcept>

namespace kernels {

std::unique_ptr<renderer> make_on_gpu(const render::scene&, const settings&) {
  throw std::runtime_error(
      "--device cuda: this program was built without CUDA; install the CUDA toolkit (nvcc 12 or newer), "
      "configure with -DWFPG_CUDA=ON and build again");
}

}  // namespace kernels
