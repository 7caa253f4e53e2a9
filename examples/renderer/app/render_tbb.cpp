// The renderer on the policy exec::tbb: TBB.
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/exec/tbb.hpp>

namespace render {

render_result render_on_tbb(const scene& scene, const render_options& options,
                            const progress_callback& progress) {
  return render_on<embree_scene>(wfpg::exec::tbb(), scene, options, progress);
}

}  // namespace render
