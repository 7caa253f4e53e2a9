// What tracers add their samples to: the picture's sums, and counts of each path.
#pragma once

#include "app/render_state.hpp"

#include <wfpg/exec/buffer.hpp>

#include <cstdint>
#include <numeric>
#include <vector>

namespace render {

/// Adds a sample to the sums.
struct add_to_film {
  wfpg::array_view<const vec3> radiance;
  wfpg::array_view<glm::dvec3> film;
  double weight;

  WFPG_HD void operator()(std::size_t i) const { film[i] += weight * glm::dvec3(radiance[i]); }
};

/// The samples of a picture so far, in a policy's memory.
template <class Exec>
class path_film {
 public:
  /// `pixels`: the number of them, which is that of paths.
  path_film(const Exec& exec, std::size_t pixels)
      : exec_(exec),
        sums_(exec, std::vector<glm::dvec3>(pixels, glm::dvec3(0.0))),
        segments_(exec, std::vector<std::uint32_t>(pixels, 0)),
        light_hits_(exec, std::vector<std::uint32_t>(pixels, 0)) {}

  /// Adds a sample with `weight` >= 0.
  void add(wfpg::array_view<const vec3> radiance, float weight) {
    exec_.for_each(sums_.size(), add_to_film{radiance, sums_.view(), static_cast<double>(weight)});
    weight_ += static_cast<double>(weight);
  }

  /// Counts that kernels raise: rays that extended a path, and those of them that ended at a light.
  wfpg::array_view<std::uint32_t> segment_counts() { return segments_.view(); }
  wfpg::array_view<std::uint32_t> light_hit_counts() { return light_hits_.view(); }

  /// Weighted mean of the samples, row by row. Black if their weights sum to 0.
  std::vector<vec3> picture() const {
    std::vector<vec3> pixels;
    pixels.reserve(sums_.size());
    for (const glm::dvec3& sum : sums_.to_host(exec_))
      pixels.push_back(weight_ > 0.0 ? vec3(sum / weight_) : vec3(0.0f));
    return pixels;
  }

  /// Number of rays that extended paths, without shadow rays.
  std::uint64_t segments() const { return sum_of(segments_, segments_before_); }
  /// Number of segments that ended at a surface or environment that emits toward them.
  std::uint64_t light_hits() const { return sum_of(light_hits_, light_hits_before_); }

  /// The samples so far, and a way to continue from them. Precondition: the picture has this size.
  film_state state() const { return {weight_, segments(), light_hits(), sums_.to_host(exec_)}; }
  void restore(const film_state& film) {
    weight_ = film.weight;
    segments_before_ = film.segments;
    light_hits_before_ = film.light_hits;
    sums_ = wfpg::buffer<glm::dvec3, Exec>(exec_, film.sums);
  }

 private:
  std::uint64_t sum_of(const wfpg::buffer<std::uint32_t, Exec>& counts, std::uint64_t before) const {
    const std::vector<std::uint32_t> all = counts.to_host(exec_);
    return std::accumulate(all.begin(), all.end(), before);
  }

  Exec exec_;
  wfpg::buffer<glm::dvec3, Exec> sums_;
  wfpg::buffer<std::uint32_t, Exec> segments_, light_hits_;
  double weight_ = 0.0;
  std::uint64_t segments_before_ = 0, light_hits_before_ = 0;  // of earlier samples in a film
};

}  // namespace render
