// The host's kernels, in the order in which a wave runs them. What wfpg needs of a kernel stands in
// #if KERNELS_GUIDE; without it, each kernel is that of a path tracer. What the check of the host needs
// stands in #if KERNELS_CHECK.
#pragma once

#include "path.hpp"

#include <cmath>

#if KERNELS_GUIDE
#include <wfpg/path_guider.hpp>
#include <wfpg/sampling/roulette.hpp>
#endif
#if KERNELS_CHECK
#include <wfpg/testing/check_host.hpp>
#endif

namespace kernels {

struct start_paths {
  wave at;
  render::pinhole camera;

  KERNELS_BOTH void operator()(std::size_t i) const {
    const auto id = static_cast<std::uint32_t>(i);
    path begun;
    begun.next = camera.through(id, at.random(id, render::dimension::pixel));
    begun.waves = wavelengths(at.draw(id, path_numbers::of_wavelengths).x);
    at.paths[i] = begun;
  }
};

struct write_rays {
  wave at;

  KERNELS_BOTH void operator()(std::size_t i) const {
    at.rays[i] = at.paths[i].active ? at.paths[i].next : no_ray();
  }
};

/// Finds where each path goes on: a surface, the fog before it, or nowhere. Adds what is emitted there.
struct find_vertices {
  wave at;
#if KERNELS_GUIDE
  wfpg::path_recorder_view recorder;
#endif

  KERNELS_BOTH void operator()(std::size_t i) const {
    at.queues[i] = no_queue;
    path& p = at.paths[i];
    if (!p.active) return;
    const triangle_hit hit = at.hits[i];
    if (at.fog > 0.0f) {
      const float u = at.draw(static_cast<std::uint32_t>(i), path_numbers::of_fog).x;
      const float free = -std::log(1.0f - u) / at.fog;
      const bool is_reached =
          hit.is_hit() && glm::length(at.scene.point(hit).position - p.next.origin) <= free;
      if (!is_reached) return enter_fog(i, free);
    }
    if (!hit.is_hit()) return leave(i);
    enter_surface(i, at.scene.surface(hit, -p.next.direction));
  }

 private:
  KERNELS_BOTH void enter_fog(std::size_t i, float distance) const {
    const path& p = at.paths[i];
    if (at.is_last()) return end(i);
    at.vertices[i].position = p.next.origin + distance * p.next.direction;
    at.queues[i] = fog_queue;
  }

  KERNELS_BOTH void leave(std::size_t i) const {
    const path& p = at.paths[i];
    const vec3 direction = p.next.direction;
    const float lights_pdf = at.lights.environment_pdf(at.scene.environment, direction);
#if KERNELS_GUIDE
    recorder.escape(i, at.depth, mean_of(p.throughput));
#endif
    gather(i, at.scene.environment.radiance(direction), lights_pdf);
    end(i);
  }

  KERNELS_BOTH void enter_surface(std::size_t i, const render::hit_surface& found) const {
    path& p = at.paths[i];
    p.has_met_surface = true;
    const auto& surface = found.surface;
    const render::bsdf& scatters = surface.bsdf;
    const float distance = glm::length(surface.position - p.next.origin);
    p.throughput *= p.waves.of(glm::exp(-found.absorption * distance));
#if KERNELS_GUIDE
    if (scatters.is_delta())
      recorder.vertex(i, at.depth, surface.position, surface.outgoing, mean_of(p.throughput));
    else
      recorder.vertex(i, at.depth, surface.position, surface.outgoing, scatters.normal, scatters.transmits(),
                      mean_of(p.throughput));
#endif
    if (found.emission != vec3(0.0f)) {
      const float cosine = std::abs(glm::dot(surface.geometric_normal, p.next.direction));
      gather(i, found.emission,
             render::solid_angle_pdf(at.lights.pdf(found.emitted_luminance), distance, cosine));
    }
    if (at.is_last()) return end(i);
    at.vertices[i] = {surface.position,
                      scatters.normal,
                      surface.geometric_normal,
                      surface.outgoing,
                      {p.waves.of(scatters.colour), scatters.alpha, scatters.ior},
                      found.offset};
    at.queues[i] = static_cast<std::uint32_t>(scatters.kind);
  }

