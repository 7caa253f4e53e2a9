// The fields of one depth of a wave, as a renderer's own kernels see them. For renderers whose BSDFs exist
// only inside their material kernels. path_guider::prepare returns it, over kept fields or over transient
// ones that were made resident.
//
// The fused form draws the same directions from the same random numbers. They differ by rounding where a
// compiler contracts the arithmetic of two kernels differently, as nvcc does.
//
// Source: Yalciner and Akyuz (2024), sections 3.5 and 3.6. Cost: O(log F) a direction and O(1) a density, and
// the BSDF. Products: P^2 to 2 P^2 evaluations of the BSDF a ray. Memory: 16 bytes and 4 (F^2 + F) a field, 4
// bytes a ray.
#pragma once

#include <wfpg/base/math.hpp>
#include <wfpg/base/types.hpp>
#include <wfpg/sampling/mixture.hpp>
#include <wfpg/sampling/product_sampler.hpp>

namespace wfpg {

/// Frame and fractions of a field in memory, beside its distribution. 16 bytes, so that a kernel reads it in
/// one load.
struct alignas(16) resident_field {
  /// Of the hemisphere that the field covers, unit length; zero: it covers the sphere.
  vec3 normal{0.0f};
  /// Fraction of guided directions on smooth surfaces, in 1/65535. 0: the field is not built.
  std::uint16_t smooth = 0;
  /// That of narrow surfaces (guide_share), before their lobes reduce it.
  std::uint16_t narrow = 0;

  /// A field that is not built, and guides nothing.
  resident_field() = default;
  /// A field with one fraction, above 0 and at most 1, for surfaces of both kinds.
  WFPG_HD resident_field(vec3 of_hemisphere, float fraction) : normal(of_hemisphere) {
    set_fractions(fraction, fraction);
  }

  /// True: the field covers a hemisphere; false: the sphere.
  WFPG_HD bool hemisphere() const { return normal.x != 0.0f || normal.y != 0.0f || normal.z != 0.0f; }
  /// Whether the field has a distribution.
  WFPG_HD bool is_built() const { return smooth > 0; }
  /// Fraction of guided directions on smooth surfaces, in [0, 1].
  WFPG_HD float fraction() const { return static_cast<float>(smooth) * (1.0f / 65535.0f); }
  /// Fraction of guided directions on narrow surfaces, in [0, 1], before their lobes reduce it.
  WFPG_HD float narrow_fraction() const { return static_cast<float>(narrow) * (1.0f / 65535.0f); }
  /// Sets both fractions, each above 0 and at most 1. The field then counts as built.
  WFPG_HD void set_fractions(float of_smooth, float of_narrow) {
    smooth = stored(of_smooth);
    narrow = stored(of_narrow);
  }

 private:
  // 0 would say that there is no field, and 1 that the BSDF never draws.
  WFPG_HD static std::uint16_t stored(float fraction) {
    const float steps = clamp(fraction * 65535.0f + 0.5f, 1.0f, fraction < 1.0f ? 65534.0f : 65535.0f);
    return static_cast<std::uint16_t>(steps);
  }
};

/// Fields in memory, with their distributions. Trivially copyable.
struct resident_fields {
  /// One entry a field: frame and fractions.
  const resident_field* fields = nullptr;
  /// Distributions, one after the other, grid_distribution::words(F) words each.
  const std::uint32_t* words = nullptr;
  std::uint32_t resolution = 0;  ///< F: cells along a field's side
  /// Where this wave's products evaluate BSDFs; a P of 0: no products.
  product_points points;

  /// Returns frame and fractions of field `i`. no_field is not built. Precondition: i is in range, or
  /// no_field.
  WFPG_HD resident_field info(std::uint32_t i) const { return i == no_field ? resident_field{} : fields[i]; }
  /// Returns field `i` for sampling. `what`: info(i), which the caller has read already.
  WFPG_HD directional_field field(std::uint32_t i, const resident_field& what) const {
    const grid_distribution grid(words + std::size_t(i) * grid_distribution::words(resolution), resolution);
    return what.hemisphere() ? directional_field(grid, what.normal) : directional_field(grid);
  }
  /// Mixture of field `i` and a BSDF, without products. Where the field guides nothing, the BSDF alone.
  WFPG_HD guide_mixture mixture(std::uint32_t i) const {
    const resident_field what = info(i);
    if (!what.is_built()) return {};
    return {field(i, what), what.fraction(), i, what.narrow_fraction()};
  }
  /// Mixture of the BSDF and of its product with field `i`. Evaluates the BSDF P² to 2 P² times.
  ///
  /// `weights`: room for P² words, which the mixture reads as long as it lives. Precondition:
  /// points.resolution > 0.
  template <class Bsdf>
  WFPG_HD product_mixture product(std::uint32_t i, const surface<Bsdf>& s, std::uint32_t* weights) const {
    const resident_field what = info(i);
    if (!what.is_built()) return {};
    return {multiply_field(field(i, what), points, s, weights), what.fraction(), i, what.narrow_fraction()};
  }
};

/// Samples directions for the rays of one wave, by ray number. Trivially copyable; valid until the guider's
/// next call. With products, each ray samples its field times its BSDF.
class guide_view {
 public:
  /// A view that guides no ray: each ray samples its BSDF.
  guide_view() = default;
  /// `field_of_ray`: the number of each ray's field, or no_field. `fields`: those fields.
  WFPG_HD guide_view(array_view<const std::uint32_t> field_of_ray, const resident_fields& fields)
      : field_of_ray_(field_of_ray), fields_(fields) {}

