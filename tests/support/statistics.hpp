// Checks that every sampler of directions must pass: frequencies, energy, moments, and densities of queries.
// Built from the parts of <wfpg/testing>.
#pragma once

#include "support/chi_square.hpp"
#include "support/evaluate.hpp"

#include <wfpg/base/types.hpp>
#include <wfpg/testing/check_report.hpp>
#include <wfpg/testing/detail/describe.hpp>
#include <wfpg/testing/sphere_statistics.hpp>

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace wfpg_test {

/// A sampled direction, and the density per steradian that the sampler reports.
struct drawn_direction {
  wfpg::vec3 direction{0.0f};
  float pdf = 0.0f;
};

/// Densities of directions, from a host function called one by one.
template <class F>
auto each(const F& f) {
  return [f](const std::vector<wfpg::vec3>& directions) {
    std::vector<float> densities;
    for (const wfpg::vec3 d : directions) densities.push_back(float(f(d)));
    return densities;
  };
}

/// Densities of directions, from a functor that a policy runs.
template <class Exec, class F>
struct densities_by {
  Exec exec;
  F f;
  std::vector<float> operator()(const std::vector<wfpg::vec3>& directions) const {
    return evaluate(exec, directions, f);
  }
};
template <class Exec, class F>
densities_by(Exec, F) -> densities_by<Exec, F>;

/// The result of a check. `frequencies` is for a chi_square_family that judges many samplers together.
struct sampler_report : wfpg::testing::check_report {
  chi_square_result frequencies;
};

struct sampler_check_options {
  double total = 1.0;            ///< integral of the density: the fraction of samples that succeed
  double tolerance = 1.0e-3;     ///< of that integral, beyond the quadrature's own error
  float query = 1.0e-5f;         ///< relative error between reported and queried densities
  double significance = 1.0e-3;  ///< approximate probability that a correct sampler is rejected
  bool moments = true;           ///< six more quadratures, which double the time
};

/// Checks one sampler. The message describes the first check that fails.
///   query        a direction has unit length, and a positive density that is pdf() of it
///   energy       pdf() integrates to `total`
///   frequencies  chi² of directions over adaptive bins of the sphere, pooled where fewer than 5 are expected
///   moments      the means of x, y, z and of their squares are those of the density
/// An eighth of the directions guide the bins, the rest are counted.
template <class Density>
class sampler_check {
 public:
  sampler_check(const std::vector<drawn_direction>& drawn, const Density& pdf,
                const sampler_check_options& options)
      : drawn_(drawn), pdf_(pdf), options_(options) {
    const std::size_t hints = drawn.size() / 8;
    for (std::size_t i = 0; i < drawn.size(); ++i)
      (i < hints ? hints_ : counted_).push_back(drawn[i].direction);
  }

  sampler_report run() const {
    sampler_report report;
    report.message = query();
    if (!report) return report;
    const bins_type bins = integrate([](wfpg::vec3) { return 1.0f; });
    report.message = energy(bins);
    if (!report) return report;
    report.frequencies = wfpg::testing::test_directions(bins, counted_);
    report.message = frequencies(bins, report.frequencies);
    if (report && options_.moments) report.message = moments(bins);
    return report;
  }

 private:
  using bins_type = wfpg::testing::sphere_bins;
  static constexpr double tests = 7.0;  // frequencies and moments share the significance

  /// Integral of pdf() times `factor`, at least 0.
  template <class Factor>
  bins_type integrate(const Factor& factor) const {
    const auto values = [&](const std::vector<wfpg::vec3>& directions) {
      std::vector<float> result = pdf_(directions);
      for (std::size_t i = 0; i < result.size(); ++i) result[i] *= factor(directions[i]);
      return result;
    };
    return {wfpg::frame(wfpg::vec3(0.0f, 0.0f, 1.0f)), values, double(counted_.size()), hints_};
  }

  std::string query() const {
    std::vector<wfpg::vec3> directions;
    for (const drawn_direction& d : drawn_) directions.push_back(d.direction);
    const std::vector<float> densities = pdf_(directions);
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      const drawn_direction& d = drawn_[i];
      const wfpg::detail::in_words toward{d.direction};
      if (!(std::fabs(glm::length(d.direction) - 1.0f) < 1.0e-4f))
        return wfpg::detail::sentence("query: sample ", i, ", ", toward, ", has not unit length");
      const float asked = densities[i];
      if (!(d.pdf > 0.0f && std::fabs(asked - d.pdf) <= options_.query * d.pdf))
        return wfpg::detail::sentence("query: sample ", i, " toward ", toward, " was drawn with density ",
                                      d.pdf, ", pdf() says ", asked);
    }
    return {};
  }

  std::string energy(const bins_type& bins) const {
    const double allowed = options_.tolerance * options_.total + bins.integral_error();
    if (std::fabs(bins.integral() - options_.total) <= allowed) return {};
    return wfpg::detail::sentence("energy: pdf() integrates to ", bins.integral(),
                                  " over the sphere, expected ", options_.total, " within ", allowed);
  }

  std::string frequencies(const bins_type& bins, const chi_square_result& result) const {
    if (result.p >= options_.significance / tests) return {};
    const chi_square_bin& worst = result.worst;
    return wfpg::detail::sentence("frequencies: too ", worst.observed > worst.expected ? "many" : "few",
                                  " directions in ", bins.describe(worst), ": observed ", worst.observed,
                                  ", expected ", worst.expected, "; chi^2 = ", result.statistic, " with ",
                                  result.degrees, " degrees, p = ", result.p);
  }

  std::string moments(const bins_type& bins) const {
    for (int k = 0; k < 6; ++k) {
      const bool square = k >= 3;
      // Compares a quantity in [0, 1] with its quadrature.
      const auto quantity = [&](wfpg::vec3 d) {
        const float c = d[k % 3];
        return square ? c * c : 0.5f * (1.0f + c);
      };
      const bins_type weighted = integrate(quantity);
      wfpg::testing::sample_mean mean;
      for (const wfpg::vec3 d : counted_) mean.add(double(quantity(d)));
      const double expected = weighted.integral() / bins.integral();
      const double allowance = 5.0e-4 * expected + weighted.integral_error() + bins.integral_error();
      const double p = wfpg::testing::two_sided_tail(mean.mean() - expected, allowance, mean.error());
      if (p >= options_.significance / tests) continue;
      const char* const names[] = {"(1 + x) / 2", "(1 + y) / 2", "(1 + z) / 2", "x^2", "y^2", "z^2"};
      return wfpg::detail::sentence("moments: the mean of ", names[k], " over the samples is ", mean.mean(),
                                    " +- ", mean.error(), ", of the density ", expected, ", p = ", p);
    }
    return {};
  }

  const std::vector<drawn_direction>& drawn_;
  const Density& pdf_;
  sampler_check_options options_;
  std::vector<wfpg::vec3> hints_, counted_;
};

