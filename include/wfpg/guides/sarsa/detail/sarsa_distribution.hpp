// What rays draw from in one cell of a sarsa_grid: learnt radiance by direction, times the cosine at the
// surface where the sampler knows of one. Every density is that of its sampler, to rounding (Kim & Kim, "Fast
// and Lightweight Path Guiding Algorithm on GPU", 2021, section 3). Three things are wfpg's own:
//
//   The paper's normaliser, kept by cell and discretised normal, is that of another hemisphere than the
//   surface's, and densities with it are off. Here the cosine is the discretised normal's too, and a
//   direction that it allows below the surface is turned over: products over the sphere keep their sum, which
//   the kept normaliser is.
//   Rejection that has failed for long goes on by inversion of the same density, so that it ends.
//   A mixture of acceptance c + (1 - c) eps, as the paper has it, is not that of Eq. 8. Here it is Eq. 8's,
//   with its own acceptance, 1 / ((1 - eps) / c + eps).
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/normal_lattice.hpp>
#include <wfpg/base/octahedral_map.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/guides/sarsa/options.hpp>
#include <wfpg/sampling/field_sampler.hpp>

namespace wfpg {

namespace detail {

/// The sum of a cell's products for a discretised normal, and the largest sum of a direction's and its
/// opposite's.
struct sarsa_normaliser {
  std::uint64_t total = 0;
  std::uint64_t peak = 0;
};

/// B x B directions of a cell: weights that sum to about 2³¹, as they are and as a distribution's sums.
struct sarsa_cell {
  const std::uint32_t* sums = nullptr;
  const std::uint32_t* weights = nullptr;
  std::uint32_t resolution = 0;

  WFPG_HD directional_field sphere() const { return directional_field(grid_distribution(sums, resolution)); }
  WFPG_HD std::uint32_t directions() const { return resolution * resolution; }
  WFPG_HD std::uint32_t index(vec3 direction) const {
    const grid_distribution grid(sums, resolution);
    const vec2 uv = sphere_to_square(direction);
    return grid.cell_along(uv.y) * resolution + grid.cell_along(uv.x);
  }
};

/// A cell's products with a discretised normal's cosines, over the hemisphere above a normal near it.
class sarsa_products {
 public:
  sarsa_products() = default;
  /// `cosines`: of the discretised normal, a direction: in 255ths.
  WFPG_HD sarsa_products(const sarsa_cell& cell, const std::uint8_t* cosines,
                         const sarsa_normaliser& normaliser, vec3 normal)
      : cell_(cell), cosines_(cosines), normaliser_(normaliser), normal_(normal) {}

  WFPG_HD bool empty() const { return normaliser_.total == 0; }
  WFPG_HD bool is_above(vec3 d) const { return glm::dot(normal_, d) >= 0.0f; }

  /// The density of a unit direction above the surface, per steradian: that of the direction and of its
  /// opposite, which is turned over.
  WFPG_HD float pdf(vec3 d) const { return density_of(weight_at(d)); }
  /// c: the mean density over the hemisphere in units of the largest.
  WFPG_HD float acceptance() const {
    return 2.0f * static_cast<float>(normaliser_.total) /
           (static_cast<float>(normaliser_.peak) * static_cast<float>(cell_.directions()));
  }

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
  /// By rejection of p, `target` of it, and the rest of the uniform density: Eq. 8 with target = 1 - eps.
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

/// What a mixture (mis.hpp) draws from.
class sarsa_distribution {
 public:
  sarsa_distribution() = default;
  /// Radiance alone.
  WFPG_HD explicit sarsa_distribution(const sarsa_cell& cell) : cell_(cell) {}
  /// With the cosine. `sampler` is not sphere_inversion.
  WFPG_HD sarsa_distribution(const sarsa_cell& cell, const sarsa_products& products, sarsa_sampler sampler)
      : cell_(cell), products_(products), sampler_(sampler) {
    if (sampler != sarsa_sampler::mixed_rejection || products.empty()) return;
    const float c = products.acceptance();
    target_ = 1.0f - max((1.0f - 2.0f * c) / max(2.0f - 2.0f * c, 1.0e-6f), 0.0f);  // Eq. 9
  }

  WFPG_HD bool empty() const { return cell_.resolution == 0 || (!is_sphere() && products_.empty()); }
  /// It knows of no lobe but the diffuse one.
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
