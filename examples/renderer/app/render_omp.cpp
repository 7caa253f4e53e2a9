// The renderer on the policy exec::omp: OpenMP.
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/exec/omp.hpp>

namespace render {

template render_result render_on<embree_scene>(const wfpg::exec::omp&, const scene&, const render_options&,
                                               const progress_callback&);

}  // namespace render
