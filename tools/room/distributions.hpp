// Distributions over a hemisphere that are made of parts of light: a grid, grids with finer blocks, a
// quadtree, and caps over a grid. All have at most as many numbers as a grid of F² cells. The probability of
// a region is in proportion to its irradiance, or to the root of its integral of (L cos)², which has the
// least variance.
//
// Source of the latter: Rath et al. 2020, "Variance-Aware Path Guiding".
//
// Cost: O(parts log regions) to make one, O(depth) a density. Memory: that of its regions.
#pragma once

#include "parts.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <queue>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace room {

inline constexpr double hemisphere = 6.283185307179586;

/// Regions of the square: a coarse grid, whose heaviest regions are split again and again.
class split_grid {
 public:
  /// Constants of one design.
  struct design {
    int base;   ///< regions along a side before any split
    int split;  ///< a split makes this many along a side; 1: none
    int least;  ///< no region is smaller than 1 / least along a side
    int most;   ///< regions at most
  };

  split_grid(const design& d, const light_parts& parts, bool roots, double floor)
      : design_(d), roots_(roots), floor_(floor) {
    std::vector<std::uint32_t> all(parts.size());
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    divide(parts, all, {0.0f, 0.0f}, 1.0f, d.base);
    int count = d.base * d.base;
    while (d.split > 1 && count + d.split * d.split - 1 <= d.most && !heaviest_.empty()) {
      const std::size_t at = heaviest_.top().second;
      heaviest_.pop();
      if (regions_[at].side * static_cast<float>(d.least) <= 1.0f || !(regions_[at].weight > 0.0)) continue;
      regions_[at].first_child = regions_.size();
      const std::vector<std::uint32_t> members = std::move(regions_[at].members);
      divide(parts, members, regions_[at].corner, regions_[at].side, d.split);
      count += d.split * d.split - 1;
    }
    for (region& r : regions_) {
      if (r.first_child == 0) total_ += r.weight;
      r.members = {};
    }
  }

  /// Sum of the regions' weights.
  double total() const { return total_; }
  /// Density per steradian at a point of the square.
  double pdf(vec2 uv) const {
    if (!(total_ > 0.0)) return 1.0 / hemisphere;
    std::size_t at = index(uv, {0.0f, 0.0f}, 1.0f, design_.base);
    while (regions_[at].first_child > 0) {
      const region& r = regions_[at];
      at = r.first_child + index(uv, r.corner, r.side, design_.split);
    }
    const auto side = static_cast<double>(regions_[at].side);
    return (regions_[at].weight / total_ / (side * side) + floor_) / (1.0 + floor_) / hemisphere;
  }

 private:
  struct region {
    vec2 corner;
    float side;
    double weight = 0.0;
    std::size_t first_child = 0;
    std::vector<std::uint32_t> members = {};  // parts, until all splits are made
  };

  static std::size_t index(vec2 uv, vec2 corner, float side, int n) {
    const auto along = [&](float u, float from) {
      return wfpg::clamp(static_cast<int>((u - from) / side * static_cast<float>(n)), 0, n - 1);
    };
    return static_cast<std::size_t>(along(uv.y, corner.y) * n + along(uv.x, corner.x));
  }
  void divide(const light_parts& parts, const std::vector<std::uint32_t>& members, vec2 corner, float side,
              int n) {
    const std::size_t first = regions_.size();
    const float step = side / static_cast<float>(n);
    for (int i = 0; i < n * n; ++i)
      regions_.push_back({corner + step * vec2(static_cast<float>(i % n), static_cast<float>(i / n)), step});
    for (const std::uint32_t i : members) {
      region& r = regions_[first + index(parts[i].square, corner, side, n)];
      r.members.push_back(i);
      r.weight += static_cast<double>(roots_ ? parts[i].squares : parts[i].irradiance);
    }
    for (std::size_t i = first; i < regions_.size(); ++i) {
      if (roots_) regions_[i].weight = std::sqrt(regions_[i].weight * hemisphere) * static_cast<double>(step);
      heaviest_.push({regions_[i].weight, i});
    }
  }

  design design_;
  bool roots_;
  double floor_, total_ = 0.0;
  std::vector<region> regions_;
  std::priority_queue<std::pair<double, std::size_t>> heaviest_;
};

