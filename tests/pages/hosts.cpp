// The host that docs/hosts.md talks about, and its kernel as it stands there.
#include <wfpg/base/types.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guides/octree/guide_view.hpp>
#include <wfpg/sampling/roulette.hpp>

#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>

namespace my {

struct bsdf_direction {
  wfpg::vec3 wi;
  glm::vec4 value;  // of four wavelengths: f |cos|, or of a delta lobe its weight times its probability
  float pdf;
  bool is_delta = false;
};
struct vertex {
  std::size_t path;
  std::uint32_t depth;
  wfpg::vec3 wo, normal, wi;
  glm::vec4 throughput;
  float roulette_scale;
};
inline wfpg::vec3 mirrored(wfpg::vec3 wo, wfpg::vec3 normal) {
  return 2.0f * glm::dot(wo, normal) * normal - wo;
}

struct layered {
  glm::vec4 eval(wfpg::vec3 wo, wfpg::vec3 wi) const;
  float pdf(wfpg::vec3 wo, wfpg::vec3 wi) const;
  bsdf_direction sample(wfpg::vec3 wo, float u, wfpg::vec2 u2) const;
};

}  // namespace my

#include "hosts-1.inc"

template bool scatter(const wfpg::guide_view&, const wfpg::path_recorder_view&, std::uint32_t,
                      const my::layered&, my::vertex&, float, wfpg::vec2);
