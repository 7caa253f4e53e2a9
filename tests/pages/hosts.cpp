// The host that docs/hosts.md talks about, and its kernel as it stands there.
#include <wfpg/base/types.hpp>
#include <wfpg/exec/tbb.hpp>
#include <wfpg/guide/path_recorder.hpp>
#include <wfpg/guides/octree/deposit_paths.hpp>
#include <wfpg/octree/fragments_from_caster.hpp>
#include <wfpg/octree/fragments_from_hits.hpp>
#include <wfpg/octree/surface_collector.hpp>
#include <wfpg/octree/svo_ray_caster.hpp>
#include <wfpg/path_guider.hpp>
#include <wfpg/sampling/roulette.hpp>
#include <wfpg/testing/check_host.hpp>

#include <glm/vec4.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

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

inline float mean_of(glm::vec4 wavelengths) {
  return 0.25f * (wavelengths.x + wavelengths.y + wavelengths.z + wavelengths.w);
}

struct layered {
  glm::vec4 eval(wfpg::vec3 wo, wfpg::vec3 wi) const;
  float pdf(wfpg::vec3 wo, wfpg::vec3 wi) const;
  bsdf_direction sample(wfpg::vec3 wo, float u, wfpg::vec2 u2) const;
};

struct scene {};
struct path {};
struct hit {
  wfpg::vec3 position, normal;
  bool transmits;
};
struct ray {
  wfpg::vec3 direction;
};
void start_camera_paths(std::vector<path>&, std::uint32_t sample);
void trace(const scene&, std::vector<path>&, std::uint32_t depth, const wfpg::path_recorder_view&);
void shade(const scene&, std::vector<path>&, std::uint32_t depth, const wfpg::guide_view&,
           const wfpg::path_recorder_view&);

struct tracer {
  void render_unguided_sample(const wfpg::surface_collector_view& hits, const wfpg::path_recorder_view&);
  template <class Guider, class Caster>
  void trace_sample(Guider&, const Caster&, const wfpg::testing::host_checker_view&) {}
};

}  // namespace my

#include "hosts-3.inc"
#include "hosts-4.inc"
#include "hosts-5.inc"
#include "hosts-6.inc"
#include "hosts-7.inc"

template bool scatter(const wfpg::guide_view&, const wfpg::path_recorder_view&, std::uint32_t,
                      const my::layered&, my::vertex&, float, wfpg::vec2);

void tell_of_hit(const wfpg::path_recorder_view& recorder, std::size_t path, std::uint32_t depth,
                 const my::hit& hit, const my::ray& ray, float throughput) {
#include "hosts-2.inc"
}

template <class Caster>
void take_sample(wfpg::path_guider<wfpg::exec::tbb>& guider, const my::scene& scene,
                 std::vector<my::path>& paths, const Caster& caster, std::uint32_t sample,
                 std::uint32_t max_depth) {
#include "hosts-1.inc"
}

namespace my {

struct caster {
  wfpg::ray_hit operator()(const wfpg::ray&) const;
};

}  // namespace my

template void take_sample(wfpg::path_guider<wfpg::exec::tbb>&, const my::scene&, std::vector<my::path>&,
                          const my::caster&, std::uint32_t, std::uint32_t);

template wfpg::path_guider<wfpg::exec::tbb> guider_from_caster(const wfpg::exec::tbb&,
                                                               const wfpg::svo_ray_caster&,
                                                               const wfpg::bounds3&,
                                                               const wfpg::kept_guide_options&);
template wfpg::path_guider<wfpg::exec::tbb> guider_from_first_sample(const wfpg::exec::tbb&, my::tracer&,
                                                                     wfpg::kept_guide_options);
template std::string faults_of_host(const wfpg::exec::tbb&, wfpg::path_guider<wfpg::exec::tbb>&, my::tracer&,
                                    const my::caster&);
