// The renderer on the policy exec::seq: one thread, for debugging and as a reference for the others.
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/exec/seq.hpp>

namespace render {

render_result render_on_seq(const scene& scene, const render_options& options,
                            const progress_callback& progress) {
  return render_on<embree_scene>(wfpg::exec::seq(), scene, options, progress);
}

}  // namespace render
