// The renderer on the policy exec::omp: OpenMP.
#include "embree_caster.hpp"
#include "render_impl.hpp"

#include <wfpg/exec/omp.hpp>

namespace render {

template render_result render_on<embree_scene>(const wfpg::exec::omp&, const scene&, const render_options&,
                                               const progress_callback&);

}  // namespace render
