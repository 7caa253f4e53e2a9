// Measures Open PGL's distributions.
#include "method.hpp"
#include "openpgl_method.hpp"

namespace room {

outcome measure_openpgl(const std::string& name, const settings& set, const wall_light& light,
                        const std::vector<wall_point>& places) {
  const auto kind = name == "openpgl-pavmm" ? PGL_DIRECTIONAL_DISTRIBUTION_PARALLAX_AWARE_VMM
                    : name == "openpgl-vmm" ? PGL_DIRECTIONAL_DISTRIBUTION_VMM
                                            : PGL_DIRECTIONAL_DISTRIBUTION_QUADTREE;
  openpgl_method method(light, set.paths, kind, set.samples_a_leaf);
  for (std::uint32_t sample = 0; sample < set.samples; ++sample) method.train(sample);
  outcome result;
  result.at_places = method.measure_at(places, result.unguided);
  return result;
}

}  // namespace room
