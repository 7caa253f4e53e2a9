// The host of docs/host.md and README.md, and their code unchanged. The loop of README.md passes the functors
// of docs/host.md.
#include <wfpg/base/types.hpp>

#include <cstdint>
#include <vector>

namespace my {

struct material {};
struct bsdf_direction {
  wfpg::vec3 wi;
  float pdf;
};
wfpg::vec3 eval(const material&, wfpg::vec3 wo, wfpg::vec3 wi);
wfpg::vec3 eval_delta(const material&, wfpg::vec3 wo, wfpg::vec3 wi);
float pdf(const material&, wfpg::vec3 wo, wfpg::vec3 wi);
bsdf_direction sample(const material&, wfpg::vec3 wo, wfpg::vec2 u);
bool is_smooth(const material&);
bool is_transparent(const material&);

struct hit_point {
  wfpg::vec3 position, geometric_normal, shading_normal;
  my::material material;
};
struct path {
  hit_point hit;
  wfpg::vec3 direction, throughput, emitted, radiance;
  bool alive;
};
struct scene {
  std::vector<wfpg::vec3> positions;
  std::vector<wfpg::uvec3> triangles;
};
wfpg::vec2 random(std::uint32_t i, std::uint32_t sample, std::uint32_t dimension);
float nearest_hit(const scene&, wfpg::vec3 origin, wfpg::vec3 direction);
wfpg::vec3 environment(const scene&, wfpg::vec3 direction);
void start_camera_paths(std::vector<path>&, std::uint32_t sample);
void trace(const scene&, path&);

}  // namespace my

#include "host-1.inc"
#include "readme-1.inc"
