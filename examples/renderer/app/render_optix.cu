// The renderer on the policy exec::cuda with OptiX as its ray caster.
#include "app/gpu_ranks.hpp"
#include "app/render_impl.hpp"
#include "casters/optix_caster.hpp"
#include "tracer/cuda_clock.hpp"

#include <wfpg/exec/cuda.hpp>

#include <stdexcept>

namespace render {
namespace {

/// OptiX's structure of a scene, as render_on needs it.
class optix_accelerated {
 public:
  static constexpr const char* name = "optix";

  optix_accelerated(const wfpg::exec::cuda& exec, const scene& host, const scene_view& view)
      : scene_(exec, view.positions, view.triangles, wfpg::luminance(host.environment)) {
    if (has_cut_outs(host))
      throw std::runtime_error("--device optix does not support alpha masks; --device cuda does");
    if (!host.sky.texels.empty())
      throw std::runtime_error("--device optix does not support --environment; --device cuda does");
  }

  optix_caster caster() const { return scene_.caster(); }

 private:
  optix_scene scene_;
};

}  // namespace

render_result render_on_optix(const scene& scene, const render_options& options,
                              const progress_callback& progress) {
  // The number comes first, since any other call makes a context on GPU 0.
  if (!options.devices.empty())
    wfpg::check_cuda(cudaSetDevice(options.devices.front()),
                     "--device optix finds no GPU of this number; cudaSetDevice");
  wfpg::check_cuda(cudaFree(nullptr), "--device optix finds no GPU that it can use; cudaFree");
  const wfpg::exec::cuda exec;
  const gpu_options own(exec, options);
  return render_on<optix_accelerated>(exec, scene, own.get(), progress);
}

}  // namespace render
