// Makes the guider of the host on one device, of what rays find.
#pragma once

#if KERNELS_GUIDE
#include "guiding.hpp"

#include <wfpg/octree/fragments_from_caster.hpp>

namespace kernels {

template <class Device>
guider_on<Device> make_guider(const guide_caster<Device>& caster, const wfpg::bounds3& bounds,
                              const settings& wanted) {
  wfpg::kept_guide_options options;
  options.max_paths = std::size_t(wanted.width) * std::size_t(wanted.height);
  options.max_depth = wanted.max_depth;
  options.guided_depths = wanted.max_depth > 3 ? wanted.max_depth - 2 : 1;
  options.unguided_samples = wanted.guided ? wanted.unguided_samples : ~0u;
  options.records_waves = true;
  if (wanted.check) options.least_gain = 0.0f;  // all paths are checked
  options.seed = wanted.seed;
  const typename Device::policy policy;
  return {policy, wfpg::fragments_from_caster(policy, caster, bounds), options};
}

}  // namespace kernels
#endif
