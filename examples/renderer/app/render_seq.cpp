// The renderer on the policy exec::seq: one thread, for debugging and as a reference for the others.
#include "app/render_impl.hpp"
#include "casters/embree_caster.hpp"

#include <wfpg/exec/seq.hpp>

namespace render {

template render_result render_on<embree_scene>(const wfpg::exec::seq&, const scene&, const render_options&,
                                               const progress_callback&);

}  // namespace render
