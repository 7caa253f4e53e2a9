// The renderer on the policy exec::omp: OpenMP.
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/exec/omp.hpp>

namespace render {

render_result render_on_omp(const scene& scene, const render_options& options,
                            const progress_callback& progress) {
  return render_on<embree_scene>(wfpg::exec::omp(), scene, options, progress);
}

}  // namespace render
