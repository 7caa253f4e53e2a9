// A host with kernels of its own, in miniature: hits go to a kernel by material, BSDFs exist only there and
// one of them has a delta lobe beside others, paths carry four wavelengths, and a fog scatters between
// surfaces. Guided and unguided pictures agree, and guiding gains.
#include "support/evaluate.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"

#include <wfpg/path_guider.hpp>
#include <wfpg/sampling/roulette.hpp>
#include <wfpg/testing/statistics.hpp>

#include <glm/vec4.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

using namespace wfpg_test;
using glm::vec4;
using wfpg::testing::sample_mean;

namespace {

enum class material : std::uint32_t { diffuse, coated, fog, none };

/// A path between two kernels.
struct host_path {
  vec3 position, normal, direction;  ///< direction: in which it goes on
  vec4 throughput{1.0f};
  float radiance = 0.0f;        ///< mean of the wavelengths, at the path's origin
  float roulette_scale = 1.0f;  ///< throughput without a guide over the real one
  material hit = material::none;
};

struct drawn_bsdf {
  vec3 wi;
  vec4 value;  ///< f |cos|; of a delta lobe its weight times its probability
  float pdf = 0.0f;
  bool is_delta = false;
};

WFPG_HD vec3 mirrored(vec3 wo, vec3 normal) {
  return 2.0f * glm::dot(wo, normal) * normal - wo;
}
WFPG_HD float mean_of(vec4 wavelengths) {
  return 0.25f * (wavelengths.x + wavelengths.y + wavelengths.z + wavelengths.w);
}

struct diffuse_kernel_bsdf {
  static constexpr material kind = material::diffuse;
  vec3 normal;

  WFPG_HD vec4 eval(vec3, vec3 wi) const { return vec4(0.9f, 0.8f, 0.7f, 0.4f) * pdf({}, wi); }
  WFPG_HD float pdf(vec3, vec3 wi) const { return std::fmax(glm::dot(normal, wi), 0.0f) / wfpg::pi; }
  WFPG_HD drawn_bsdf sample(vec3 wo, float, vec2 u) const {
    const float r = std::sqrt(u.x), turn = 2.0f * wfpg::pi * u.y;
    const vec3 wi =
        wfpg::frame(normal).to_world({r * std::cos(turn), r * std::sin(turn), std::sqrt(1.0f - u.x)});
    return {wi, eval(wo, wi), pdf(wo, wi), false};
  }
};

/// A smooth coat that reflects a third, drawn as often, over the diffuse material.
struct coated_kernel_bsdf {
  static constexpr material kind = material::coated;
  static constexpr float coat = 1.0f / 3.0f;
  vec3 normal;

  WFPG_HD vec4 eval(vec3 wo, vec3 wi) const {
    return (1.0f - coat) * diffuse_kernel_bsdf{normal}.eval(wo, wi);
  }
  WFPG_HD float pdf(vec3 wo, vec3 wi) const {
    return (1.0f - coat) * diffuse_kernel_bsdf{normal}.pdf(wo, wi);
  }
  WFPG_HD drawn_bsdf sample(vec3 wo, float u, vec2 u2) const {
    if (u < coat) return {mirrored(wo, normal), vec4(coat), coat, true};
    const vec3 wi = diffuse_kernel_bsdf{normal}.sample(wo, u, u2).wi;
    return {wi, eval(wo, wi), pdf(wo, wi), false};
  }
};

/// What the room has beside diffuse walls.
struct room {
  float fog = 0.0f;    ///< scattering events per unit of length
  bool coats = false;  ///< the walls at both ends of x are coated
};

/// What all kernels share.
struct wave_state {
  wfpg::array_view<host_path> paths;
  wfpg::path_recorder_view recorder;
  std::uint32_t depth;
  std::uint64_t seed;
  room in;

  WFPG_HD vec2 draw(std::size_t i, std::uint32_t use) const {
    return hashed_numbers{seed}(static_cast<std::uint32_t>(i), 8 * depth + use);
  }
};

/// Kernel: finds each path's next hit, of a wall or of the fog, and tells the recorder of walls.
struct find_hits {
  wave_state at;

  WFPG_HD void operator()(std::size_t i) const {
    host_path& path = at.paths[i];
    if (path.hit == material::none) return;
    wfpg::ray ray;
    ray.origin = path.position;
    ray.direction = path.direction;
    const float distance = box_caster()(ray).distance;
    const float free = at.in.fog > 0.0f ? -std::log(1.0f - at.draw(i, 0).x) / at.in.fog : 2.0f * distance;
    path.position += std::fmin(free, distance) * path.direction;
    path.hit = material::fog;
    if (free < distance) return;
    path.position = glm::clamp(path.position, vec3(0.0f), vec3(1.0f));
    path.normal = inward_normal(path.position);
    path.hit = at.in.coats && std::fabs(path.normal.x) > 0.5f ? material::coated : material::diffuse;
    at.recorder.vertex(i, at.depth, path.position, -path.direction, path.normal, false,
                       mean_of(path.throughput));
    // What the camera sees directly is as noisy with and without a guide.
    if (at.depth > 0) path.radiance += mean_of(path.throughput) * emitted(path.position);
    at.recorder.total(i, at.depth, path.radiance);
  }
};

/// Kernel: paths in the fog go on in any direction.
struct scatter_in_fog {
  wave_state at;

  WFPG_HD void operator()(std::size_t i) const {
    host_path& path = at.paths[i];
    if (path.hit == material::fog) path.direction = wfpg::square_to_sphere(at.draw(i, 1));
  }
};

/// Kernel of one material.
template <class Bsdf>
struct shade {
  wave_state at;
  wfpg::guide_view guide;
  bool forgets_guide;  ///< planted: the density of the guide is left out in one of 16 directions

