// The host's guider on TBB's threads.
#if KERNELS_GUIDE
#include "make_guider.hpp"

namespace kernels {

template guider_on<tbb_threads> make_guider(const guide_caster<tbb_threads>&, const wfpg::bounds3&,
                                            const settings&);

}  // namespace kernels
#endif
