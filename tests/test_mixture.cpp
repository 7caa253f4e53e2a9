// The mixture for hosts' kernels, and delta lobes beside others: choices, densities, and estimates against
// exact integrals. Each estimate is shown to notice a planted fault.
#include "support/evaluate.hpp"
#include "support/fields.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/statistics.hpp"

#include <wfpg/sampling/mixture.hpp>
#include <wfpg/sampling/roulette.hpp>
#include <wfpg/testing/statistics.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::directional_field;
using wfpg::glossy_part;
using wfpg::guide_mixture;
using wfpg::kernel_mixture;
using wfpg::sampled_direction;
using wfpg::sampling_technique;

namespace {

WFPG_HD float sky(vec3 d) {
  return 0.2f + std::exp(3.0f * d.z - 2.0f);
}

/// A mirror, drawn with probability 0.3, over a white diffuse surface that reflects 0.7.
struct coated {
  static constexpr float mirror = 0.3f;
  test_bsdf base;
  bool tells_part = false;

  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return false; }
  WFPG_HD float eval(vec3 outgoing, vec3 incident) const { return 0.7f * base.eval(outgoing, incident); }
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    return (1.0f - mirror) * base.pdf(outgoing, incident);
  }
  WFPG_HD wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    if (u.x < mirror) return {mirrored(outgoing), mirror, true};
    wfpg::bsdf_sample drawn = base.sample(outgoing, {(u.x - mirror) / (1.0f - mirror), u.y});
    drawn.pdf *= 1.0f - mirror;
    return drawn;
  }
  WFPG_HD glossy_part glossy(vec3) const {
    return tells_part ? glossy_part{mirror, 0.0f} : glossy_part::none();
  }
  /// What the mirror reflects: 0.6 of the light.
  WFPG_HD static float delta_value() { return 0.6f; }
  WFPG_HD vec3 mirrored(vec3 outgoing) const {
    return 2.0f * glm::dot(base.normal, outgoing) * base.normal - outgoing;
  }
};

/// Draws its mirror and its diffuse lobe apart.
struct parted_coat : coated {
  WFPG_HD wfpg::bsdf_sample sample_part(bool narrow, vec3 outgoing, vec2 u) const {
    if (narrow) return {mirrored(outgoing), 1.0f, true};
    return base.sample(outgoing, u);
  }
  WFPG_HD float pdf_part(bool narrow, vec3 outgoing, vec3 incident) const {
    return narrow ? 0.0f : base.pdf(outgoing, incident);
  }
};
static_assert(wfpg::has_separate_parts_v<parted_coat>);

/// Light of the sky that a surface reflects, by the midpoint rule; delta lobes aside.
template <class Bsdf>
double reflected(const Bsdf& bsdf, vec3 outgoing) {
  constexpr int rows = 800, columns = 1600;
  double sum = 0.0;
  for (int i = 0; i < rows * columns; ++i) {
    const double z = 2.0 * (i / columns + 0.5) / rows - 1.0;
    const double turn = 2.0 * double(wfpg::pi) * (i % columns + 0.5) / columns, r = std::sqrt(1.0 - z * z);
    const vec3 d(r * std::cos(turn), r * std::sin(turn), z);
    if (bsdf.transmits() || glm::dot(d, up) > 0.0f) sum += double(sky(d)) * double(bsdf.eval(outgoing, d));
  }
  return sum * 4.0 * double(wfpg::pi) / (rows * columns);
}

/// The mean of values, and how far it lies off an exact one in standard errors.
struct estimate : wfpg::testing::sample_mean {
  explicit estimate(const std::vector<float>& values) {
    for (const float v : values) add(double(v));
  }
  double deviation(double exact) const { return (mean() - exact) / error(); }
};

constexpr std::size_t many = 1u << 20;

/// Whether an estimate agrees with the exact value, and could tell it from one that is 1% off.
void check_unbiased(const std::vector<float>& values, double exact) {
  const estimate found(values);
  INFO("exact " << exact << ", found " << found.mean() << " +- " << found.error());
  CHECK(std::abs(found.deviation(exact)) < 4.0);
  CHECK(std::abs(found.deviation(1.01 * exact)) > 4.0);
}
void check_biased(const std::vector<float>& values, double exact) {
  const estimate found(values);
  INFO("exact " << exact << ", found " << found.mean() << " +- " << found.error());
  CHECK(std::abs(found.deviation(exact)) > 4.0);
}

