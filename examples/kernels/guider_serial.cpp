// The host's guider on one thread.
#if KERNELS_GUIDE
#include "make_guider.hpp"

namespace kernels {

template guider_on<serial> make_guider(const guide_caster<serial>&, const wfpg::bounds3&, const settings&);

}  // namespace kernels
#endif
