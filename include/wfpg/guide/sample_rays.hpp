// Functors that sample the next direction of each ray of a wave: from a guide's view, or from its BSDF alone.
// The facade launches them; so does a host that samples some waves without a guide.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/wave.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <type_traits>

namespace wfpg {

/// Writes one ray's direction, and the density that was asked for. Its mixture is made for its surface:
/// mixture_of(surface<Bsdf>).
template <class Surfaces, class Random, class Queries>
struct serve_ray {
  Surfaces surfaces;
  Random random;
  Queries queries;
  array_view<sampled_direction> directions;

  template <class Mixtures>
  WFPG_HD void operator()(std::uint32_t ray, const Mixtures& mixture_of) const {
    const auto s = surfaces(ray);
    if (!s.active) {
      directions[ray] = {};
      answer(ray, 0.0f);
      return;
    }
    const auto mixture = mixture_of(s);
    directions[ray] = mixture.sample(s, random(ray, 0).x, random(ray, 1));
    if constexpr (!std::is_same_v<Queries, no_queries>) {
      const vec3 d = queries.query(ray);
      answer(ray, d.x != 0.0f || d.y != 0.0f || d.z != 0.0f ? mixture.pdf(s, d) : 0.0f);
    }
  }

 private:
  WFPG_HD void answer(std::uint32_t ray, float density) const {
    if constexpr (!std::is_same_v<Queries, no_queries>) queries.densities[ray] = density;
  }
};

/// What one ray draws from of a guide's view that has no mixture of its own for it.
template <class View>
struct view_of_ray {
  View view;
  std::uint32_t ray;
  template <class Bsdf>
  WFPG_HD sampled_direction sample(const surface<Bsdf>& s, float u_technique, vec2 u) const {
    return view.sample(ray, s, u_technique, u);
  }
  template <class Bsdf>
  WFPG_HD float pdf(const surface<Bsdf>& s, vec3 direction) const {
    return view.pdf(ray, s, direction);
  }
};

/// What a ray draws from at a surface.
template <class View, class Surface>
WFPG_HD auto mixture_at(const View& view, std::uint32_t ray, const Surface& s) {
  if constexpr (std::is_base_of_v<mixture_view<View>, View>)
    return view.mixture(ray, s);
  else
    return view_of_ray<View>{view, ray};
}

/// Rays of any guide.
template <class Serve, class View>
struct serve_guide_view {
  Serve serve;
  View view;
  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    serve(ray, [&](const auto& s) { return mixture_at(view, ray, s); });
  }
};

/// Rays without a bin: their BSDF alone.
template <class Serve>
struct serve_unbinned {
  Serve serve;
  array_view<const std::uint32_t> ray_keys;  // empty: no ray has a bin
  WFPG_HD void operator()(std::size_t ray) const {
    if (!ray_keys.empty() && ray_keys[ray] != 0xffffffffu) return;
    serve(static_cast<std::uint32_t>(ray), [](const auto&) { return guide_mixture{}; });
  }
};

}  // namespace wfpg