/// One sample of a coated surface, as a host's kernel takes it with the mixture.
struct sample_in_kernel {
  kernel_mixture mixture;
  coated bsdf;
  vec3 outgoing;
  bool forgets_choice = false;  ///< planted: the mirror's probability without the choice of the BSDF

  WFPG_HD float operator()(std::size_t i) const {
    const hashed_numbers random{7};
    const auto ray = static_cast<std::uint32_t>(i);
    float u = random(ray, 0).x;
    const vec2 u2 = random(ray, 1);
    if (mixture.choose(u)) {
      const vec3 wi = mixture.sample(u2);
      return sky(wi) * bsdf.eval(outgoing, wi) / mixture.pdf(wi, bsdf.pdf(outgoing, wi));
    }
    const wfpg::bsdf_sample drawn = bsdf.sample(outgoing, {u, u2.y});
    if (!drawn.is_delta)
      return sky(drawn.direction) * bsdf.eval(outgoing, drawn.direction) /
             mixture.pdf(drawn.direction, drawn.pdf);
    const float pdf = forgets_choice ? drawn.pdf : mixture.delta_pdf(drawn.pdf);
    return sky(drawn.direction) * coated::delta_value() / pdf;
  }
};

/// One sample of a surface that samples its BSDF and the mixture's field in the library.
template <class Bsdf>
struct sample_in_library {
  guide_mixture mixture;
  wfpg::surface<Bsdf> surface;

  WFPG_HD float operator()(std::size_t i) const {
    const hashed_numbers random{9};
    const auto ray = static_cast<std::uint32_t>(i);
    const sampled_direction d = mixture.sample(surface, random(ray, 0).x, random(ray, 1));
    if (d.technique == sampling_technique::none) return 0.0f;
    const bool delta = d.technique == sampling_technique::delta;
    return sky(d.direction) *
           (delta ? coated::delta_value() : surface.bsdf.eval(surface.outgoing, d.direction)) / d.pdf;
  }
};

/// A BSDF whose density is known by an estimate alone: the true one times 0.4 or 1.6, at random.
struct sample_estimated {
  kernel_mixture mixture;
  test_bsdf bsdf;
  vec3 outgoing;
  bool uses_own = false;  ///< planted: the density that the sample itself came with

  WFPG_HD static float noise(vec2 u) { return u.x < 0.5f ? 0.4f : 1.6f; }

  WFPG_HD float operator()(std::size_t i) const {
    const hashed_numbers random{11};
    const auto ray = static_cast<std::uint32_t>(i);
    float u = random(ray, 0).x;
    const vec2 u2 = random(ray, 1);
    const float fresh = noise(random(ray, 2));
    if (mixture.choose(u)) {
      const vec3 wi = mixture.sample(u2);
      return sky(wi) * bsdf.eval(outgoing, wi) / mixture.pdf(wi, fresh * bsdf.pdf(outgoing, wi));
    }
    // The sample's own density comes from how its direction was found: large where f is. f / pdf is exact.
    const wfpg::bsdf_sample drawn = bsdf.sample(outgoing, u2);
    if (!(drawn.pdf > 0.0f)) return 0.0f;
    const float own = drawn.pdf * (1.0f + 0.6f * std::sin(40.0f * drawn.direction.x));
    const float value = bsdf.eval(outgoing, drawn.direction) / drawn.pdf;  // f / pdf of the sample
    const float density = uses_own ? 1.6f * own : fresh * drawn.pdf;
    return sky(drawn.direction) * value * density / mixture.pdf(drawn.direction, density);
  }
};

struct choice_of_number {
  kernel_mixture mixture;
  WFPG_HD vec2 operator()(std::size_t i) const {
    float u = (static_cast<float>(i) + 0.5f) / static_cast<float>(many);
    const bool guided = mixture.choose(u);
    return {u, guided ? 1.0f : 0.0f};
  }
};

/// A direction of the library's mixture, with what kernels need to know of the guide's share.
struct shared_direction {
  sampled_direction sampled;
  float guide_pdf;
  wfpg::guide_share by_kernel;
};

