// The renderer on the policy exec::cuda: a GPU.
#include "app/gpu_ranks.hpp"
#include "app/render_impl.hpp"
#include "casters/bvh_scene.hpp"
#include "tracer/cuda_clock.hpp"

#include <wfpg/exec/cuda.hpp>

namespace render {

render_result render_on_cuda(const scene& scene, const render_options& options,
                             const progress_callback& progress) {
  // The number comes first, since any other call makes a context on GPU 0.
  if (!options.devices.empty())
    wfpg::check_cuda(cudaSetDevice(options.devices.front()),
                     "--device cuda finds no GPU of this number; cudaSetDevice");
  wfpg::check_cuda(cudaFree(nullptr), "--device cuda finds no GPU that it can use; cudaFree");
  const wfpg::exec::cuda exec;
  const gpu_options own(exec, options);
  return render_on<bvh_scene<wfpg::exec::cuda>>(exec, scene, own.get(), progress);
}

}  // namespace render
