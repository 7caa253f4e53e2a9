// A host with kernels of its own, in miniature: hits go to a kernel by material, BSDFs exist only there and
// one of them has a delta lobe beside others, paths carry four wavelengths, and a fog scatters between
// surfaces. It may use the guide wrongly on request.
#pragma once

#include "support/guiding.hpp"
#include "support/policies.hpp"

#include <wfpg/path_guider.hpp>
#include <wfpg/sampling/roulette.hpp>
#include <wfpg/testing/check_host.hpp>

#include <glm/vec4.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace wfpg_test {

using glm::vec4;

enum class material : std::uint32_t { diffuse, coated, glossy, fog, none };

/// What the host does wrong.
enum class host_fault {
  none,
  forgets_guide,       ///< the density of the guide is left out in one of 16 directions
  guided_roulette,     ///< roulette decides by the guided throughput
  narrow_in_full,      ///< narrow lobes are guided as the others
  silent_escapes,      ///< the recorder does not know that paths escape
  early_scatter,       ///< the recorder gets directions before roulette, though escapes are silent
  lost_light,          ///< the recorder does not know what paths find behind their second vertex
  local_scatter,       ///< the recorder gets directions in the frame of the surface
  no_scatter,          ///< the recorder gets no directions
  normal_as_outgoing,  ///< the recorder gets the normal for the outgoing direction
  local_step,          ///< the checker gets directions in the frame of the surface
  local_pdf,           ///< densities are asked in the frame of the surface
  local_query,         ///< densities of next-event estimation are asked so
};

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

WFPG_HD inline vec3 mirrored(vec3 wo, vec3 normal) {
  return 2.0f * glm::dot(wo, normal) * normal - wo;
}
WFPG_HD inline float mean_of(vec4 wavelengths) {
  return 0.25f * (wavelengths.x + wavelengths.y + wavelengths.z + wavelengths.w);
}

/// How the host ends paths, in ways that suit a guide.
enum class host_roulette {
  by_throughput,  ///< by twice the throughput that a path would have without a guide
  late,           ///< by half of it, and from depth 2 on
  by_radiance,    ///< by what the cache expects: guided_survival()
};

/// What the room has beside diffuse walls, and how the host traces it.
struct room {
  float fog = 0.0f;         ///< scattering events per unit of length
  bool coats = false;       ///< the walls at both ends of x are coated
  float alpha = 0.0f;       ///< positive: the walls at both ends of z are glossy, of this GGX roughness
  bool knows_alpha = true;  ///< the host tells it to the guide, or else the density at the mirrored direction
  bool open = false;        ///< there is no ceiling; light comes from the sky
  bool floor = true;        ///< without it paths leave the room into the dark
  bool silent = false;      ///< the recorder does not hear of escapes, and is not to
  bool turned = false;      ///< light comes from the opposite side, as if the lamp were moved
  host_roulette roulette = host_roulette::by_throughput;
};

/// The caster of a room.
WFPG_HD inline box_caster caster_of(const room& in) {
  return {in.open, !in.floor};
}

struct diffuse_kernel_bsdf {
  static constexpr material kind = material::diffuse;
  vec3 normal;
  room in;

  WFPG_HD vec4 eval(vec3, vec3 wi) const { return vec4(0.9f, 0.8f, 0.7f, 0.4f) * pdf({}, wi); }
  WFPG_HD float pdf(vec3, vec3 wi) const { return std::fmax(glm::dot(normal, wi), 0.0f) / wfpg::pi; }
  WFPG_HD drawn_bsdf sample(vec3 wo, float, vec2 u) const {
    const float r = std::sqrt(u.x), turn = 2.0f * wfpg::pi * u.y;
    const vec3 wi =
        wfpg::frame(normal).to_world({r * std::cos(turn), r * std::sin(turn), std::sqrt(1.0f - u.x)});
    return {wi, eval(wo, wi), pdf(wo, wi), false};
  }
  WFPG_HD wfpg::glossy_part part(vec3 wo) const {
    return wfpg::glossy_part::unknown(pdf(wo, mirrored(wo, normal)));
  }
};

