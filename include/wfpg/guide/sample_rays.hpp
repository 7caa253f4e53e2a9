// Functors that sample the next direction of each ray of a wave, from a guide's view or from the BSDF alone.
// path_guider launches them. A renderer may launch them too, for waves that it samples without a guide.
//
// Source: Yalçıner & Akyüz, "Path Guiding for Wavefront Path Tracing", 2024, sections 3.5 and 4.
// Cost: one mixture a ray, made once, from which a direction and at most one density come.
// Memory: what the views refer to; a functor owns nothing.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/wave.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <type_traits>

namespace wfpg {

/// Samples one ray, whatever the guide. Trivially copyable if its members are. `Queries` is no_queries or
/// density_queries.
template <class Surfaces, class Random, class Queries>
struct sample_ray {
  Surfaces surfaces;  ///< surfaces(ray) is where the ray hit; see wave
  Random random;      ///< random(ray, 0).x chooses the technique, random(ray, 1) the direction; in [0,1)²
  Queries queries;    ///< a further direction of each ray whose density is wanted
  array_view<sampled_direction> directions;  ///< output, one element a ray

  /// Writes directions[ray], and the density of the ray's query, per steradian. `mixture_of(s)` returns the
  /// mixture at surface `s`, with `sample` and `pdf` as basic_guide_mixture has them. An inactive ray gets
  /// technique `none`, and density 0. A query of zero length gets 0 too.
  template <class Mixtures>
  WFPG_HD void operator()(std::uint32_t ray, const Mixtures& mixture_of) const {
    const auto s = surfaces(ray);
    if (!s.active) {
      directions[ray] = {};
      answer(ray, 0.0f);
      return;
    }
    // One mixture for both, since making it may search fields and sum products.
    const auto mixture = mixture_of(s);
    directions[ray] = mixture.sample(s, random(ray, 0).x, random(ray, 1));
    if constexpr (!std::is_same_v<Queries, no_queries>) {
      // A direction of zero length asks for nothing: next-event estimation chose no light.
      const vec3 d = queries.query(ray);
      answer(ray, is_finite(d) && glm::dot(d, d) > 0.0f ? mixture.pdf(s, d) : 0.0f);
    }
  }

 private:
  /// Compiles to nothing without queries.
  WFPG_HD void answer(std::uint32_t ray, float density) const {
    if constexpr (!std::is_same_v<Queries, no_queries>) queries.densities[ray] = density;
  }
};

/// Adapts a guide's view to the interface of a mixture, for one ray. Used for views that do not derive from
/// mixture_view.
template <class View>
struct view_of_ray {
  View view;          ///< a view for which is_guide_view_v holds
  std::uint32_t ray;  ///< index in the wave

  /// Samples a direction at `s`; `u_technique` in [0,1), `u` in [0,1)².
  template <class Bsdf>
  WFPG_HD sampled_direction sample(const surface<Bsdf>& s, float u_technique, vec2 u) const {
    return view.sample(ray, s, u_technique, u);
  }
  /// Density of sample(), per steradian, at a unit direction.
  template <class Bsdf>
  WFPG_HD float pdf(const surface<Bsdf>& s, vec3 direction) const {
    return view.pdf(ray, s, direction);
  }
};

/// Returns what a ray samples at a surface: view.mixture(ray, s) of a mixture_view, else a view_of_ray.
/// A mixture looks up its field once, however many densities follow.
template <class View, class Surface>
WFPG_HD auto mixture_at(const View& view, std::uint32_t ray, const Surface& s) {
  if constexpr (std::is_base_of_v<mixture_view<View>, View>)
    return view.mixture(ray, s);
  else
    return view_of_ray<View>{view, ray};
}

/// Kernel that samples each ray from a guide's view.
template <class Sampler, class View>
struct sample_guide_view {
  Sampler sampler;  ///< a sample_ray
  View view;        ///< what Guide::prepare() returned for this wave

  /// Samples ray `i` of the wave.
  WFPG_HD void operator()(std::size_t i) const {
    const auto ray = static_cast<std::uint32_t>(i);
    sampler(ray, [&](const auto& s) { return mixture_at(view, ray, s); });
  }
};

/// Kernel that samples rays from their BSDFs alone: all rays, or those without a bin.
template <class Sampler>
struct sample_bsdf {
  Sampler sampler;  ///< a sample_ray
  /// Bin of each ray, 0xffffffff for none. Empty: no ray has a bin.
  array_view<const std::uint32_t> ray_keys;

  /// Samples ray `ray`, unless it has a bin.
  WFPG_HD void operator()(std::size_t ray) const {
    // Rays that have a bin are sampled by a kernel of their own.
    if (!ray_keys.empty() && ray_keys[ray] != 0xffffffffu) return;
    sampler(static_cast<std::uint32_t>(ray), [](const auto&) { return guide_mixture{}; });
  }
};

}  // namespace wfpg