WFPG_TEST_CASE("mixture: choose() takes its fraction and leaves a uniform number", "[mixture]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16, 0.05f);
  for (const float fraction : {0.0f, 0.25f, 0.7f, 1.0f}) {
    const kernel_mixture mixture{directional_field(built.grid()), fraction, 5};
    std::array<std::array<double, 16>, 2> counts{};
    bool in_range = true;
    for (const vec2 chosen : evaluate(exec, many, choice_of_number{mixture})) {
      in_range = in_range && chosen.x >= 0.0f && chosen.x < 1.0f;
      counts[chosen.y > 0.0f ? 1 : 0][std::min(std::size_t(chosen.x * 16.0f), std::size_t(15))] += 1.0;
    }
    INFO("fraction " << fraction);
    CHECK(in_range);
    // Numbers were evenly spaced: each bin has its part but for rounding at its ends.
    for (int guided = 0; guided < 2; ++guided)
      for (const double count : counts[guided])
        CHECK(std::abs(count - (guided ? fraction : 1.0f - fraction) * double(many) / 16.0) < 8.0);
  }
}

WFPG_TEST_CASE("mixture: a kernel's density is that of the library's mixture", "[mixture]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16, 0.05f);
  const wfpg::surface<coated> s{{}, up, up, toward_eye, coated{{bsdf_kind::lambert, up}, true}, true};
  for (const directional_field& field :
       {directional_field(built.grid()), directional_field(built.grid(), up)})
    for (const float fraction : {0.0f, 0.3f, 0.7f}) {
      const guide_mixture whole{field, fraction, 5};
      const kernel_mixture mixture = whole.with(s.bsdf.glossy(toward_eye));
      CHECK(mixture.fraction == Approx(fraction * (1.0f - coated::mirror)));
      CHECK(mixture.number == (fraction > 0.0f ? 5 : wfpg::no_field));
      std::size_t differing = 0;
      for (const vec2 pair : evaluate(exec, 1000, [=] WFPG_HD(std::size_t i) {
             const vec3 d = wfpg::square_to_sphere(hashed_numbers{3}(static_cast<std::uint32_t>(i), 0));
             return vec2(whole.pdf(s, d), mixture.pdf(d, s.bsdf.pdf(s.outgoing, d)));
           }))
        differing += alike(pair.x, pair.y) ? 0 : 1;
      CHECK(differing == 0);
    }
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, inf, -1.0f}) CHECK(kernel_mixture().pdf(up, bad) == 0.0f);
  CHECK(kernel_mixture().pdf(up, 0.25f) == 0.25f);
}

WFPG_TEST_CASE("mixture: a direction has the guide's share of its density", "[mixture]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16, 0.05f);
  const directional_field field(built.grid(), up);
  // The delta lobe leaves the guide 0.7 of its fraction: the surface is narrow, and has the narrow fraction.
  for (const bool is_coated : {false, true}) {
    const wfpg::surface<coated> s{{}, up, up, toward_eye, coated{{bsdf_kind::lambert, up}, is_coated}, true};
    const guide_mixture whole{field, 0.7f, 5, 0.4f};
    const kernel_mixture mixture = whole.with(s.bsdf.glossy(toward_eye));
    const float kept = is_coated ? 1.0f - coated::mirror : 1.0f, fraction = is_coated ? 0.4f : 0.7f;
    CHECK(mixture.kept == Approx(kept));
    CHECK(mixture.fraction == Approx(fraction * kept));
    std::size_t differing = 0, by_kernel = 0, known = 0;
    for (const shared_direction& one : evaluate(exec, 2000, [=] WFPG_HD(std::size_t i) {
           const hashed_numbers random{9};
           const auto ray = static_cast<std::uint32_t>(i);
           const sampled_direction sampled = whole.sample(s, random(ray, 0).x, random(ray, 1));
           return shared_direction{sampled, field.pdf(sampled.direction),
                                   mixture.share(sampled.direction, sampled.pdf)};
         })) {
      const sampled_direction& d = one.sampled;
      if (!d.share.is_known()) continue;  // of the delta lobe
      ++known;
      const double share = double(fraction * kept * one.guide_pdf) / double(d.pdf);
      const double steps = is_coated ? share / double(kept) * wfpg::guide_share::narrow_steps
                                     : share * wfpg::guide_share::smooth_steps;
      differing += d.share.is_narrow() != is_coated || std::abs(d.share.steps() - steps) > 0.51;
      by_kernel += d.share.code != one.by_kernel.code;
    }
    CHECK(known > 1000);
    CHECK(differing == 0);
    CHECK(by_kernel < 20);  // rounded alike, but for the last bit
  }
}

