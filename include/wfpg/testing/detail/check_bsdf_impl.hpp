// check_bsdf: draws through the policy, verdicts on the host.
#pragma once

#include <wfpg/base/error.hpp>
#include <wfpg/exec/buffer.hpp>
#include <wfpg/testing/check_bsdf.hpp>
#include <wfpg/testing/detail/check_bsdf_kernels.hpp>
#include <wfpg/testing/detail/describe.hpp>
#include <wfpg/testing/sphere_statistics.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace wfpg::detail {

inline const char* name_of_sample(bsdf_part part) {
  static constexpr const char* names[] = {"sample()", "sample_part(true)", "sample_part(false)"};
  return names[static_cast<std::uint32_t>(part)];
}
inline const char* name_of_pdf(bsdf_part part) {
  static constexpr const char* names[] = {"pdf()", "pdf_part(true)", "pdf_part(false)"};
  return names[static_cast<std::uint32_t>(part)];
}

inline bool is_value(float x) {
  return is_finite(x) && x >= 0.0f;
}

/// One check of one BSDF. Each step returns the first violation in words, or an empty string.
template <class Exec, class Bsdf>
class bsdf_check {
 public:
  bsdf_check(const Exec& exec, const Bsdf& bsdf, const testing::bsdf_check_options& options)
      : exec_(exec), bsdf_(bsdf), options_(options), transmits_(bsdf.transmits()), axes_(options.normal) {
    require(std::fabs(glm::length(options.normal) - 1.0f) < 1.0e-3f, "length of the normal",
            glm::length(options.normal), "1");
    require(options.ior > 0.0f, "ior", options.ior, "positive");
    require(options.albedo_limit >= 0.0f, "albedo_limit", options.albedo_limit, "at least 0");
    require(options.samples >= 1024, "samples", options.samples, "at least 1024");
    require(options.tolerance > 0.0f && options.tolerance < 1.0f, "tolerance", options.tolerance,
            "in (0, 1)");
    require(options.significance > 0.0 && options.significance < 1.0, "significance", options.significance,
            "in (0, 1)");
    choose_outgoing();
    device_outgoing_ = buffer<vec3, Exec>(exec_, outgoing_);
    // Frequencies and integral of each of what draws, and the albedo.
    const double techniques = has_separate_parts_v<Bsdf> ? 3.0 : 1.0;
    least_p_ = options.significance / (double(outgoing_.size()) * (2.0 * techniques + 1.0));
  }

  std::string run() const {
    std::string message = values();
    if (bsdf_.is_delta()) return message;
    for (std::size_t i = 0; i < outgoing_.size() && message.empty(); ++i) message = whole(outgoing_[i], i);
    if (message.empty()) message = pairs();
    if constexpr (has_separate_parts_v<Bsdf>) {
      for (std::size_t i = 0; i < outgoing_.size(); ++i)
        for (const bsdf_part part : {bsdf_part::glossy, bsdf_part::rest})
          if (message.empty()) {
            const std::vector<bsdf_draw> made = draw(part, outgoing_[i], seed(i, part), options_.samples);
            message = frequencies(part, outgoing_[i], seed(i, part), made);
          }
    }
    return message;
  }

 private:
  void choose_outgoing() {
    outgoing_.push_back(options_.normal);
    for (const float degrees : {3.0f, 30.0f, 60.0f, 80.0f})
      for (const float azimuth : {0.3f, 2.4f, 4.5f}) {
        if (degrees < 30.0f && azimuth > 0.3f) continue;
        const float theta = degrees * (pi / 180.0f), r = std::sin(theta);
        outgoing_.push_back(
            glm::normalize(axes_.to_world({r * std::cos(azimuth), r * std::sin(azimuth), std::cos(theta)})));
      }
    const std::size_t above = outgoing_.size();
    for (std::size_t i = 0; i < above && transmits_; ++i) outgoing_.push_back(-outgoing_[i]);
  }

  std::uint64_t seed(std::size_t i, bsdf_part part) const {
    return hash(hash(options_.seed, i), static_cast<std::uint64_t>(part));
  }
  outgoing_directions from() const { return {device_outgoing_.view(), options_.normal, transmits_}; }
  float above(vec3 d) const { return glm::dot(d, options_.normal); }
  double index_at(vec3 d) const { return above(d) >= 0.0f ? 1.0 : double(options_.ior); }
  /// Returns the energy of light that goes from `incident` to `outgoing`, over its radiance: the ratio of n².
  double energy_factor(vec3 outgoing, vec3 incident) const {
    const double ratio = index_at(incident) / index_at(outgoing);
    return ratio * ratio;
  }
  bool agree(float a, float b) const {
    return std::fabs(a - b) <= options_.tolerance * std::max(a, b) + 1.0e-6f;
  }
  static std::string seen_from(vec3 outgoing) { return sentence("seen from ", in_words{outgoing}, " "); }