  KERNELS_BOTH void end(std::size_t i) const {
    at.paths[i].active = false;
  }

  /// Adds light that the path's direction found. `lights_pdf`: with which next-event estimation at the vertex
  /// before could have found it, per steradian.
  KERNELS_BOTH void gather(std::size_t i, const vec3& emitted, float lights_pdf) const {
    path& p = at.paths[i];
    const bool is_rivalled = p.pdf > 0.0f && lights_pdf > 0.0f;
    const float weight = is_rivalled ? mis_weight(p.pdf, lights_pdf) : 1.0f;
    const spectrum found = p.throughput * p.waves.of(emitted) * weight;
    p.radiance += found;
#if KERNELS_GUIDE
    recorder.emission(i, at.depth, mean_of(found));
#endif
  }
};

/// Which paths have their vertex in a queue.
struct is_in_queue {
  const std::uint32_t* queues;
  std::uint32_t wanted;

  KERNELS_BOTH bool operator()(std::uint32_t i) const { return queues[i] == wanted; }
};

/// Takes back the shadow rays of the depth before.
struct ask_nothing {
  wave at;

  KERNELS_BOTH void operator()(std::size_t i) const {
    at.rays[i] = no_ray();
    at.shadows[i] = spectrum(0.0f);
  }
};

/// Asks whether a light is visible from `from`. `radiance`: what then reaches the pixel.
KERNELS_BOTH inline void ask(const wave& at, std::uint32_t id, vec3 from, const render::light_sample& light,
                             const spectrum& radiance) {
  ray& shadow = at.rays[id];
  shadow = {};
  shadow.origin = from;
  shadow.direction = light.direction;
  if (!light.is_distant) {
    shadow.t_max = glm::length(light.end - from);
    if (shadow.t_max > 0.0f) shadow.direction = (light.end - from) / shadow.t_max;
  }
  const float clear = at.fog > 0.0f ? std::exp(-at.fog * shadow.t_max) : 1.0f;
  at.shadows[id] = clear * radiance;
}

/// State of a material's kernel at one vertex.
template <class Bsdf>
struct shading {
  std::uint32_t id;
  const vertex& v;
  Bsdf bsdf;
  render::frame local;
  vec3 wo;  ///< in the surface's frame
  path_numbers walks;
  drawn_direction drawn;  ///< in which the path goes on
  float pdf = 0.0f;       ///< with which the host drew it; of a delta lobe its probability
#if KERNELS_GUIDE
  wfpg::kernel_mixture mixture;
#endif

  KERNELS_BOTH shading(const wave& at, std::uint32_t path_id)
      : id(path_id),
        v(at.vertices[path_id]),
        local(v.normal),
        wo(local.to_local(v.wo)),
        walks(at.random, path_id, at.depth) {
    bsdf.in = v.in;
  }

  /// Whether light can pass between wo and a direction: both normals put it on one side.
  KERNELS_BOTH bool can_pass(vec3 wi, vec3 direction) const {
    return (wi.z > 0.0f) == (glm::dot(v.geometric_normal, direction) > 0.0f);
  }
  /// The density with which a direction is drawn. `bsdf_pdf`: the BSDF's own.
  KERNELS_BOTH float density(vec3 direction, float bsdf_pdf) const {
#if KERNELS_GUIDE
    if (mixture.fraction > 0.0f) return mixture.pdf(direction, bsdf_pdf);
#endif
    (void)direction;
    return bsdf_pdf;
  }
};

/// Kernel of one material: samples a light, and the direction in which the path goes on.
template <class Bsdf>
struct shade {
  wave at;
  const std::uint32_t* queue;
  std::uint32_t roulette_depth;
#if KERNELS_GUIDE
  wfpg::guide_view guide;
  wfpg::path_recorder_view recorder;
#endif
#if KERNELS_CHECK
  wfpg::testing::host_checker_view checker;
#endif

