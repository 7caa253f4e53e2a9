// The fields of one depth of a wave, as the renderer's own kernels see them: for renderers whose BSDFs exist
// only inside their material kernels. Made by path_guider::prepare, from kept fields or from transient ones
// that were made resident; the fused form draws the same directions from the same random numbers, but for
// rounding where a compiler contracts the arithmetic of two kernels differently, as nvcc does.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/sampling/mixture.hpp>
#include <wfpg/sampling/product_sampler.hpp>

namespace wfpg {

/// What a field in memory is, beside its distribution. One load.
struct alignas(16) resident_field {
  vec3 normal{0.0f};      ///< of the hemisphere that it covers, unit length; zero: it covers the sphere
  float fraction = 0.0f;  ///< of guided samples in the mixture; 0: not there yet, and guides nothing

  /// Whether it covers a hemisphere.
  WFPG_HD bool hemisphere() const { return normal.x != 0.0f || normal.y != 0.0f || normal.z != 0.0f; }
};

/// Fields in memory: what each is, and its distribution.
struct resident_fields {
  const resident_field* fields = nullptr;  ///< a field: what it is
  const std::uint32_t* words = nullptr;    ///< of the distributions, one after the other
  std::uint32_t resolution = 0;            ///< F
  product_points points;                   ///< of this wave

  /// What field i is; no_field guides nothing.
  WFPG_HD resident_field info(std::uint32_t i) const { return i == no_field ? resident_field{} : fields[i]; }
  /// fields[i] and its distribution.
  WFPG_HD directional_field field(std::uint32_t i, const resident_field& what) const {
    const grid_distribution grid(words + std::size_t(i) * grid_distribution::words(resolution), resolution);
    return what.hemisphere() ? directional_field(grid, what.normal) : directional_field(grid);
  }
  /// The mixture of field i and a BSDF, without products; where the field guides nothing, the BSDF alone.
  WFPG_HD guide_mixture mixture(std::uint32_t i) const {
    const resident_field what = info(i);
    if (!(what.fraction > 0.0f)) return {};
    return {field(i, what), what.fraction, i};
  }
  /// The mixture of its product and the BSDF: P² to 2 P² evaluations of the BSDF into `weights`, P² of them,
  /// which it reads as long as it lives. Precondition: points.resolution > 0.
  template <class Bsdf>
  WFPG_HD product_mixture product(std::uint32_t i, const surface<Bsdf>& s, std::uint32_t* weights) const {
    const resident_field what = info(i);
    if (!(what.fraction > 0.0f)) return {};
    return {multiply_field(field(i, what), points, s, weights), what.fraction, i};
  }
};

/// Trivially copyable; holds until the guider's next call. Rays are the wave's. With products each ray draws
/// from its field times its BSDF.
class guide_view {
 public:
  guide_view() = default;
  /// `field_of_ray`: a ray's number among the fields, or no_field.
  WFPG_HD guide_view(array_view<const std::uint32_t> field_of_ray, const resident_fields& fields)
      : field_of_ray_(field_of_ray), fields_(fields) {}

  /// Whether the ray has a field; without one it is its BSDF's.
  WFPG_HD bool guides(std::uint32_t ray) const { return fields_.info(number(ray)).fraction > 0.0f; }
  /// The ray's number among fields(), or no_field.
  WFPG_HD std::uint32_t number(std::uint32_t ray) const {
    return ray < field_of_ray_.size() ? field_of_ray_[ray] : no_field;
  }
  /// What rays draw from.
  WFPG_HD const resident_fields& fields() const { return fields_; }

  /// P, or 0 without products.
  WFPG_HD std::uint32_t product_resolution() const { return fields_.points.resolution; }

  /// The ray's mixture of field and BSDF, without products; of a ray without field, the BSDF alone.
  WFPG_HD guide_mixture mixture(std::uint32_t ray) const { return fields_.mixture(number(ray)); }
  /// The ray's mixture of product and BSDF: P² to 2 P² evaluations of the BSDF into `words`, P² of them,
  /// which it reads as long as it lives. Precondition: product_resolution() > 0.
  template <class Bsdf>
  WFPG_HD product_mixture product(std::uint32_t ray, const surface<Bsdf>& s, std::uint32_t* words) const {
    return fields_.product(number(ray), s, words);
  }

  /// A direction and its density from the field alone. Precondition: guides(ray).
  WFPG_HD sampled_direction sample(std::uint32_t ray, vec2 u) const {
    sampled_direction result;
    result.direction = mixture(ray).field.sample(u, result.pdf);
    result.technique = sampling_technique::guide;
    result.field = number(ray);
    return result;
  }
  /// The field's density of a unit direction, per steradian. Precondition: guides(ray).
  WFPG_HD float pdf(std::uint32_t ray, vec3 direction) const { return mixture(ray).field.pdf(direction); }

  /// A direction of the mixture with the surface's BSDF, and the mixture's density. With products each call
  /// makes the ray's anew, in 1 KiB of the thread's own; who calls twice keeps product().
  template <class Bsdf>
  WFPG_HD sampled_direction sample(std::uint32_t ray, const surface<Bsdf>& s, float u_technique,
                                   vec2 u) const {
    return with_mixture(ray, s, [&](const auto& mixture) { return mixture.sample(s, u_technique, u); });
  }
  /// The mixture's density of a unit direction, per steradian.
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
