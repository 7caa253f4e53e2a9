// Light from infinitely far: constant, or a map of all directions that is sampled by luminance.
#pragma once

#include "scene/alias_table.hpp"
#include "scene/frame.hpp"
#include "scene/scene.hpp"
#include "scene/texel_pair.hpp"

#include <vector>

namespace render {

/// A map of all directions (equirectangular). The centre of the picture is -z, its right +x, its upper edge
/// +y. Trivially copyable.
class environment_view {
 public:
  environment_view() = default;
  explicit environment_view(vec3 constant) : constant_(constant) {}
  /// The views are of a map's texels, and of the alias table of their texel_powers(), whose sum is `total`.
  environment_view(const environment_map& map, wfpg::array_view<const vec3> texels,
                   wfpg::array_view<const alias_column> table, float total)
      : texels_(texels),
        table_(table),
        total_(total),
        width_(static_cast<std::uint32_t>(map.width)),
        height_(static_cast<std::uint32_t>(map.height)) {}

  WFPG_HD bool is_map() const { return !texels_.empty(); }
  /// Luminance over all directions, W/m². Only for maps.
  WFPG_HD float total() const { return total_; }

  /// W/(m² sr) along a direction away from the scene. Bilinear.
  WFPG_HD vec3 radiance(vec3 direction) const {
    if (!is_map()) return constant_;
    const vec2 place = place_of(direction);
    const texel_pair column(place.x, width_, texture_wrap::repeat);
    const texel_pair row(place.y, height_, texture_wrap::clamp_to_edge);
    const auto along = [&](std::uint32_t r) {
      const std::size_t first = std::size_t(r) * width_;
      return glm::mix(texels_[first + column.first], texels_[first + column.second], column.second_weight);
    };
    return glm::mix(along(row.first), along(row.second), row.second_weight);
  }

  /// Density of sample(), per steradian. 0 for a constant environment, which is not sampled.
  WFPG_HD float pdf(vec3 direction) const {
    if (!(total_ > 0.0f)) return 0.0f;
    const vec2 place = place_of(direction);
    const auto column = static_cast<std::uint32_t>(place.x * static_cast<float>(width_));
    const auto row = static_cast<std::uint32_t>(place.y * static_cast<float>(height_));
    const std::size_t texel =
        std::size_t(row < height_ ? row : height_ - 1) * width_ + (column < width_ ? column : width_ - 1);
    return wfpg::luminance(texels_[texel]) / total_;
  }

  /// Samples a direction: `choice` chooses a texel, `u` a point in it, uniform by solid angle.
  WFPG_HD vec3 sample(vec2 choice, vec2 u) const {
    const std::uint32_t texel = pick(table_, choice);
    const float angle =
        2.0f * pi * ((static_cast<float>(texel % width_) + u.x) / static_cast<float>(width_) - 0.5f);
    const std::uint32_t row = texel / width_;
    const float y = glm::mix(cosine_above(row), cosine_above(row + 1), u.y);
    const float sine = std::sqrt(glm::max(0.0f, 1.0f - y * y));
    return {sine * std::sin(angle), y, -sine * std::cos(angle)};
  }

 private:
  WFPG_HD static vec2 place_of(vec3 d) {
    return {0.5f + std::atan2(d.x, -d.z) / (2.0f * pi), std::acos(glm::clamp(d.y, -1.0f, 1.0f)) / pi};
  }
  /// The cosine at the upper edge of a row.
  WFPG_HD float cosine_above(std::uint32_t row) const {
    return std::cos(pi * static_cast<float>(row) / static_cast<float>(height_));
  }

  vec3 constant_{0.0f};
  wfpg::array_view<const vec3> texels_;
  wfpg::array_view<const alias_column> table_;  ///< by luminance times solid angle
  float total_ = 0.0f;
  std::uint32_t width_ = 0, height_ = 0;
};

/// The luminance of each texel times its solid angle.
inline std::vector<double> texel_powers(const environment_map& map) {
  std::vector<double> powers;
  for (int row = 0; row < map.height; ++row) {
    const auto cosine_at = [&](int edge) { return std::cos(double(pi) * edge / map.height); };
    const double angle = 2.0 * double(pi) / map.width * (cosine_at(row) - cosine_at(row + 1));
    for (int column = 0; column < map.width; ++column)
      powers.push_back(angle *
                       static_cast<double>(wfpg::luminance(
                           map.texels[std::size_t(row) * std::size_t(map.width) + std::size_t(column)])));
  }
  return powers;
}

}  // namespace render
