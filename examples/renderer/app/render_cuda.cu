// The renderer on the policy exec::cuda: a GPU.
#include "app/render_impl.hpp"
#include "casters/bvh_scene.hpp"
#include "tracer/cuda_clock.hpp"

#include <wfpg/exec/cuda.hpp>

namespace render {

render_result render_on_cuda(const scene& scene, const render_options& options,
                             const progress_callback& progress) {
  wfpg::check_cuda(cudaFree(nullptr), "--device cuda finds no GPU that it can use; cudaFree");
  return render_on<bvh_scene<wfpg::exec::cuda>>(wfpg::exec::cuda(), scene, options, progress);
}

}  // namespace render