/// A smooth coat that reflects a third, drawn as often, over the diffuse material.
struct coated_kernel_bsdf {
  static constexpr material kind = material::coated;
  static constexpr float coat = 1.0f / 3.0f;
  vec3 normal;
  room in;

  WFPG_HD vec4 eval(vec3 wo, vec3 wi) const { return (1.0f - coat) * base().eval(wo, wi); }
  WFPG_HD float pdf(vec3 wo, vec3 wi) const { return (1.0f - coat) * base().pdf(wo, wi); }
  WFPG_HD drawn_bsdf sample(vec3 wo, float u, vec2 u2) const {
    if (u < coat) return {mirrored(wo, normal), vec4(coat), coat, true};
    const vec3 wi = base().sample(wo, u, u2).wi;
    return {wi, eval(wo, wi), pdf(wo, wi), false};
  }
  WFPG_HD wfpg::glossy_part part(vec3) const { return {coat, 0.0f}; }

 private:
  WFPG_HD diffuse_kernel_bsdf base() const { return {normal, in}; }
};

/// GGX without Fresnel, of visible normals (Heitz 2018).
struct glossy_kernel_bsdf {
  static constexpr material kind = material::glossy;
  vec3 normal;
  room in;

  WFPG_HD vec4 eval(vec3 wo, vec3 wi) const {
    return vec4(0.9f * pdf(wo, wi) * seen(std::fmax(glm::dot(normal, wi), 1.0e-4f)));
  }
  WFPG_HD float pdf(vec3 wo, vec3 wi) const {
    if (!(glm::dot(normal, wi) > 0.0f)) return 0.0f;
    const float cosine = cosine_of(wo), along = glm::dot(normal, glm::normalize(wo + wi));
    const float square = along * along * (in.alpha * in.alpha - 1.0f) + 1.0f;
    return seen(cosine) * in.alpha * in.alpha / (wfpg::pi * square * square) / (4.0f * cosine);
  }
  WFPG_HD drawn_bsdf sample(vec3 wo, float, vec2 u) const {
    const wfpg::frame world(normal);
    const vec3 local = world.to_local(wo);
    const vec3 stretched = glm::normalize(vec3(in.alpha * local.x, in.alpha * local.y, cosine_of(wo)));
    const float plane = stretched.x * stretched.x + stretched.y * stretched.y;
    const vec3 a =
        plane > 1.0e-8f ? vec3(-stretched.y, stretched.x, 0.0f) / std::sqrt(plane) : vec3(1.0f, 0.0f, 0.0f);
    const vec3 b = glm::cross(stretched, a);
    const float r = std::sqrt(u.x), turn = 2.0f * wfpg::pi * u.y, s = 0.5f * (1.0f + stretched.z);
    const float x = r * std::cos(turn);
    const float y = (1.0f - s) * std::sqrt(1.0f - x * x) + s * r * std::sin(turn);
    const vec3 n = x * a + y * b + std::sqrt(std::fmax(1.0f - x * x - y * y, 0.0f)) * stretched;
    const vec3 half = glm::normalize(vec3(in.alpha * n.x, in.alpha * n.y, std::fmax(n.z, 1.0e-6f)));
    const vec3 wi = mirrored(wo, world.to_world(half));
    return {wi, eval(wo, wi), pdf(wo, wi), false};
  }
  WFPG_HD wfpg::glossy_part part(vec3 wo) const {
    if (in.knows_alpha) return {1.0f, in.alpha};
    return wfpg::glossy_part::unknown(pdf(wo, mirrored(wo, normal)));
  }