  // Values.

  std::string values() const {
    const buffer<bsdf_probe, Exec> probes(exec_, options_.samples);
    exec_.for_each(probes.size(), probe_bsdf<Bsdf>{bsdf_, from(), hash(options_.seed, 1000), probes.view()});
    for (const bsdf_probe& p : probes.to_host(exec_)) {
      std::string message = drawn(bsdf_part::whole, p.outgoing, p.drawn, p.pdf_drawn);
      if (message.empty()) message = at_direction(p.outgoing, p.uniform, p.eval_uniform, p.pdf_uniform);
      if (message.empty() && p.drawn.pdf > 0.0f)
        message = at_direction(p.outgoing, p.drawn.direction, p.eval_drawn, p.pdf_drawn);
      if (!message.empty()) return message;
    }
    return {};
  }

  /// A sample by itself, and against pdf() of it.
  std::string drawn(bsdf_part part, vec3 outgoing, const stored_sample& s, float pdf) const {
    const char* const sample = name_of_sample(part);
    if (!is_value(s.pdf))
      return sentence(sample, " ", seen_from(outgoing), "gives pdf ", s.pdf,
                      ", expected finite and at least 0");
    if (s.pdf == 0.0f) return {};
    if (!is_finite(s.direction))
      return sentence(sample, " ", seen_from(outgoing), "gives direction ", in_words{s.direction},
                      ", expected finite");
    const float length = glm::length(s.direction);
    if (std::fabs(length - 1.0f) > 1.0e-4f)
      return sentence(sample, " ", seen_from(outgoing), "gives direction ", in_words{s.direction},
                      " of length ", length, ", expected unit length");
    if (bsdf_.is_delta() || s.is_delta != 0) {
      if (s.pdf <= 1.0f + 1.0e-5f) return {};
      return sentence(sample, " of a delta lobe ", seen_from(outgoing), "gives pdf ", s.pdf,
                      ", expected a probability, at most 1");
    }
    if (is_value(pdf) && agree(pdf, s.pdf)) return {};
    return sentence(name_of_pdf(part), " disagrees with ", sample, ": ", seen_from(outgoing),
                    "the sample toward ", in_words{s.direction}, " has pdf ", s.pdf, ", ", name_of_pdf(part),
                    " says ", pdf);
  }

  /// eval() and pdf() of one direction.
  std::string at_direction(vec3 outgoing, vec3 incident, float eval, float pdf) const {
    const auto found = [&](const auto&... what) {
      return sentence(seen_from(outgoing), "toward ", in_words{incident}, " ", what...);
    };
    if (!is_value(eval)) return found("eval() is ", eval, ", expected finite and at least 0");
    if (!is_value(pdf)) return found("pdf() is ", pdf, ", expected finite and at least 0");
    if (bsdf_.is_delta()) {
      if (eval == 0.0f && pdf == 0.0f) return {};
      return found("eval() is ", eval, " and pdf() is ", pdf, ", expected 0 of a delta BSDF");
    }
    if (eval > 0.0f && !(pdf > 0.0f))
      return found("eval() is ", eval, " where pdf() is 0, expected a positive pdf()");
    const bool prefix = above(outgoing) * above(incident) < 0.0f && std::fabs(above(incident)) > 1.0e-4f;
    if (!transmits_ && prefix && (eval > 0.0f || pdf > 0.0f))
      return found("eval() is ", eval, " and pdf() is ", pdf, " through the surface of normal ",
                   in_words{options_.normal}, ", expected 0 since transmits() is false");
    return {};
  }

  // Statistics, of one outgoing direction.

  std::vector<bsdf_draw> draw(bsdf_part part, vec3 outgoing, std::uint64_t seed, std::size_t n) const {
    const buffer<bsdf_draw, Exec> made(exec_, n);
    exec_.for_each(n, draw_bsdf<Bsdf>{bsdf_, part, outgoing, seed, made.view()});
    return made.to_host(exec_);
  }
  static std::vector<vec3> directions_of(const std::vector<bsdf_draw>& draws_made) {
    std::vector<vec3> directions;
    for (const bsdf_draw& d : draws_made)
      if (d.drawn.pdf > 0.0f && d.drawn.is_delta == 0) directions.push_back(d.drawn.direction);
    return directions;
  }
  /// Returns directions that guide a quadrature. They are independent of those that are counted.
  std::vector<vec3> hints(bsdf_part part, vec3 outgoing, std::uint64_t seed) const {
    return directions_of(draw(part, outgoing, hash(seed, 1), options_.samples / 8));
  }

