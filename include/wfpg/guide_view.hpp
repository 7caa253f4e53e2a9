// The fields of one depth of a wave, as the renderer's own kernels see them: for renderers whose BSDFs exist
// only inside their material kernels. Made by path_guider::prepare, from kept fields or from transient ones
// that were made resident; the fused form draws the same directions from the same random numbers.
#pragma once

#include <wfpg/mis.hpp>
#include <wfpg/types.hpp>

namespace wfpg {

/// What a field in memory is, beside its distribution.
struct resident_field {
  vec3 normal{0.0f};
  float fraction = 0.0f;  ///< of guided samples in the mixture; 0: not there yet, and guides nothing
  bool hemisphere = false;
};

/// Trivially copyable; holds until the guider's next call. Rays are the wave's.
class guide_view {
 public:
  static constexpr std::uint32_t no_field = 0xffffffffu;

  guide_view() = default;
  WFPG_HD guide_view(array_view<const std::uint32_t> field_of_ray, const resident_field* fields,
                     const std::uint32_t* words, std::uint32_t resolution)
      : field_of_ray_(field_of_ray), fields_(fields), words_(words), resolution_(resolution) {}

  /// Whether the ray has a field; without one it is its BSDF's.
  WFPG_HD bool guides(std::uint32_t ray) const {
    return ray < field_of_ray_.size() && field_of_ray_[ray] != no_field &&
           fields_[field_of_ray_[ray]].fraction > 0.0f;
  }

  /// The ray's mixture of field and BSDF; of a ray without field, the BSDF alone.
  WFPG_HD guide_mixture mixture(std::uint32_t ray) const {
    if (!guides(ray)) return {};
    const resident_field& f = fields_[field_of_ray_[ray]];
    const std::size_t cells = std::size_t(resolution_) * resolution_;
    const std::uint32_t* rows = words_ + field_of_ray_[ray] * detail::distribution_words(resolution_);
    const grid_distribution grid(rows, rows + cells, resolution_);
    return {f.hemisphere ? directional_field(grid, f.normal) : directional_field(grid), f.fraction};
  }

  /// A direction and its density from the field alone. Precondition: guides(ray).
  WFPG_HD sampled_direction sample(std::uint32_t ray, vec2 u) const {
    sampled_direction result;
    result.direction = mixture(ray).field.sample(u, result.pdf);
    result.technique = sampling_technique::guide;
    return result;
  }
  /// The field's density of a unit direction, per steradian. Precondition: guides(ray).
  WFPG_HD float pdf(std::uint32_t ray, vec3 direction) const { return mixture(ray).field.pdf(direction); }

  /// A direction of the mixture with the surface's BSDF, and the mixture's density.
  template <class Bsdf>
  WFPG_HD sampled_direction sample(std::uint32_t ray, const surface<Bsdf>& s, float u_technique,
                                   vec2 u) const {
    return mixture(ray).sample(s, u_technique, u);
  }
  /// The mixture's density of a unit direction, per steradian.
  template <class Bsdf>
  WFPG_HD float pdf(std::uint32_t ray, const surface<Bsdf>& s, vec3 direction) const {
    return mixture(ray).pdf(s, direction);
  }

 private:
  array_view<const std::uint32_t> field_of_ray_;
  const resident_field* fields_ = nullptr;
  const std::uint32_t* words_ = nullptr;
  std::uint32_t resolution_ = 0;
};

}  // namespace wfpg