 private:
  WFPG_HD float cosine_of(vec3 wo) const { return std::fmax(glm::dot(normal, wo), 1.0e-4f); }
  /// Smith's masking of a direction by its cosine.
  WFPG_HD float seen(float cosine) const {
    const float tangents = in.alpha * in.alpha * (1.0f / (cosine * cosine) - 1.0f);
    return 2.0f / (1.0f + std::sqrt(1.0f + std::fmax(tangents, 0.0f)));
  }
};

/// What all kernels share.
struct wave_state {
  wfpg::array_view<host_path> paths;
  wfpg::path_recorder_view recorder;
  wfpg::testing::host_checker_view checker;
  wfpg::exitance_cache_view cache;
  std::uint32_t depth;
  std::uint64_t seed;
  room in;
  host_fault fault;

  WFPG_HD vec2 draw(std::size_t i, std::uint32_t use) const {
    return hashed_numbers{seed}(static_cast<std::uint32_t>(i), 8 * depth + use);
  }
  /// Probability with which a path goes on. `before`: its throughput before it scattered.
  WFPG_HD float survival(const host_path& path, vec3 wo, float before) const {
    const float scale = fault == host_fault::guided_roulette ? 1.0f : path.roulette_scale;
    const float unguided = mean_of(path.throughput) * scale;
    if (in.roulette == host_roulette::by_throughput) return std::fmin(2.0f * unguided, 1.0f);
    if (in.roulette == host_roulette::late) return depth < 2 ? 1.0f : std::fmin(0.5f * unguided, 1.0f);
    const wfpg::node_id leaf = cache.octree().nearest_leaf(path.position);
    if (leaf == wfpg::invalid_node) return 1.0f;
    return wfpg::guided_survival(before, cache.radiance(leaf, cache.side_facing(leaf, wo)), 0.5f);
  }
};

constexpr float sky_radiance = 5.0f;

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
    const bool escapes = !caster_of(at.in)(ray).is_hit();
    path.hit = escapes ? material::none : material_of_wall(path.normal);
    if (!escapes)
      at.recorder.vertex(i, at.depth, path.position,
                         at.fault == host_fault::normal_as_outgoing ? path.normal : -path.direction,
                         path.normal, false, mean_of(path.throughput));
    else if (!at.in.silent && at.fault != host_fault::silent_escapes)
      at.recorder.escape(i, at.depth, mean_of(path.throughput));
    // What the camera sees directly is as noisy with and without a guide.
    const float light = escapes ? at.in.open ? sky_radiance : 0.0f : light_of_wall(path.position);
    if (at.depth > 0) path.radiance += mean_of(path.throughput) * light;
    if (at.fault != host_fault::lost_light || at.depth < 2) at.recorder.total(i, at.depth, path.radiance);
    at.checker.radiance(i, path.radiance);
  }

 private:
  WFPG_HD float light_of_wall(vec3 p) const { return emitted(at.in.turned ? vec3(1.0f) - p : p); }
  WFPG_HD material material_of_wall(vec3 normal) const {
    if (at.in.coats && std::fabs(normal.x) > 0.5f) return material::coated;
    return at.in.alpha > 0.0f && std::fabs(normal.z) > 0.5f ? material::glossy : material::diffuse;
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

  WFPG_HD void operator()(std::size_t i) const {
    host_path& path = at.paths[i];
    if (path.hit != Bsdf::kind) return;
    const Bsdf bsdf{path.normal, at.in};
    const vec3 wo = -path.direction;
    const auto part = at.fault == host_fault::narrow_in_full ? wfpg::glossy_part::none() : bsdf.part(wo);
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
    const vec3 local = wfpg::frame(path.normal).to_local(drawn.wi);
    float pdf = drawn.is_delta ? mixture.delta_pdf(drawn.pdf)
                               : mixture.pdf(at.fault == host_fault::local_pdf ? local : drawn.wi, drawn.pdf);
    if (at.fault == host_fault::forgets_guide && i % 16 == 0 && drawn.pdf > 0.0f) pdf = drawn.pdf;
    if (!(pdf > 0.0f)) {
      path.hit = material::none;
      return;
    }
    const float before = mean_of(path.throughput);
    path.throughput *= drawn.value / pdf;
    path.roulette_scale *= wfpg::roulette_scale(drawn.pdf, pdf);
    path.direction = drawn.wi;
    wfpg::testing::host_step step;
    step.wi = at.fault == host_fault::local_step ? local : drawn.wi;
    step.bsdf_pdf = drawn.pdf;
    step.pdf = pdf;
    step.mirror_pdf = bsdf.pdf(wo, mirrored(wo, path.normal));
    step.cosine = glm::dot(wo, path.normal);
    step.throughput = mean_of(path.throughput);
    const float survival = at.survival(path, wo, before);
    step.survival = at.in.roulette == host_roulette::by_radiance ? 1.0f : survival;
    step.is_delta = drawn.is_delta;
    step.goes_on = at.draw(i, 4).x < survival;
    const bool tells = step.goes_on || !at.in.silent || at.fault == host_fault::early_scatter;
    if (tells && at.fault != host_fault::no_scatter)
      at.recorder.scatter(i, at.depth, at.fault == host_fault::local_scatter ? local : drawn.wi,
                          drawn.is_delta ? wfpg::no_field : mixture.number, mixture.share(drawn.wi, pdf));
    at.checker.scatter(i, at.depth, guide, mixture, step);
    // Next-event estimation would weight a ray to the lamp with this density.
    const vec3 lamp = glm::normalize(vec3(0.8f, 1.0f, 0.8f) - path.position);
    const vec3 asked = at.fault == host_fault::local_query ? wfpg::frame(path.normal).to_local(lamp) : lamp;
    const float bsdf_pdf = bsdf.pdf(wo, lamp);
    at.checker.query(i, at.depth, mixture, lamp, bsdf_pdf, mixture.pdf(asked, bsdf_pdf));
    if (step.goes_on)
      path.throughput /= survival;
    else
      path.hit = material::none;
  }
};