/// Checks a sampler in one call. `pdf`: (const std::vector<vec3>&) -> std::vector<float>.
template <class Density>
sampler_report check_sampler(const std::vector<drawn_direction>& drawn, const Density& pdf,
                             const sampler_check_options& options = {}) {
  return sampler_check<Density>(drawn, pdf, options).run();
}

/// Means of a picture's tiles, and of the whole picture, over independent renderings of one method. Each has
/// its own variance.
class tile_means {
 public:
  explicit tile_means(std::size_t tiles) : tiles_(tiles) {}

  /// Adds the tiles of one rendering.
  void add(const std::vector<double>& tiles) {
    ++renderings_;
    for (std::size_t i = 0; i < tiles_.size(); ++i) tiles_[i].add(tiles[i]);
    picture_.add(mean_of(tiles));
  }

  std::size_t size() const { return tiles_.size(); }
  double mean(std::size_t tile) const { return mean(tiles_[tile]); }
  double variance_of_mean(std::size_t tile) const { return variance_of_mean(tiles_[tile]); }
  /// Mean of all tiles together. Noise that is independent between tiles averages out.
  double picture_mean() const { return mean(picture_); }
  double variance_of_picture_mean() const { return variance_of_mean(picture_); }

  /// The means if each rendering had `factor` times its light beyond `rest`, a known mean of each tile.
  tile_means scaled_beyond(const std::vector<double>& rest, double factor) const {
    tile_means result = *this;
    for (std::size_t i = 0; i < size(); ++i)
      result.tiles_[i] = tiles_[i].scaled_beyond(rest[i], factor, renderings_);
    result.picture_ = picture_.scaled_beyond(mean_of(rest), factor, renderings_);
    return result;
  }