WFPG_TEST_CASE("mixture: a kernel that samples delta and other lobes has no bias", "[mixture]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16, 0.05f);
  const coated bsdf{{bsdf_kind::lambert, up}, true};
  const double exact =
      reflected(bsdf, toward_eye) + double(coated::delta_value() * sky(bsdf.mirrored(toward_eye)));
  for (const directional_field& field :
       {directional_field(built.grid()), directional_field(built.grid(), up)}) {
    const kernel_mixture mixture = guide_mixture{field, 0.7f, 5}.with(bsdf.glossy(toward_eye));
    check_unbiased(evaluate(exec, many, sample_in_kernel{mixture, bsdf, toward_eye}), exact);
    check_biased(evaluate(exec, many, sample_in_kernel{mixture, bsdf, toward_eye, true}), exact);
  }
}

template <class Bsdf, class Exec>
void check_delta_lobes(const Exec& exec, const directional_field& field, const Bsdf& bsdf) {
  const wfpg::surface<Bsdf> s{{}, up, up, toward_eye, bsdf, true};
  const double exact =
      reflected(bsdf, toward_eye) + double(coated::delta_value() * sky(bsdf.mirrored(toward_eye)));
  for (const float fraction : {0.0f, 0.7f})
    check_unbiased(evaluate(exec, many, sample_in_library<Bsdf>{{field, fraction, 5}, s}), exact);
  // A delta lobe's density is a probability, from which no field may learn.
  std::size_t wrong = 0, mirrored = 0;
  const guide_mixture mixture{field, 0.7f, 5};
  for (const sampled_direction& d : evaluate(exec, 4000, [=] WFPG_HD(std::size_t i) {
         const hashed_numbers random{9};
         const auto ray = static_cast<std::uint32_t>(i);
         return mixture.sample(s, random(ray, 0).x, random(ray, 1));
       })) {
    const bool is_delta = d.technique == sampling_technique::delta;
    wrong += is_delta != (d.field == wfpg::no_field) || d.technique == sampling_technique::none;
    mirrored += is_delta;
  }
  CHECK(wrong == 0);
  CHECK(mirrored > 0);
  if (bsdf.tells_part) CHECK(mirrored > 1000);  // as often as by the BSDF alone: 0.3 of 4000
}

WFPG_TEST_CASE("mixture: the library guides what is not delta in a BSDF, without bias", "[mixture]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16, 0.05f);
  const directional_field field(built.grid(), up);
  check_delta_lobes(exec, field, coated{{bsdf_kind::lambert, up}, false});
  check_delta_lobes(exec, field, parted_coat{{{bsdf_kind::lambert, up}, true}});
}

WFPG_TEST_CASE("mixture: fresh estimates of the BSDF's density leave no bias", "[mixture]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16, 0.05f);
  const test_bsdf bsdf{bsdf_kind::lambert, up};
  const double exact = reflected(bsdf, toward_eye);
  const kernel_mixture mixture{directional_field(built.grid(), up), 0.5f, 5};
  check_unbiased(evaluate(exec, many, sample_estimated{mixture, bsdf, toward_eye}), exact);
  check_biased(evaluate(exec, many, sample_estimated{mixture, bsdf, toward_eye, true}), exact);
}

}  // namespace