  WFPG_HD void operator()(std::size_t i) const {
    host_path& path = at.paths[i];
    if (path.hit != Bsdf::kind) return;
    const Bsdf bsdf{path.normal};
    const vec3 wo = -path.direction;
    const auto part = Bsdf::kind == material::coated
                          ? wfpg::glossy_part{coated_kernel_bsdf::coat, 0.0f}
                          : wfpg::glossy_part::unknown(bsdf.pdf(wo, mirrored(wo, path.normal)));
    const wfpg::kernel_mixture mixture = guide.mixture(static_cast<std::uint32_t>(i), part);
    float u = at.draw(i, 2).x;
    drawn_bsdf drawn;
    if (mixture.choose(u)) {
      drawn.wi = mixture.sample(at.draw(i, 3));
      drawn.value = bsdf.eval(wo, drawn.wi);
      drawn.pdf = bsdf.pdf(wo, drawn.wi);
    } else {
      drawn = bsdf.sample(wo, u, at.draw(i, 3));
    }
    float pdf = drawn.is_delta ? mixture.delta_pdf(drawn.pdf) : mixture.pdf(drawn.wi, drawn.pdf);
    if (forgets_guide && i % 16 == 0 && drawn.pdf > 0.0f) pdf = drawn.pdf;
    path.throughput *= drawn.value / pdf;
    path.roulette_scale *= wfpg::roulette_scale(drawn.pdf, pdf);
    path.direction = drawn.wi;
    at.recorder.scatter(i, at.depth, drawn.wi, drawn.is_delta ? wfpg::no_field : mixture.number);
    const float survival = std::fmin(2.0f * mean_of(path.throughput) * path.roulette_scale, 1.0f);
    if (at.draw(i, 4).x < survival)
      path.throughput /= survival;
    else
      path.hit = material::none;
  }
};

constexpr std::uint32_t path_count = 4096, host_depth = 5;

/// Mean radiance of the picture, of each sample.
template <class Exec>
sample_mean render(const room& in, std::uint32_t samples, bool guided, bool forgets_guide = false) {
  const Exec exec;
  const box_mesh<Exec> mesh(exec);
  wfpg::kept_guide_options options;
  static_cast<wfpg::octree_guide_options&>(options) = tracing_options(path_count);
  options.max_depth = host_depth;
  options.records_waves = true;
  options.unguided_samples = guided ? 1 : samples;
  wfpg::path_guider<Exec> guider(exec, mesh.view(), options);
  sample_mean means;
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    std::vector<host_path> camera(path_count);
    random_numbers random(100);  // pixels are the same in each sample
    for (host_path& path : camera) {
      path.position = {0.5f, 0.5f, 0.5f};
      path.direction = random.direction();
      path.hit = material::fog;
    }
    const wfpg::buffer<host_path, Exec> paths(exec, camera);
    guider.begin_sample();
    for (std::uint32_t depth = 0; depth < host_depth; ++depth) {
      const wave_state at{paths.view(), guider.recorder(), depth, 7 + sample, in};
      exec.for_each(path_count, find_hits{at});
      const wfpg::guide_view guide = guider.prepare(depth, box_caster{});
      exec.for_each(path_count, shade<diffuse_kernel_bsdf>{at, guide, forgets_guide});
      exec.for_each(path_count, shade<coated_kernel_bsdf>{at, guide, forgets_guide});
      exec.for_each(path_count, scatter_in_fog{at});
    }
    guider.end_sample();
    double sum = 0.0;
    for (const host_path& path : paths.to_host(exec)) sum += double(path.radiance);
    means.add(sum / path_count);
  }
  if (guided) {
    const wfpg::guider_statistics counted = guider.statistics();
    CHECK(counted.dropped_vertices == 0);
    CHECK((counted.path_gaps > 0) == (in.fog > 0.0f));
    CHECK(counted.deposits.total() == 0);
  }
  return means;
}

double distance_in_errors(const sample_mean& a, const sample_mean& b, double factor = 1.0) {
  return std::fabs(a.mean() - factor * b.mean()) / std::hypot(a.error(), factor * b.error());
}

WFPG_TEST_CASE("kernel host: fog and coats leave no bias, and no call is dropped", "[kernel_host]") {
  const room in{0.2f, true};
  const sample_mean plain = render<Exec>(in, 400, false), guided = render<Exec>(in, 200, true),
                    faulty = render<Exec>(in, 200, true, true);
  INFO("unguided " << plain.mean() << " +- " << plain.error() << ", guided " << guided.mean() << " +- "
                   << guided.error() << ", faulty " << faulty.mean() << " +- " << faulty.error());
  CHECK(distance_in_errors(guided, plain) < 4.0);
  CHECK(distance_in_errors(guided, plain, 1.05) > 4.0);
  CHECK(distance_in_errors(faulty, plain) > 4.0);
}

WFPG_TEST_CASE("kernel host: guiding gains where fields know all light", "[kernel_host]") {
  const sample_mean plain = render<Exec>({}, 200, false), guided = render<Exec>({}, 100, true);
  INFO("unguided " << plain.mean() << " +- " << plain.error() << ", guided " << guided.mean() << " +- "
                   << guided.error());
  CHECK(distance_in_errors(guided, plain) < 4.0);
  // At equal samples the variance is a third, or less.
  CHECK(guided.error() * guided.error() / 2.0 < plain.error() * plain.error() / 3.0);
}

}  // namespace