  /// The integral of eval(), times energy_factor, or of a part's pdf() by bins. A value that is none goes to
  /// `message` and counts as 0.
  testing::sphere_bins integrate(bsdf_part part, bool value, vec3 outgoing, const std::vector<vec3>& hints,
                                 std::string& message) const {
    const auto density = [&](const std::vector<vec3>& directions) {
      const buffer<vec3, Exec> asked(exec_, directions);
      const buffer<float, Exec> results(exec_, directions.size());
      exec_.for_each(directions.size(),
                     tabulate_bsdf<Bsdf>{bsdf_, part, value, outgoing, asked.view(), results.view()});
      std::vector<float> values = results.to_host(exec_);
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (!is_value(values[i])) {
          message = sentence(seen_from(outgoing), "toward ", in_words{directions[i]}, " ",
                             value ? "eval()" : name_of_pdf(part), " is ", values[i],
                             ", expected finite and at least 0");
          values[i] = 0.0f;
        }
        if (value) values[i] *= static_cast<float>(energy_factor(outgoing, directions[i]));
      }
      return values;
    };
    const testing::sphere_bins bins(axes_, density, double(options_.samples), hints);
    if (message.empty() && bins.integral_error() > 0.01 * std::max(bins.integral(), 1.0))
      message = sentence("the integral of ", value ? "eval()" : name_of_pdf(part), " ", seen_from(outgoing),
                         "does not converge: it is ", bins.integral(), " +- ", bins.integral_error(),
                         "; lobes this narrow are delta lobes");
    return bins;
  }

  std::string whole(vec3 outgoing, std::size_t i) const {
    const std::uint64_t numbers = seed(i, bsdf_part::whole);
    const std::vector<bsdf_draw> made = draw(bsdf_part::whole, outgoing, numbers, options_.samples);
    const std::string message = frequencies(bsdf_part::whole, outgoing, numbers, made);
    return message.empty() ? energy(outgoing, numbers, made) : message;
  }

  /// Compares frequencies with integrals of the density, and the fraction of samples that succeed with the
  /// integral over the sphere. Samples of delta lobes do not count as successes: pdf() does not know them.
  std::string frequencies(bsdf_part part, vec3 outgoing, std::uint64_t numbers,
                          const std::vector<bsdf_draw>& made) const {
    if (made.front().asked == 0) return {};
    for (const bsdf_draw& d : made) {
      const std::string message = drawn(part, outgoing, d.drawn, d.pdf);
      if (!message.empty()) return message;
    }
    std::string message;
    const testing::sphere_bins bins =
        integrate(part, false, outgoing, hints(part, outgoing, numbers), message);
    if (!message.empty()) return message;
    const std::vector<vec3> directions = directions_of(made);
    if (!directions.empty() && bins.integral() > 0.0) message = shape(part, outgoing, bins, directions);
    if (!message.empty()) return message;

    const double n = double(made.size()), succeed = double(directions.size()) / n;
    const double integral = bins.integral(), chance = std::min(integral, 1.0);
    const double p = testing::two_sided_tail(succeed - integral, 5.0e-4 * integral + bins.integral_error(),
                                             std::sqrt(chance * (1.0 - chance) / n));
    if (p >= least_p_) return {};
    return sentence("the integral of ", name_of_pdf(part), " over the sphere ", seen_from(outgoing), "is ",
                    integral, ", but the fraction of ", name_of_sample(part),
                    "'s samples that succeed, delta lobes aside, is ", succeed, " of ", made.size(),
                    ", p = ", p);
  }

  std::string shape(bsdf_part part, vec3 outgoing, const testing::sphere_bins& bins,
                    const std::vector<vec3>& directions) const {
    const testing::chi_square_result result = testing::test_directions(bins, directions);
    if (result.p >= least_p_) return {};
    const testing::chi_square_bin& worst = result.worst;
    return sentence(name_of_sample(part), " draws too ", worst.observed > worst.expected ? "many" : "few",
                    " directions, by ", name_of_pdf(part), ", around ", in_words{bins.middle(worst.first)},
                    ": ", seen_from(outgoing), "in ", bins.describe(worst), " about the normal observed ",
                    worst.observed, ", expected ", worst.expected, ", chi^2 = ", result.statistic, " with ",
                    result.degrees, " degrees, p = ", result.p);
  }

  std::string energy(vec3 outgoing, std::uint64_t numbers, const std::vector<bsdf_draw>& made) const {
    std::string message;
    const testing::sphere_bins bins =
        integrate(bsdf_part::whole, true, outgoing, hints(bsdf_part::whole, outgoing, numbers), message);
    if (!message.empty()) return message;
    const double albedo = bins.integral(), allowance = 5.0e-4 * albedo + bins.integral_error();
    if (albedo > double(options_.albedo_limit) + allowance)
      return sentence("energy is not conserved: ", seen_from(outgoing),
                      "the integral of eval() over incident directions is ", albedo, ", expected at most ",
                      options_.albedo_limit);
    testing::sample_mean by_samples;
    for (const bsdf_draw& d : made)
      by_samples.add(d.drawn.pdf > 0.0f && d.drawn.is_delta == 0
                         ? double(d.eval) / double(d.drawn.pdf) * energy_factor(outgoing, d.drawn.direction)
                         : 0.0);
    const double p = testing::two_sided_tail(by_samples.mean() - albedo, allowance, by_samples.error());
    if (p >= least_p_) return {};
    return sentence("eval() and sample() give different albedos: ", seen_from(outgoing),
                    "the mean of eval() / pdf over the samples is ", by_samples.mean(), " +- ",
                    by_samples.error(), ", the integral of eval() ", albedo, ", p = ", p);
  }

  // Reciprocity and parts.

  std::string pairs() const {
    const buffer<bsdf_pair, Exec> device(exec_, options_.samples);
    exec_.for_each(device.size(), pair_bsdf<Bsdf>{bsdf_, from(), hash(options_.seed, 2000), device.view()});
    const std::vector<bsdf_pair> host = device.to_host(exec_);
    std::string message;
    for (std::size_t i = 0; i < host.size() && message.empty() && options_.reciprocal; ++i)
      message = reciprocity(host[i]);
    for (std::size_t i = 0; i < host.size() && message.empty() && has_glossy_part_v<Bsdf>; ++i)
      message = parts(host[i]);
    return message;
  }

  std::string reciprocity(const bsdf_pair& p) const {
    const float out = std::fabs(above(p.outgoing)), in = std::fabs(above(p.incident));
    if (out < 1.0e-3f || in < 1.0e-3f) return {};
    const auto n_out = static_cast<float>(index_at(p.outgoing)),
               n_in = static_cast<float>(index_at(p.incident));
    const float forth = p.forth * out * n_in * n_in, back = p.back * in * n_out * n_out;
    if (is_value(back) && agree(forth, back)) return {};
    return sentence("eval() is not reciprocal: ", seen_from(p.outgoing), "toward ", in_words{p.incident},
                    " f is ", p.forth / in, ", the other way round ", p.back / out, ", expected ",
                    forth / (in * out * n_out * n_out));
  }

  std::string parts(const bsdf_pair& p) const {
    const float fraction = p.glossy.fraction, alpha = p.glossy.alpha;
    if (!(is_value(fraction) && fraction <= 1.0f))
      return sentence("glossy() ", seen_from(p.outgoing), "gives fraction ", fraction,
                      ", expected in [0, 1]");
    if (!(is_value(alpha) && alpha <= 1.0f))
      return sentence("glossy() ", seen_from(p.outgoing), "gives alpha ", alpha, ", expected in [0, 1]");
    const float sum = fraction * p.pdf_glossy + (1.0f - fraction) * p.pdf_rest;
    if (!has_separate_parts_v<Bsdf> || (is_value(sum) && agree(sum, p.pdf))) return {};
    return sentence("pdf_part() does not add up to pdf(): ", seen_from(p.outgoing), "toward ",
                    in_words{p.incident}, " a fraction ", fraction, " of ", p.pdf_glossy, " and the rest of ",
                    p.pdf_rest, " make ", sum, ", pdf() says ", p.pdf);
  }

  const Exec& exec_;
  const Bsdf& bsdf_;
  const testing::bsdf_check_options& options_;
  bool transmits_;
  frame axes_;
  std::vector<vec3> outgoing_;
  buffer<vec3, Exec> device_outgoing_;
  double least_p_ = 0.0;
};

}  // namespace wfpg::detail

namespace wfpg::testing {

template <class Exec, class Bsdf>
check_report check_bsdf(const Exec& exec, const Bsdf& bsdf, const bsdf_check_options& options) {
  static_assert(is_bsdf_v<Bsdf>, "<wfpg/host/bsdf.hpp> says what a BSDF is");
  return {wfpg::detail::bsdf_check<Exec, Bsdf>(exec, bsdf, options).run()};
}

}  // namespace wfpg::testing