  static double mean_of(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double x : values) sum += x;
    return sum / static_cast<double>(values.size());
  }

 private:
  struct moments {
    double sum = 0.0, squares = 0.0;

    void add(double x) { sum += x, squares += x * x; }
    moments scaled_beyond(double rest, double factor, double n) const {
      const double offset = (1.0 - factor) * rest;
      return {n * offset + factor * sum,
              n * offset * offset + 2.0 * offset * factor * sum + factor * factor * squares};
    }
  };

  double mean(const moments& m) const { return m.sum / renderings_; }
  double variance_of_mean(const moments& m) const {
    return (m.squares / renderings_ - mean(m) * mean(m)) / (renderings_ - 1.0);
  }

  double renderings_ = 0.0;
  std::vector<moments> tiles_;
  moments picture_;
};

/// The means of two pictures differ if they are farther apart than this many standard errors. Of correct ones
/// 4 in 1000 do, with 24 renderings of each.
inline constexpr double picture_threshold = 3.2;

/// The standard error of the difference between two methods' pictures, over all tiles.
inline double picture_error(const tile_means& truth, const tile_means& tested) {
  return std::sqrt(truth.variance_of_picture_mean() + tested.variance_of_picture_mean());
}

/// The bias that check_unbiased() finds in a picture's mean with probability 0.99. It is 2.33 standard errors
/// beyond the threshold.
inline double found_bias(const tile_means& truth, const tile_means& tested) {
  return (picture_threshold + 2.33) * picture_error(truth, tested);
}

/// Checks that two renderers have the same mean, by tiles with known variances. With 20 renderings or more of
/// each, Student's t of correct ones exceeds 6 in no tile and 4 in 0.02% of them. A bias too small for one
/// tile shows in all together. If its sign is constant it shows in the picture's mean. Otherwise it shows in
/// the mean of t², which is 1 within four standard errors.
inline wfpg::testing::check_report check_unbiased(const tile_means& truth, const tile_means& tested) {
  double sum_of_squares = 0.0, count = 0.0, beyond = 0.0;
  for (std::size_t tile = 0; tile < truth.size(); ++tile) {
    const double variance = truth.variance_of_mean(tile) + tested.variance_of_mean(tile);
    const double difference = tested.mean(tile) - truth.mean(tile);
    const bool constant = variance <= 1.0e-12 * truth.mean(tile) * truth.mean(tile);
    const double t = constant ? 0.0 : difference / std::sqrt(variance);
    if (constant && std::fabs(difference) > 1.0e-5 * truth.mean(tile))
      return {wfpg::detail::sentence("tile ", tile, " without noise: observed ", tested.mean(tile),
                                     ", expected ", truth.mean(tile))};
    if (!wfpg::is_finite(t) || std::fabs(t) >= 6.0)
      return {wfpg::detail::sentence("tile ", tile, ": observed ", tested.mean(tile), ", expected ",
                                     truth.mean(tile), ", ", t, " standard errors apart")};
    if (constant) continue;
    sum_of_squares += t * t;
    beyond += std::fabs(t) >= 4.0 ? 1.0 : 0.0;
    count += 1.0;
  }
  if (beyond > 0.001 * count)
    return {
        wfpg::detail::sentence(beyond, " of ", count, " tiles are 4 standard errors apart, expected 0.02%")};
  if (count > 0.0 && sum_of_squares / count >= 1.0 + 4.0 * std::sqrt(2.0 / count))
    return {
        wfpg::detail::sentence("tiles together: the mean of their squared differences in standard errors is ",
                               sum_of_squares / count, ", expected 1 within ", 4.0 * std::sqrt(2.0 / count))};
  const double z = (tested.picture_mean() - truth.picture_mean()) / picture_error(truth, tested);
  if (count > 0.0 && !(std::fabs(z) < picture_threshold))
    return {wfpg::detail::sentence("the picture: observed a mean of ", tested.picture_mean(), ", expected ",
                                   truth.picture_mean(), ", ", z, " standard errors apart")};
  return {};
}

/// Checks that two renderers have the same mean, and repeats a failed check. A check of 64 tiles of correct
/// renderers fails by chance once in 55 times. The repetition has four times as many renderings, so a bias is
/// twice as many standard errors. `truth` and `tested` are functions (int factor) -> tile_means. They return
/// `factor` times the usual renderings, independent of those of another factor.
template <class Truth, class Tested>
wfpg::testing::check_report check_renderers_unbiased(const Truth& truth, const Tested& tested) {
  const wfpg::testing::check_report report = check_unbiased(truth(1), tested(1));
  return report ? report : check_unbiased(truth(4), tested(4));
}

}  // namespace wfpg_test
