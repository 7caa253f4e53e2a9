// What happens to a field once it is made: the rays of its bin are served from scratch, or it is kept for one
// depth.
#pragma once

#include <wfpg/guide_view.hpp>
#include <wfpg/mis.hpp>
#include <wfpg/radiance_field.hpp>
#include <wfpg/spatial_binner.hpp>
#include <wfpg/wave.hpp>

#include <type_traits>

namespace wfpg::detail {

/// The share of guided samples of a bin: more where enough rays share it for its field to fit them.
struct mixture_fraction {
  float with_enough_rays;
  float with_few_rays;
  std::uint32_t enough;
  WFPG_HD float operator()(std::uint32_t rays) const {
    return rays >= enough ? with_enough_rays : with_few_rays;
  }
};

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

/// A ray whose field is in memory.
template <class Serve>
struct serve_field {
  Serve serve;
  resident_fields fields;
  WFPG_HD void operator()(std::size_t ray, std::uint32_t field) const {
    serve(static_cast<std::uint32_t>(ray), [&](const auto&) { return fields.mixture(field); });
  }
};

/// The same with its product.
template <class Serve>
struct serve_product {
  Serve serve;
  resident_fields fields;
  WFPG_HD void operator()(std::size_t ray, std::uint32_t field) const {
    std::uint32_t words[max_product_words];
    serve(static_cast<std::uint32_t>(ray), [&](const auto& s) { return fields.product(field, s, words); });
  }
};

/// Rays of a view: serve(ray, field).
template <class Serve>
struct serve_view {
  Serve serve;
  guide_view view;
  WFPG_HD void operator()(std::size_t ray) const { serve(ray, view.number(static_cast<std::uint32_t>(ray))); }
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

/// Fields in scratch memory, gone when their rays are served.
template <class Serve>
struct transient_sink {
  bins_view bins;
  Serve serve;
  mixture_fraction fraction;
  std::uint32_t resolution;
  product_points points;

  std::size_t scratch_bytes() const {
    const std::uint32_t words = grid_distribution::words(resolution) + points.resolution * points.resolution;
    return sizeof(std::uint32_t) * words + 32;
  }

  template <class Block>
  WFPG_HD std::uint32_t* words(Block& block, std::size_t) const {
    return block.template scratch<std::uint32_t>(grid_distribution::words(resolution));
  }
  template <class Block>
  WFPG_HD void finish(Block& block, std::size_t bin, const directional_field& field) const {
    const float share = fraction(bins.size(bin));
    const std::uint32_t* const rays = bins.permutation.data() + bins.begin(bin);
    const std::uint32_t* const sums = sum_blocks_of(block, field.grid());
    block.for_each(static_cast<int>(bins.size(bin)), [&](int i) {
      if (points.resolution == 0) {
        serve(rays[i], [&](const auto&) { return guide_mixture{field, share}; });
        return;
      }
      std::uint32_t words[max_product_words];
      serve(rays[i], [&](const auto& s) -> product_mixture {
        return {multiply(field, points, s, words, sums), share};
      });
    });
  }

 private:
  /// For all of the bin's rays, in scratch memory.
  template <class Block>
  WFPG_HD const std::uint32_t* sum_blocks_of(Block& block, const grid_distribution& grid) const {
    const std::uint32_t p = points.resolution, side = p > 0 ? grid.resolution() / p : 0;
    std::uint32_t* const sums = block.template scratch<std::uint32_t>(std::size_t(p) * p);
    block.for_each(static_cast<int>(p * p), [&](int i) {
      const auto k = static_cast<std::uint32_t>(i);
      sums[i] = grid.weight({k % p * side, k / p * side, side});
    });
    block.sync();
    return sums;
  }
};

/// Fields in memory of their own, and for each ray which is its.
struct resident_sink {
  bins_view bins;
  std::uint32_t* storage;
  resident_field* fields;
  std::uint32_t* field_of_ray;
  mixture_fraction fraction;
  std::uint32_t resolution;

  static std::size_t scratch_bytes() { return 0; }

  template <class Block>
  WFPG_HD std::uint32_t* words(Block&, std::size_t bin) const {
    return storage + bin * grid_distribution::words(resolution);
  }
  template <class Block>
  WFPG_HD void finish(Block& block, std::size_t bin, const directional_field& field) const {
    const std::uint32_t begin = bins.begin(bin);
    block.for_each(static_cast<int>(bins.size(bin)), [&](int i) {
      if (i == 0) fields[bin] = {field.hemisphere() ? field.normal() : vec3(0.0f), fraction(bins.size(bin))};
      field_of_ray[bins.permutation[begin + static_cast<std::uint32_t>(i)]] = static_cast<std::uint32_t>(bin);
    });
  }
};

/// Whether a field can have the normal: of about unit length.
WFPG_HD inline bool is_normal(vec3 n) {
  const float square = glm::dot(n, n);
  return is_finite(square) && square > 0.25f && square < 4.0f;
}

/// Whether a guide that knows directions by place and normal has something to say of a surface.
template <class Bsdf>
WFPG_HD bool can_be_guided(const surface<Bsdf>& s) {
  return !s.bsdf.is_delta() && is_finite(s.position) && is_normal(s.normal);
}

/// A wave's rays as the binner wants them. Delta surfaces are sampled alone and need no bin; those whose
/// normal is none have none, as if they lay outside every voxel.
template <class Surfaces>
struct wave_rays {
  Surfaces surfaces;
  guiding_mode mode;
  WFPG_HD ray_to_bin operator()(std::size_t i) const {
    const auto s = surfaces(static_cast<std::uint32_t>(i));
    ray_to_bin result;
    result.active = s.active && !s.bsdf.is_delta();
    if (!result.active) return result;
    result.position = is_normal(s.normal) ? s.position : vec3(bits_float(0x7fc00000u));
    if (mode == guiding_mode::oriented)
      result.orientation = s.bsdf.transmits() ? static_cast<std::uint32_t>(orientation_transmits)
                                              : dominant_axis(facing_normal(s));
    return result;
  }
};

}  // namespace wfpg::detail