  KERNELS_BOTH void operator()(std::size_t slot) const {
    shading<Bsdf> s(at, queue[slot]);
#if KERNELS_GUIDE
    const float highest = peak(s.bsdf, s.wo, s.walks);
    if constexpr (!Bsdf::is_delta) s.mixture = guide.mixture(s.id, glossy_part_of(s, highest));
#endif
    if constexpr (!Bsdf::is_delta) sample_light(s);
    path& p = at.paths[s.id];
    p.active = scatter(s, p);
    if (!p.active) return;
    const float survival = survival_of(p);
    p.active = at.draw(s.id, render::dimension::roulette).x < survival;
#if KERNELS_CHECK
    checker.scatter(s.id, at.depth, guide, s.mixture,
                    {p.next.direction, s.drawn.pdf, s.pdf, highest, std::abs(s.wo.z), mean_of(p.throughput),
                     survival, s.drawn.is_delta, p.active});
#endif
    p.throughput /= survival;
  }

 private:
#if KERNELS_GUIDE
  KERNELS_BOTH static wfpg::glossy_part glossy_part_of(const shading<Bsdf>& s, float highest) {
    if constexpr (Bsdf::kind == varnish::kind) return {s.bsdf.narrow(s.wo), 0.0f};
    return wfpg::glossy_part::unknown(highest);
  }
#endif

  KERNELS_BOTH void sample_light(shading<Bsdf>& s) const {
    const render::light_sample light =
        at.lights.sample(at.scene, s.v.position, [&](std::uint32_t use) { return at.draw(s.id, use); });
    const vec3 wi = s.local.to_local(light.direction);
    if (!(light.pdf > 0.0f) || !s.can_pass(wi, light.direction)) return;
    const spectrum value = s.bsdf.value(s.wo, wi, s.walks);
    if (!(mean_of(value) > 0.0f)) return;
    const float bsdf_pdf = s.bsdf.density(s.wo, wi, s.walks), pdf = s.density(light.direction, bsdf_pdf);
#if KERNELS_CHECK
    checker.query(s.id, at.depth, s.mixture, light.direction, bsdf_pdf, pdf);
#endif
    const float weight = light.is_delta ? 1.0f : mis_weight(light.pdf, pdf);
    const path& p = at.paths[s.id];
    ask(at, s.id, render::leave_surface(s.v.position, s.v.geometric_normal, light.direction, s.v.offset),
        light, p.throughput * value * p.waves.of(light.radiance) * (weight / light.pdf));
  }

  /// Draws the direction in which a path goes on. False: it ends.
  KERNELS_BOTH bool scatter(shading<Bsdf>& s, path& p) const {
    float u = at.draw(s.id, render::dimension::direction).x;
    const vec2 u2 = at.draw(s.id, render::dimension::direction + 1);
    drawn_direction& drawn = s.drawn;
    vec3 direction;
#if KERNELS_GUIDE
    if (s.mixture.choose(u)) {
      direction = s.mixture.sample(u2);
      drawn.wi = s.local.to_local(direction);
    } else
#endif
    {
      drawn = s.bsdf.draw(s.wo, u, u2, s.walks);
      direction = glm::normalize(s.local.to_world(drawn.wi));
    }
    if (!drawn.is_delta) drawn.pdf = s.bsdf.density(s.wo, drawn.wi, s.walks);
    // A direction that the BSDF did not draw has no weight.
    const bool has_weight = mean_of(drawn.weight) > 0.0f;
    const spectrum value = has_weight ? drawn.weight * drawn.pdf : s.bsdf.value(s.wo, drawn.wi, s.walks);
    if (!(mean_of(value) > 0.0f) || !s.can_pass(drawn.wi, direction)) return false;
    s.pdf = drawn.is_delta ? drawn.pdf : s.density(direction, drawn.pdf);
#if KERNELS_GUIDE
    if (drawn.is_delta) s.pdf = s.mixture.delta_pdf(drawn.pdf);
    p.scale *= wfpg::roulette_scale(drawn.pdf, s.pdf);
    recorder.scatter(s.id, at.depth, direction, drawn.is_delta ? wfpg::no_field : s.mixture.number);
#endif
    p.throughput *= value / s.pdf;
    p.pdf = drawn.is_delta ? 0.0f : s.pdf;
    p.next = {};
    p.next.origin = render::leave_surface(s.v.position, s.v.geometric_normal, direction, s.v.offset);
    p.next.direction = direction;
    // Roulette ignores that refraction compresses radiance, since paths that leave again undo it.
    if (s.wo.z * drawn.wi.z < 0.0f) {
      const float eta = s.v.in.eta(s.wo);
      p.scale *= eta * eta;
    }
    return true;
  }

