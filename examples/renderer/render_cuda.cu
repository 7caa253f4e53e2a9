// The renderer on the policy exec::cuda: a GPU.
#include "bvh_scene.hpp"
#include "cuda_clock.hpp"
#include "render_impl.hpp"

#include <wfpg/exec/cuda.hpp>

namespace render {
namespace {

/// Memory that was given back stays with the process, as samples take the same again and again.
void keep_freed_memory() {
  using wfpg::detail::check_cuda;
  int device = 0;
  cudaMemPool_t pool = nullptr;
  std::uint64_t bytes = ~std::uint64_t(0);
  check_cuda(cudaGetDevice(&device), "cudaGetDevice");
  check_cuda(cudaDeviceGetDefaultMemPool(&pool, device), "cudaDeviceGetDefaultMemPool");
  check_cuda(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &bytes),
             "cudaMemPoolSetAttribute");
}

}  // namespace

render_result render_on_cuda(const scene& scene, const render_options& options,
                             const progress_callback& progress) {
  wfpg::detail::check_cuda(cudaFree(nullptr), "--device cuda finds no GPU that it can use; cudaFree");
  keep_freed_memory();
  return render_on<bvh_scene<wfpg::exec::cuda>>(wfpg::exec::cuda(), scene, options, progress);
}

}  // namespace render
