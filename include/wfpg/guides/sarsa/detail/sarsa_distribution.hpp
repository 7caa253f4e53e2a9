// The distribution that rays sample in one cell of a sarsa_grid: learnt radiance by direction, times the
// cosine at the surface for all samplers but sphere_inversion. Every density is that of its sampler, to
// rounding.
//
// Source: Kim & Kim, "Fast and Lightweight Path Guiding Algorithm on GPU", 2021, section 3. Three things are
// wfpg's own:
//
// - The paper keeps normalisers by cell and discretised normal. They belong to another hemisphere than the
//   surface's, so that densities are off. Here the cosines are those of the discretised normal, too. A
//   direction below the surface is flipped. So products over the sphere keep their sum, the normaliser.
// - Rejection that failed 1024 times continues by inversion of the same density, so that it ends.
// - The paper's acceptance c + (1 - c) eps is not that of the mixture of Eq. 8. Here the mixture is that of
//   Eq. 8, with its own acceptance, 1 / ((1 - eps) / c + eps).
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/normal_lattice.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/guides/sarsa/options.hpp>
#include <wfpg/sampling/field_sampler.hpp>

namespace wfpg {

namespace detail {

/// Normaliser of a cell's products for one discretised normal. 16 bytes.
struct sarsa_normaliser {
  std::uint64_t total = 0;  ///< sum of the products of all directions
  std::uint64_t peak = 0;   ///< largest sum of a direction's product and its opposite's
};

/// The B x B directions of a cell. Their weights sum to about 2³¹.
struct sarsa_cell {
  const std::uint32_t* sums = nullptr;     ///< words of a grid_distribution of the weights
  const std::uint32_t* weights = nullptr;  ///< weight of each direction
  std::uint32_t resolution = 0;            ///< B

  WFPG_HD directional_field sphere() const { return directional_field(grid_distribution(sums, resolution)); }
  WFPG_HD std::uint32_t directions() const { return resolution * resolution; }
  WFPG_HD std::uint32_t index(vec3 direction) const {
    return grid_distribution(sums, resolution).cell_of(sphere_to_square(direction));
  }
};

/// Products of a cell's weights with the cosines to a discretised normal, flipped into the hemisphere above
/// the surface's own normal.
class sarsa_products {
 public:
  sarsa_products() = default;
  /// `cosines` and `normaliser` are those of the discretised normal; a cosine of each direction, in 255ths.
  /// `normal` is the surface's, of unit length.
  WFPG_HD sarsa_products(const sarsa_cell& cell, const std::uint8_t* cosines,
                         const sarsa_normaliser& normaliser, vec3 normal)
      : cell_(cell), cosines_(cosines), normaliser_(normaliser), normal_(normal) {}

  WFPG_HD bool empty() const { return normaliser_.total == 0; }
  WFPG_HD bool is_above(vec3 d) const { return glm::dot(normal_, d) >= 0.0f; }

  /// Density of a unit direction above the surface, per steradian. It is the sum of the direction's and of
  /// its opposite's, which is flipped onto it.
  WFPG_HD float pdf(vec3 d) const { return density_of(weight_at(d)); }
  /// The paper's c: mean density over the hemisphere, divided by the largest.
  WFPG_HD float acceptance() const {
    return 2.0f * static_cast<float>(normaliser_.total) /
           (static_cast<float>(normaliser_.peak) * static_cast<float>(cell_.directions()));
  }

