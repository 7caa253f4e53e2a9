// The renderer on the policy exec::tbb: TBB.
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/exec/tbb.hpp>

namespace render {

// In render_tbb_in_kernels.cpp.
extern template render_result render_in_kernels<embree_scene>(const wfpg::exec::tbb&, const scene&,
                                                              const render_options&,
                                                              const progress_callback&);

render_result render_on_tbb(const scene& scene, const render_options& options,
                            const progress_callback& progress) {
  return render_on<embree_scene>(wfpg::exec::tbb(), scene, options, progress);
}

}  // namespace render