  /// Probability with which roulette lets a path go on. It spares those that bring a tenth of what arrives.
  KERNELS_BOTH float survival_of(const path& p) const {
    if (at.depth < roulette_depth) return 1.0f;
    return glm::min(1.0f, 10.0f * mean_of(p.throughput) * p.scale);
  }
};

/// Kernel of the fog, which scatters all light alike in all directions.
struct scatter_in_fog {
  wave at;
  const std::uint32_t* queue;

  KERNELS_BOTH void operator()(std::size_t slot) const {
    constexpr float phase = 1.0f / (4.0f * pi);
    const std::uint32_t id = queue[slot];
    path& p = at.paths[id];
    const vec3 from = at.vertices[id].position;
    const render::light_sample light =
        at.lights.sample(at.scene, from, [&](std::uint32_t use) { return at.draw(id, use); });
    if (light.pdf > 0.0f) {
      const float weight = light.is_delta ? 1.0f : mis_weight(light.pdf, phase);
      ask(at, id, from, light, p.throughput * p.waves.of(light.radiance) * (phase * weight / light.pdf));
    }
    const vec2 u = at.draw(id, render::dimension::direction);
    const float z = 1.0f - 2.0f * u.x, r = std::sqrt(glm::max(0.0f, 1.0f - z * z)), turn = 2.0f * pi * u.y;
    p.next = {};
    p.next.origin = from;
    p.next.direction = {r * std::cos(turn), r * std::sin(turn), z};
    p.pdf = phase;
  }
};

/// Kernel of next-event estimation: adds the light that shadow rays did not find hidden.
struct add_light {
  wave at;
#if KERNELS_GUIDE
  wfpg::path_recorder_view recorder;
#endif

  KERNELS_BOTH void operator()(std::size_t i) const {
    const spectrum radiance = at.shadows[i];
    if (at.hidden[i] != 0 || !(mean_of(radiance) > 0.0f)) return;
    path& p = at.paths[i];
    p.radiance += radiance;
#if KERNELS_GUIDE
    // The recorder has no vertex for light that the fog scatters toward the camera.
    if (!p.has_met_surface) p.unrecorded += mean_of(radiance);
    recorder.total(i, at.depth, mean_of(p.radiance) - p.unrecorded);
#endif
  }
};

/// The colours that a sample's paths brought to their pixels.
struct write_colours {
  wave at;
  vec3* colours;
#if KERNELS_CHECK
  wfpg::testing::host_checker_view checker;
#endif

  KERNELS_BOTH void operator()(std::size_t i) const {
#if KERNELS_CHECK
    const path& p = at.paths[i];
    checker.radiance(i, mean_of(p.radiance) - p.unrecorded);
#endif
    colours[i] = at.paths[i].waves.to_colour(at.paths[i].radiance);
  }
};

}  // namespace kernels