  /// Whether the ray has a field that guides. Without one, it samples its BSDF alone. O(1).
  WFPG_HD bool guides(std::uint32_t ray) const { return fields_.info(number(ray)).is_built(); }
  /// Number of the ray's field among fields(), or no_field. A ray beyond the wave has none.
  WFPG_HD std::uint32_t number(std::uint32_t ray) const {
    return ray < field_of_ray_.size() ? field_of_ray_[ray] : no_field;
  }
  /// The fields that rays sample.
  WFPG_HD const resident_fields& fields() const { return fields_; }

  /// P, or 0 without products.
  WFPG_HD std::uint32_t product_resolution() const { return fields_.points.resolution; }

  /// Mixture of a ray's field and BSDF, without products. A ray without a field samples its BSDF alone.
  WFPG_HD guide_mixture mixture(std::uint32_t ray) const { return fields_.mixture(number(ray)); }
  /// Mixture of a ray's field with the BSDF of the caller's kernel; see basic_kernel_mixture. `part`: the
  /// BSDF's narrow lobes, which are guided less. glossy_part::unknown() takes a density where their roughness
  /// is not known. Without products. A ray without a field leaves all directions to the BSDF.
  WFPG_HD kernel_mixture mixture(std::uint32_t ray, const glossy_part& part) const {
    return mixture(ray).with(part);
  }
  /// Mixture of a ray's BSDF and product. Evaluates the BSDF P² to 2 P² times. A caller that samples and
  /// evaluates keeps it, instead of making it twice.
  ///
  /// `words`: P² of them, read as long as the mixture lives. Precondition: product_resolution() > 0.
  template <class Bsdf>
  WFPG_HD product_mixture product(std::uint32_t ray, const surface<Bsdf>& s, std::uint32_t* words) const {
    return fields_.product(number(ray), s, words);
  }

  /// Samples a direction from the field alone, without the BSDF. `u`: in [0, 1)². The density is the field's.
  /// Precondition: guides(ray).
  WFPG_HD sampled_direction sample(std::uint32_t ray, vec2 u) const {
    sampled_direction result;
    result.direction = mixture(ray).field.sample(u, result.pdf);
    result.technique = sampling_technique::guide;
    result.field = number(ray);
    return result;
  }
  /// Density of a unit direction under the field alone, per steradian. Precondition: guides(ray).
  WFPG_HD float pdf(std::uint32_t ray, vec3 direction) const { return mixture(ray).field.pdf(direction); }

  /// Samples a direction from the mixture with the surface's BSDF. Its density is the whole mixture's.
  /// `u_technique` in [0, 1) chooses the technique, and `u` in [0, 1)² the direction.
  ///
  /// With products each call makes the ray's product anew, in 1 KiB of the thread's local memory. Keep
  /// product() instead where two calls are needed.
  template <class Bsdf>
  WFPG_HD sampled_direction sample(std::uint32_t ray, const surface<Bsdf>& s, float u_technique,
                                   vec2 u) const {
    return with_mixture(ray, s, [&](const auto& mixture) { return mixture.sample(s, u_technique, u); });
  }
  /// Density of a unit direction under the mixture, per steradian; 0 on delta BSDFs. With products it costs
  /// as much as a sample.
  template <class Bsdf>
  WFPG_HD float pdf(std::uint32_t ray, const surface<Bsdf>& s, vec3 direction) const {
    return with_mixture(ray, s, [&](const auto& mixture) { return mixture.pdf(s, direction); });
  }

 private:
  template <class Bsdf, class F>
  WFPG_HD auto with_mixture(std::uint32_t ray, const surface<Bsdf>& s, const F& f) const {
    if (product_resolution() == 0) return f(mixture(ray));
    std::uint32_t words[max_product_words];
    return f(product(ray, s, words));
  }

  array_view<const std::uint32_t> field_of_ray_;
  resident_fields fields_;
};

}  // namespace wfpg
