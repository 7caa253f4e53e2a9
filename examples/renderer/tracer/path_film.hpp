// What tracers add their samples to: the picture's sums, and counts of each path. Ranks have a part each.
#pragma once

#include "app/render_state.hpp"
#include "tracer/exact_sum.hpp"
#include "tracer/wave_share.hpp"

#include <wfpg/exec/buffer.hpp>
#include <wfpg/ranks/communicator.hpp>

#include <thrust/copy.h>
#include <thrust/reduce.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace render {

/// Adds a sample to the sums.
struct add_to_film {
  wfpg::array_view<const vec3> radiance;
  wfpg::array_view<glm::dvec3> film;
  double weight;

  WFPG_HD void operator()(std::size_t i) const { film[i] += weight * glm::dvec3(radiance[i]); }
};

/// Adds a rank's part of a wave of several samples to its sums of all pixels.
struct add_exactly {
  wfpg::array_view<const vec3> radiance;
  wfpg::array_view<exact_sum> film;  ///< three a pixel
  wave_share share;
  double weight;

  WFPG_HD void operator()(std::size_t pixel) const {
    for (std::uint32_t sample = 0; sample < share.samples; ++sample) {
      // Paths before this rank's first one wrap around, so that they are not below its count.
      const auto path = static_cast<std::uint32_t>(sample * share.pixels + pixel - share.first);
      if (path >= share.count) continue;
      for (int c = 0; c < 3; ++c)
        film[3 * pixel + static_cast<std::size_t>(c)].add(weight * static_cast<double>(radiance[path][c]));
    }
  }
};

/// Writes the parts of the sums from `first` on, which ranks add up.
struct split_exact_sums {
  wfpg::array_view<const exact_sum> film;
  std::uint64_t* words;  ///< exact_sum::parts a sum
  std::size_t first;

  WFPG_HD void operator()(std::size_t i) const { film[first + i].split(words + i * exact_sum::parts); }
};

/// Writes the numbers of the sums from `first` on, whose parts are those of all ranks.
struct join_exact_sums {
  const std::uint64_t* words;  ///< as above
  double* sums;
  std::size_t first;

  WFPG_HD void operator()(std::size_t i) const {
    sums[first + i] = exact_sum::joined(words + i * exact_sum::parts);
  }
};

/// The samples of a picture so far, in a policy's memory. A rank has the sums of its own pixels. Where waves
/// have several samples, it has exact sums of its samples of all pixels. Pictures and states are those of all
/// ranks, so all ranks must ask for them. They have the same bits for any number of ranks.
template <class Exec>
class path_film {
 public:
  /// `ranks`: of the policy's memory; null for one rank. It outlives the film.
  path_film(const Exec& exec, const wave_share& share, wfpg::communicator* ranks)
      : exec_(exec),
        share_(share),
        ranks_(ranks),
        sums_(exec, is_exact() ? 0 : share.count),
        exact_(exec, is_exact() ? 3 * std::size_t(share.pixels) : 0),
        segments_(exec, share.count),
        light_hits_(exec, share.count) {
    clear(sums_);
    clear(exact_);
    clear(segments_);
    clear(light_hits_);
  }
  /// `pixels`: the number of them, which is that of paths.
  path_film(const Exec& exec, std::size_t pixels) : path_film(exec, wave_share::all_of(pixels), nullptr) {}

  /// Adds a wave whose `samples` first samples were traced, each with `weight` >= 0.
  void add(wfpg::array_view<const vec3> radiance, float weight, std::uint32_t samples = 1) {
    const auto factor = static_cast<double>(weight);
    if (is_exact())
      exec_.for_each(share_.pixels, add_exactly{radiance, exact_.view(), share_, factor});
    else
      exec_.for_each(sums_.size(), add_to_film{radiance, sums_.view(), factor});
    weight_ += factor * samples;
  }

  /// Counts that kernels raise: rays that extended a path, and those of them that ended at a light.
  wfpg::array_view<std::uint32_t> segment_counts() { return segments_.view(); }
  wfpg::array_view<std::uint32_t> light_hit_counts() { return light_hits_.view(); }