  /// Samples a direction by inversion: a linear search over all products, O(B²).
  WFPG_HD vec3 invert(vec2 u) const {
    const auto scaled = static_cast<std::uint64_t>(u.x * 0x1p24f) * normaliser_.total;
    const std::uint64_t target = scaled >> 24;
    std::uint64_t before = 0, weight = product(0);
    std::uint32_t i = 0;
    while (before + weight <= target) {
      before += weight;
      weight = product(++i);
    }
    const float rest = static_cast<float>(scaled & 0xffffffu) * 0x1p-24f;
    const float inside = (static_cast<float>(target - before) + rest) / static_cast<float>(weight);
    const vec2 uv{static_cast<float>(i % cell_.resolution) + inside_cell(inside),
                  static_cast<float>(i / cell_.resolution) + inside_cell(u.y)};
    return above(square_to_sphere(uv / static_cast<float>(cell_.resolution)));
  }
  /// Samples a direction by rejection from the uniform hemisphere. Its density is that of Eq. 8: `target` is
  /// 1 - eps, the fraction of pdf(), and the uniform density has the rest.
  WFPG_HD vec3 reject(vec2 u, float target) const {
    const frame around(normal_);
    const float peak = target / acceptance() + (1.0f - target);
    std::uint64_t state = hash(float_bits(u.x), float_bits(u.y));
    for (int i = 0; i < most_tries; ++i) {
      const vec3 d = above(around.to_world(square_to_hemisphere(u)));
      state = mix_bits(state + 0x9e3779b97f4a7c15ull);
      const float eta = unit_float(static_cast<std::uint32_t>(state));
      if (eta * peak < target * (2.0f * pi) * pdf(d) + (1.0f - target)) return d;
      state = mix_bits(state + 0x9e3779b97f4a7c15ull);
      u = unit_vec2(state);
    }
    state = mix_bits(state + 0x9e3779b97f4a7c15ull);
    const bool is_uniform = unit_float(static_cast<std::uint32_t>(state)) >= target;
    return is_uniform ? above(around.to_world(square_to_hemisphere(u))) : invert(u);
  }

 private:
  static constexpr int most_tries = 1024;

  WFPG_HD vec3 above(vec3 d) const { return is_above(d) ? d : -d; }
  WFPG_HD std::uint64_t product(std::uint32_t i) const {
    return std::uint64_t(cell_.weights[i]) * cosines_[i];
  }
  WFPG_HD std::uint64_t weight_at(vec3 d) const { return product(cell_.index(d)) + product(cell_.index(-d)); }
  WFPG_HD float density_of(std::uint64_t weight) const {
    return static_cast<float>(weight) / static_cast<float>(normaliser_.total) *
           (static_cast<float>(cell_.directions()) / (4.0f * pi));
  }

  sarsa_cell cell_;
  const std::uint8_t* cosines_ = nullptr;
  sarsa_normaliser normaliser_;
  vec3 normal_{0.0f, 0.0f, 1.0f};
};

/// Distribution of directions for a mixture (sampling/mixture.hpp).
class sarsa_distribution {
 public:
  /// An empty distribution.
  sarsa_distribution() = default;
  /// Radiance alone, over the sphere.
  WFPG_HD explicit sarsa_distribution(const sarsa_cell& cell) : cell_(cell) {}
  /// Radiance times cosine. Precondition: `sampler` is not sphere_inversion.
  WFPG_HD sarsa_distribution(const sarsa_cell& cell, const sarsa_products& products, sarsa_sampler sampler)
      : cell_(cell), products_(products), sampler_(sampler) {
    if (sampler != sarsa_sampler::mixed_rejection || products.empty()) return;
    const float c = products.acceptance();
    target_ = 1.0f - max((1.0f - 2.0f * c) / max(2.0f - 2.0f * c, 1.0e-6f), 0.0f);  // Eq. 9
  }

  WFPG_HD bool empty() const { return cell_.resolution == 0 || (!is_sphere() && products_.empty()); }
  /// GGX roughness that it resolves: that of fields, since it accounts for the diffuse lobe alone.
  WFPG_HD static constexpr float resolved_alpha() { return directional_field::resolved_alpha(); }

  WFPG_HD vec3 sample(vec2 u, float& density) const {
    if (is_sphere()) return cell_.sphere().sample(u, density);
    const vec3 d =
        sampler_ == sarsa_sampler::hemisphere_inversion ? products_.invert(u) : products_.reject(u, target_);
    density = pdf(d);
    return d;
  }
  WFPG_HD float pdf(vec3 d) const {
    if (is_sphere()) return cell_.sphere().pdf(d);
    if (!products_.is_above(d)) return 0.0f;
    return target_ * products_.pdf(d) + (1.0f - target_) / (2.0f * pi);
  }

 private:
  WFPG_HD bool is_sphere() const { return sampler_ == sarsa_sampler::sphere_inversion; }

  sarsa_cell cell_;
  sarsa_products products_;
  sarsa_sampler sampler_ = sarsa_sampler::sphere_inversion;
  float target_ = 1.0f;
};

}  // namespace detail
}  // namespace wfpg
