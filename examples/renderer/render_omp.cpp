// The renderer on the policy exec::omp: OpenMP.
#include "render_impl.hpp"

#include <wfpg/exec/omp.hpp>

namespace render {

template render_result render_on(const wfpg::exec::omp&, const scene&, const render_options&,
                                 const progress_callback&);

}  // namespace render