/// A sample of the host.
struct host_sample {
  room in;
  host_fault fault = host_fault::none;
  std::uint32_t paths = 4096;
  std::uint64_t seed = 0;
};

constexpr std::uint32_t host_depth = 5;

/// Options of a guider of the host, in the box.
inline wfpg::kept_guide_options kernel_host_options(std::uint32_t paths) {
  wfpg::kept_guide_options options;
  static_cast<wfpg::octree_guide_options&>(options) = tracing_options(paths);
  options.max_depth = host_depth;
  options.records_waves = true;
  return options;
}

/// Begins a sample and traces its paths. Ending it is left to the caller.
template <class Exec>
wfpg::buffer<host_path, Exec> trace_sample(const Exec& exec, wfpg::path_guider<Exec>& guider,
                                           const host_sample& what,
                                           const wfpg::testing::host_checker_view& checker = {}) {
  std::vector<host_path> camera(what.paths);
  random_numbers random(100);  // pixels are the same in each sample
  for (host_path& path : camera) {
    path.position = {0.5f, 0.5f, 0.5f};
    path.direction = random.direction();
    path.hit = material::fog;
  }
  wfpg::buffer<host_path, Exec> paths(exec, camera);
  guider.begin_sample();
  for (std::uint32_t depth = 0; depth < host_depth; ++depth) {
    const wave_state at{paths.view(), guider.recorder(), checker, guider.guide().cache(),
                        depth,        what.seed,         what.in, what.fault};
    exec.for_each(what.paths, find_hits{at});
    const wfpg::guide_view guide = guider.prepare(depth, caster_of(what.in));
    exec.for_each(what.paths, shade<diffuse_kernel_bsdf>{at, guide});
    exec.for_each(what.paths, shade<coated_kernel_bsdf>{at, guide});
    exec.for_each(what.paths, shade<glossy_kernel_bsdf>{at, guide});
    exec.for_each(what.paths, scatter_in_fog{at});
  }
  return paths;
}

}  // namespace wfpg_test