TEST_CASE("mixture: a lobe's density at the mirrored direction tells its roughness", "[mixture]") {
  CHECK(glossy_part::unknown(0.0f).fraction == 0.0f);
  CHECK(glossy_part::unknown(-1.0f).fraction == 0.0f);
  CHECK(glossy_part::unknown(std::numeric_limits<float>::quiet_NaN()).fraction == 0.0f);
  for (const float alpha : {0.05f, 0.1f, 0.3f, 0.5f}) {
    const float pdf = 1.0f / (4.0f * wfpg::pi * alpha * alpha);  // of GGX along the normal
    const glossy_part part = glossy_part::unknown(pdf);
    CHECK(part.fraction == 1.0f);
    CHECK(part.alpha == Approx(alpha));
  }
  // A diffuse surface keeps the whole fraction, a narrow lobe a quarter, a delta lobe nothing.
  const float resolved = directional_field::resolved_alpha();
  CHECK(wfpg::guided_fraction(0.8f, glossy_part::unknown(1.0f / wfpg::pi), resolved) == Approx(0.8f));
  CHECK(wfpg::guided_fraction(0.8f, glossy_part::unknown(31.0f), resolved) > 0.2f);
  CHECK(wfpg::guided_fraction(0.8f, glossy_part::unknown(1e6f), resolved) == 0.0f);
  CHECK(wfpg::guided_fraction(0.8f, {1.0f, 0.0f}, resolved) == 0.0f);
  CHECK(wfpg::guided_fraction(0.8f, {0.5f, 0.0f}, resolved) == Approx(0.4f));
  CHECK(wfpg::guided_fraction(0.8f, glossy_part::none(), resolved) == 0.8f);
}

namespace {

/// A walk that gathers 1 at each vertex and goes on with a weight of 0.8: it brings 5 in the mean. Roulette
/// hears random numbers of what is to come.
struct walk {
  bool keeps_weight = false;  ///< planted: survivors are not weighted

  WFPG_HD float operator()(std::size_t i) const {
    const hashed_numbers random{13};
    float throughput = 1.0f, sum = 0.0f;
    for (std::uint32_t depth = 0; depth < 200; ++depth) {
      sum += throughput;
      throughput *= 0.8f;
      const vec2 u = random(static_cast<std::uint32_t>(i), depth);
      const float survival = wfpg::guided_survival(throughput, 4.0f * (0.2f + u.y), 5.0f);
      if (!(u.x < survival)) break;
      if (!keeps_weight) throughput /= survival;
    }
    return sum;
  }
};

WFPG_TEST_CASE("roulette: guided roulette has no bias, whatever the guide expects", "[mixture]") {
  const Exec exec;
  check_unbiased(evaluate(exec, many, walk{}), 5.0);
  check_biased(evaluate(exec, many, walk{true}), 5.0);
}

}  // namespace

TEST_CASE("roulette: paths survive by what they are expected to bring to their pixel", "[mixture]") {
  CHECK(wfpg::guided_survival(1.0f, 2.0f, 2.0f) == 1.0f);  // as bright as the pixel
  CHECK(wfpg::guided_survival(0.1f, 2.0f, 2.0f) == Approx(0.3f));
  CHECK(wfpg::guided_survival(0.1f, 20.0f, 2.0f) == 1.0f);  // dim so far, and light ahead
  CHECK(wfpg::guided_survival(1.0f, 0.0f, 2.0f) == Approx(0.1f));
  CHECK(wfpg::guided_survival(0.1f, 2.0f, 2.0f, {1.0f, 0.05f}) == Approx(0.1f));
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, inf, -1.0f}) {
    CHECK(wfpg::guided_survival(bad, 1.0f, 1.0f) == 1.0f);
    CHECK(wfpg::guided_survival(1.0f, bad, 1.0f) == 1.0f);
    CHECK(wfpg::guided_survival(1.0f, 1.0f, bad) == 1.0f);
  }
  CHECK(wfpg::guided_survival(1.0f, 1.0f, 0.0f) == 1.0f);
}

TEST_CASE("roulette: the scale undoes the guide's density, and bad densities change nothing", "[mixture]") {
  // A path of three bounces: the throughput with a guide times the scales is that without.
  float guided = 1.0f, unguided = 1.0f, scale = 1.0f;
  for (const vec2 densities : {vec2(0.2f, 3.0f), vec2(0.31f, 0.1f), vec2(0.5f, 11.0f)}) {
    const float value = 0.25f;
    guided *= value / densities.y;
    unguided *= value / densities.x;
    scale *= wfpg::roulette_scale(densities.x, densities.y);
  }
  CHECK(guided * scale == Approx(unguided));
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const float bad : {0.0f, -1.0f, nan, inf}) {
    CHECK(wfpg::roulette_scale(bad, 1.0f) == 1.0f);
    CHECK(wfpg::roulette_scale(1.0f, bad) == 1.0f);
  }
  CHECK(wfpg::roulette_scale(1e-30f, 1.0f) == 0x1p20f);
  CHECK(wfpg::roulette_scale(1e30f, 1.0f) == 0x1p-20f);
}