  /// Weighted mean of the samples, row by row. Black if their weights sum to 0.
  std::vector<vec3> picture() const {
    std::vector<vec3> pixels;
    pixels.reserve(share_.pixels);
    for (const glm::dvec3& sum : sums_of_all())
      pixels.push_back(weight_ > 0.0 ? vec3(sum / weight_) : vec3(0.0f));
    return pixels;
  }

  /// Number of rays that extended paths, without shadow rays.
  std::uint64_t segments() const { return sum_of(segments_) + segments_before_; }
  /// Number of segments that ended at a surface or environment that emits toward them.
  std::uint64_t light_hits() const { return sum_of(light_hits_) + light_hits_before_; }

  /// The samples so far, and a way to continue from them. Precondition: the picture has this size, and waves
  /// have one sample.
  film_state state() const { return {weight_, segments(), light_hits(), sums_of_all()}; }
  void restore(const film_state& film) {
    weight_ = film.weight;
    segments_before_ = film.segments;
    light_hits_before_ = film.light_hits;
    exec_.copy_from_host(sums_.data(), film.sums.data() + share_.first, sums_.bytes());
  }

 private:
  bool is_exact() const { return share_.samples > 1; }

  // All bits of 0 are 0.
  template <class T>
  void clear(const wfpg::buffer<T, Exec>& values) {
    exec_.fill_bytes(values.data(), 0, values.bytes());
  }

  std::uint64_t sum_of(const wfpg::buffer<std::uint32_t, Exec>& counts) const {
    const auto own =
        ::thrust::reduce(exec_.thrust(), counts.data(), counts.data() + counts.size(), std::uint64_t(0));
    if (!ranks_) return own;
    const wfpg::buffer<std::uint64_t, Exec> sum(exec_, std::vector<std::uint64_t>{own});
    ranks_->all_reduce_sum(sum.view());
    return wfpg::read_element(exec_, sum.data());
  }

  /// The picture's sums, of all ranks.
  std::vector<glm::dvec3> sums_of_all() const {
    if (!is_exact() && !ranks_) return sums_.to_host(exec_);
    const wfpg::buffer<glm::dvec3, Exec> all(exec_, share_.pixels);
    if (is_exact())
      join_exactly(reinterpret_cast<double*>(all.data()));
    else
      join(all);
    return all.to_host(exec_);
  }

  /// Sums of all pixels. Bits of zeros add nothing to the bits of the rank that has the pixel.
  void join(const wfpg::buffer<glm::dvec3, Exec>& all) const {
    exec_.fill_bytes(all.data(), 0, all.bytes());
    ::thrust::copy_n(exec_.thrust(), sums_.data(), sums_.size(), all.data() + share_.first);
    ranks_->all_reduce_sum({reinterpret_cast<std::uint64_t*>(all.data()), 3 * all.size()});
  }

  void join_exactly(double* all) const {
    const std::size_t at_once = std::min(exact_.size(), std::size_t(1) << 18);
    const wfpg::buffer<std::uint64_t, Exec> words(exec_, at_once * exact_sum::parts);
    for (std::size_t first = 0; first < exact_.size(); first += at_once) {
      const std::size_t count = std::min(at_once, exact_.size() - first);
      exec_.for_each(count, split_exact_sums{exact_.view(), words.data(), first});
      if (ranks_) ranks_->all_reduce_sum(words.view().subview(0, count * exact_sum::parts));
      exec_.for_each(count, join_exact_sums{words.data(), all, first});
    }
  }

  Exec exec_;
  wave_share share_;
  wfpg::communicator* ranks_;
  wfpg::buffer<glm::dvec3, Exec> sums_;
  wfpg::buffer<exact_sum, Exec> exact_;
  wfpg::buffer<std::uint32_t, Exec> segments_, light_hits_;
  double weight_ = 0.0;
  std::uint64_t segments_before_ = 0, light_hits_before_ = 0;  // of earlier samples in a film
};

}  // namespace render
