// The renderer's methods without guides on the policy exec::tbb, but for path tracing.
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/exec/tbb.hpp>

namespace render {

template render_result render_in_kernels<embree_scene>(const wfpg::exec::tbb&, const scene&,
                                                       const render_options&, const progress_callback&);

}  // namespace render
