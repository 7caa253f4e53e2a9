// A picture a technique of bidirectional methods, with its weights and without.
#pragma once

#include "tracer/found_light.hpp"
#include "tracer/path_film.hpp"

#include <wfpg/exec/buffer.hpp>
#include <wfpg/light/splats.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace render {

/// What one technique found.
struct technique_picture {
  technique by;
  std::vector<vec3> weighted;  ///< its part of the picture, row by row; those of all techniques add up to it
  std::vector<vec3> plain;     ///< without weights: what it would show alone, where it can find a path
};

/// Copies a picture.
struct copy_pixels {
  wfpg::array_view<const vec3> from;
  wfpg::array_view<vec3> to;

  WFPG_HD void operator()(std::size_t i) const { to[i] = from[i]; }
};

/// Sums of each technique's pictures, in a policy's memory. Without memory where nobody asks for them.
template <class Exec>
class technique_film {
 public:
  /// `splats`: most at a time.
  technique_film(const Exec& exec, std::size_t pixels, bool is_on, std::size_t splats)
      : exec_(exec),
        pixels_(pixels),
        splats_(exec, is_on ? splats : 0, pixels),
        weighted_(exec, is_on ? technique_count * pixels : 0),
        plain_(exec, weighted_.size()),
        weighted_sums_(exec, std::vector<glm::dvec3>(weighted_.size(), glm::dvec3(0.0))),
        plain_sums_(exec, std::vector<glm::dvec3>(weighted_.size(), glm::dvec3(0.0))) {}

  bool is_on() const { return weighted_.size() > 0; }

  /// Forgets the sample before.
  void begin() {
    exec_.fill_bytes(weighted_.data(), 0, weighted_.bytes());
    exec_.fill_bytes(plain_.data(), 0, plain_.bytes());
  }
  /// Where a sample's kernels add what they find: to `radiance`, and to pictures of techniques.
  found_light found(wfpg::array_view<vec3> radiance) { return {radiance, weighted_.view(), plain_.view()}; }

  /// Splats without weights.
  wfpg::splat_view splats() { return splats_.view(); }
  /// Adds those of the first n places.
  void add_splats(float scale, std::size_t n) {
    if (is_on()) splats_.add_to(exec_, of(plain_, technique::splat), scale, n);
  }
  /// Takes the picture so far for what splats have found.
  void take_splats(const wfpg::buffer<vec3, Exec>& radiance) {
    if (is_on()) exec_.for_each(pixels_, copy_pixels{radiance.view(), of(weighted_, technique::splat)});
  }

  /// What a technique found for a pixel in this sample, on the host. Precondition: is_on().
  technique_sum of_sample(technique by, std::size_t pixel) const {
    const std::size_t i = static_cast<std::size_t>(by) * pixels_ + pixel;
    return {wfpg::read_element(exec_, weighted_.data() + i), wfpg::read_element(exec_, plain_.data() + i)};
  }

  /// Adds the sample with `weight` >= 0.
  void add(float weight) {
    const auto factor = static_cast<double>(weight);
    exec_.for_each(weighted_.size(), add_to_film{weighted_.view(), weighted_sums_.view(), factor});
    exec_.for_each(plain_.size(), add_to_film{plain_.view(), plain_sums_.view(), factor});
    weight_ += factor;
  }

  /// Weighted means of the samples, of each of these techniques.
  std::vector<technique_picture> pictures(const technique_set& techniques) const {
    std::vector<technique_picture> all;
    if (!is_on()) return all;
    const std::vector<glm::dvec3> weighted = weighted_sums_.to_host(exec_),
                                  plain = plain_sums_.to_host(exec_);
    for (int i = 0; i < technique_count; ++i)
      if (techniques.has(technique(i))) all.push_back({technique(i), mean(weighted, i), mean(plain, i)});
    return all;
  }

 private:
  wfpg::array_view<vec3> of(wfpg::buffer<vec3, Exec>& pictures, technique by) {
    return {pictures.data() + static_cast<std::size_t>(by) * pixels_, pixels_};
  }
  std::vector<vec3> mean(const std::vector<glm::dvec3>& sums, int i) const {
    std::vector<vec3> picture;
    const std::size_t first = static_cast<std::size_t>(i) * pixels_;
    for (std::size_t k = first; k < first + pixels_; ++k)
      picture.push_back(weight_ > 0.0 ? vec3(sums[k] / weight_) : vec3(0.0f));
    return picture;
  }

  Exec exec_;
  std::size_t pixels_;
  wfpg::splats<Exec> splats_;
  wfpg::buffer<vec3, Exec> weighted_, plain_;  // of a sample: pictures of all techniques, one after the other
  wfpg::buffer<glm::dvec3, Exec> weighted_sums_, plain_sums_;
  double weight_ = 0.0;
};

}  // namespace render