/// Eight caps around the brightest directions, over a grid of the other light.
class caps_over_grid {
 public:
  caps_over_grid(int base, const light_parts& parts, bool roots, double floor)
      : grid_({base, 1, base, base * base}, others(parts, roots), roots, floor), total_(grid_.total()) {
    for (const cap& c : caps_) total_ += c.weight;
  }

  double pdf(const light_part& at) const {
    if (!(total_ > 0.0)) return 1.0 / hemisphere;
    double sum = grid_.total() / total_ * grid_.pdf(at.square);
    for (const cap& c : caps_)
      if (glm::dot(c.axis, at.local) > cosine) sum += c.weight / total_ / solid_angle;
    return sum;
  }

 private:
  static constexpr int caps = 8, candidates = 64;
  static constexpr double solid_angle = 0.004;
  static constexpr float cosine = 1.0f - static_cast<float>(solid_angle / hemisphere);

  struct cap {
    vec3 axis;
    double weight;
  };
  // Moves the light around the brightest cells of a fine grid into caps. Returns what is left.
  light_parts others(light_parts parts, bool roots) {
    for (int i = 0; i < caps; ++i) {
      std::vector<vec3> sums(candidates * candidates, vec3(0.0f));
      for (const light_part& p : parts) {
        const auto cell =
            glm::min(glm::uvec2(p.square * static_cast<float>(candidates)), glm::uvec2(candidates - 1));
        sums[cell.y * candidates + cell.x] += p.irradiance * p.local;
      }
      const vec3 sum = *std::max_element(sums.begin(), sums.end(), [](const vec3& a, const vec3& b) {
        return glm::dot(a, a) < glm::dot(b, b);
      });
      if (!(glm::dot(sum, sum) > 0.0f)) break;
      caps_.push_back({glm::normalize(sum), 0.0});
      const auto left = std::partition(parts.begin(), parts.end(), [&](const light_part& p) {
        return glm::dot(p.local, caps_.back().axis) <= cosine;
      });
      double weight = 0.0;
      for (auto p = left; p != parts.end(); ++p)
        weight += static_cast<double>(roots ? p->squares : p->irradiance);
      caps_.back().weight = roots ? std::sqrt(weight * solid_angle) : weight;
      parts.erase(left, parts.end());
    }
    return parts;
  }

  std::vector<cap> caps_;  // made before the grid, of the light that they take from it
  split_grid grid_;
  double total_;
};

/// Names of the designs.
inline constexpr std::array<const char*, 4> design_names{"grid", "blocks", "quadtree", "caps"};
/// Probabilities are in proportion to one of them: a region's light, or the root of its mean square.
inline constexpr std::array<const char*, 2> target_names{"mean", "rms"};

/// The design of a name, in the numbers of F² cells. Caps use a grid of the returned base.
inline split_grid::design design_of(const std::string& name, int resolution) {
  const int cells = resolution * resolution;
  if (name == "blocks") return {2 * resolution / 3, 4, 8 * resolution / 3, cells};
  // No finer, so that each cell has a direction of the sums over the background.
  if (name == "quadtree") return {resolution / 3, 2, 128, cells};
  if (name == "caps") return {2 * resolution / 3, 1, resolution, cells};
  return {resolution, 1, resolution, cells};
}

/// Measures a design that is made of the parts of each place.
inline outcome measure_design(const std::string& design, bool roots, const settings& set,
                              const place_parts& parts, const wall_light& light,
                              const std::vector<wall_point>& places) {
  const auto floor = static_cast<double>(set.floor);
  const split_grid::design constants = design_of(design, static_cast<int>(set.resolution));
  const auto with = [&](const auto& make) {
    std::vector<decltype(make(std::size_t(0)))> made;
    std::vector<wfpg::frame> bases;
    for (std::size_t i = 0; i < places.size(); ++i) {
      made.push_back(make(i));
      bases.emplace_back(normal_of(places[i].wall));
    }
    return outcome{measure(light, places, [&](std::size_t i, vec3 direction) {
      const light_part at = part_of(bases[i], direction, 0.0, 0.0);
      if constexpr (std::is_same_v<decltype(make(i)), caps_over_grid>)
        return static_cast<float>(made[i].pdf(at));
      else
        return static_cast<float>(made[i].pdf(at.square));
    })};
  };
  if (design == "caps")
    return with([&](std::size_t i) { return caps_over_grid(constants.base, parts.of(i), roots, floor); });
  return with([&](std::size_t i) { return split_grid(constants, parts.of(i), roots, floor); });
}

}  // namespace room
