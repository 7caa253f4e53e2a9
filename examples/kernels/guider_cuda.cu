// The host's guider on a GPU.
#if KERNELS_GUIDE
#include "make_guider.hpp"

namespace kernels {

template guider_on<gpu> make_guider(const guide_caster<gpu>&, const wfpg::bounds3&, const settings&);

}  // namespace kernels
#endif
