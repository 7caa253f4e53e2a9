// Multiple importance sampling: the heuristics, and mixtures of a field and a BSDF of one or two lobes. A
// mixture's density must match the frequency of its directions.
#include "support/evaluate.hpp"
#include "support/fields.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/statistics.hpp"

#include <wfpg/sampling/mis.hpp>
#include <wfpg/sampling/mixture.hpp>

#include <cmath>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::directional_field;
using wfpg::guide_mixture;
using wfpg::sampled_direction;
using wfpg::sampling_technique;

namespace {

template <class Surface>
struct draw_mixture {
  guide_mixture mixture;
  Surface surface;
  std::uint64_t seed;
  wfpg::array_view<sampled_direction> drawn;
  WFPG_HD void operator()(std::size_t i) const {
    const hashed_numbers random{seed};
    const auto ray = static_cast<std::uint32_t>(i);
    drawn[i] = mixture.sample(surface, random(ray, 0).x, random(ray, 1));
  }
};

template <class Exec, class Surface>
std::vector<sampled_direction> draw(const Exec& exec, const guide_mixture& mixture, const Surface& surface,
                                    std::size_t n, std::uint64_t seed) {
  const wfpg::buffer<sampled_direction, Exec> drawn(exec, n);
  exec.for_each(n, draw_mixture<Surface>{mixture, surface, seed, drawn.view()});
  return drawn.to_host(exec);
}

/// The mixture's density of directions.
template <class Surface>
struct mixture_pdf {
  guide_mixture mixture;
  Surface surface;
  WFPG_HD float operator()(vec3 direction) const { return mixture.pdf(surface, direction); }
};
template <class Surface>
mixture_pdf(guide_mixture, Surface) -> mixture_pdf<Surface>;

struct field_pdf {
  directional_field field;
  WFPG_HD float operator()(vec3 direction) const { return field.pdf(direction); }
};

/// The density of sampled directions, evaluated on the policy that sampled them.
template <class Exec, class Pdf>
std::vector<float> densities(const Exec& exec, const Pdf& pdf, const std::vector<sampled_direction>& drawn) {
  std::vector<vec3> directions;
  for (const sampled_direction& d : drawn) directions.push_back(d.direction);
  return evaluate(exec, directions, pdf);
}

std::size_t count(const std::vector<sampled_direction>& drawn, sampling_technique technique) {
  std::size_t n = 0;
  for (const sampled_direction& d : drawn) n += d.technique == technique;
  return n;
}

constexpr float fractions[] = {0.0f, 0.3f, 0.7f, 1.0f};

}  // namespace

TEST_CASE("MIS: heuristics sum to one, at any scale of the densities", "[mis]") {
  for (float p : {1e-30f, 1e-3f, 1.0f, 7.0f, 1e20f, 1e30f})
    for (float q : {1e-30f, 1e-3f, 1.0f, 7.0f, 1e20f, 1e30f}) {
      INFO("p " << p << ", q " << q);
      CHECK(wfpg::balance_heuristic(p, q) + wfpg::balance_heuristic(q, p) == Approx(1.0f));
      CHECK(wfpg::power_heuristic(p, q) + wfpg::power_heuristic(q, p) == Approx(1.0f));
    }
  CHECK(wfpg::balance_heuristic(3.0f, 1.0f) == Approx(0.75f));
  CHECK(wfpg::power_heuristic(3.0f, 1.0f) == Approx(0.9f));
  CHECK(wfpg::balance_heuristic(0.0f, 0.0f) == 0.0f);
  CHECK(wfpg::power_heuristic(0.0f, 0.0f) == 0.0f);
  CHECK(wfpg::balance_heuristic(2.0f, 0.0f) == 1.0f);
  CHECK(wfpg::power_heuristic(2.0f, 0.0f) == 1.0f);
}

namespace {

WFPG_TEST_CASE("MIS: the mixture's density is its sampling frequency", "[mis]") {
  const Exec exec;
  const std::size_t samples = 20000;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16, 0.05f);
  chi_square_family family;
  for (const directional_field& field :
       {directional_field(built.grid()), directional_field(built.grid(), up)})
    for (bsdf_kind kind : {bsdf_kind::lambert, bsdf_kind::glass})
      for (float fraction : fractions) {
        const test_surface surface = make_surface({}, up, toward_eye, kind);
        const guide_mixture mixture{field, fraction};
        const auto drawn = draw(exec, mixture, surface, samples, 5 + family.size());
        std::vector<drawn_direction> directions;
        for (const sampled_direction& d : drawn) directions.push_back({d.direction, d.pdf});
        sampler_check_options options;
        options.moments = fraction == 0.3f;
        const auto report =
            check_sampler(directions, densities_by{exec, mixture_pdf{mixture, surface}}, options);
        INFO("fraction " << fraction << ": " << report.message);
        CHECK(report);
        family.add(report.frequencies, "fraction " + std::to_string(fraction));

        const double guided = double(count(drawn, sampling_technique::guide)) / double(samples);
        const double sigma = std::sqrt(fraction * (1.0 - fraction) / double(samples));
        CHECK(std::abs(guided - fraction) <= 4.0 * sigma);
        CHECK(count(drawn, sampling_technique::none) == 0);
      }
  INFO(family.message());
  CHECK(family.accepted());
}

WFPG_TEST_CASE("MIS: a query's density is the sample's, bit for bit", "[mis][bits]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::extreme, 31, 3), 31);
  for (const directional_field& field :
       {directional_field(built.grid()), directional_field(built.grid(), up)})
    for (bsdf_kind kind : {bsdf_kind::lambert, bsdf_kind::glossy, bsdf_kind::glass})
      for (float fraction : fractions) {
        const test_surface surface = make_surface({}, up, toward_eye, kind);
        const guide_mixture mixture{field, fraction};
        const auto drawn = draw(exec, mixture, surface, 500, 11);
        const auto asked = densities(exec, mixture_pdf{mixture, surface}, drawn);
        std::size_t differing = 0;
        for (std::size_t i = 0; i < drawn.size(); ++i) {
          if (drawn[i].technique == sampling_technique::none) continue;
          differing += drawn[i].pdf != asked[i] || !(drawn[i].pdf > 0.0f);
        }
        INFO("kind " << int(kind) << ", fraction " << fraction);
        CHECK(differing == 0);
      }
}

WFPG_TEST_CASE("MIS: the density is the weighted sum of the two", "[mis]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 9), 16);
  const directional_field field(built.grid());
  const test_surface surface = make_surface({}, up, toward_eye);
  random_numbers random(2);
  std::vector<vec3> directions;
  for (int i = 0; i < 100; ++i) directions.push_back(random.direction());
  const auto of_field = evaluate(exec, directions, field_pdf{field});
  for (float fraction : fractions) {
    const auto mixed = evaluate(exec, directions, mixture_pdf{{field, fraction}, surface});
    for (std::size_t i = 0; i < directions.size(); ++i)
      CHECK(mixed[i] ==
            Approx(fraction * of_field[i] + (1.0f - fraction) * surface.bsdf.pdf(toward_eye, directions[i])));
  }
}

WFPG_TEST_CASE("MIS: delta BSDFs are sampled alone", "[mis]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16);
  const test_surface surface = make_surface({}, up, toward_eye, bsdf_kind::mirror);
  const vec3 to_eye = toward_eye;
  const vec3 mirrored =
      evaluate(exec, [=] WFPG_HD() { return surface.bsdf.sample(to_eye, vec2(0.0f)).direction; });
  for (float fraction : fractions) {
    const guide_mixture mixture{directional_field(built.grid(), up), fraction};
    for (const sampled_direction& d : draw(exec, mixture, surface, 100, 1)) {
      CHECK(d.technique == sampling_technique::delta);
      CHECK(d.direction == mirrored);
      CHECK(d.pdf == 0.75f);
    }
    CHECK(evaluate(exec, std::vector<vec3>{mirrored}, mixture_pdf{mixture, surface}) ==
          std::vector<float>{0.0f});
  }
}

WFPG_TEST_CASE("MIS: fraction 0 and an empty field leave the BSDF, fraction 1 the field", "[mis]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16);
  const directional_field field(built.grid(), up);
  const test_surface surface = make_surface({}, up, toward_eye);
  const vec3 to_eye = toward_eye;
  const auto alone = evaluate(exec, 200, [=] WFPG_HD(std::size_t i) {
    return surface.bsdf.sample(to_eye, hashed_numbers{4}(static_cast<std::uint32_t>(i), 1));
  });
  for (const guide_mixture& mixture :
       {guide_mixture{field, 0.0f}, guide_mixture{{}, 0.7f}, guide_mixture{}}) {
    const auto drawn = draw(exec, mixture, surface, 200, 4);
    CHECK(count(drawn, sampling_technique::bsdf) == drawn.size());
    for (std::uint32_t i = 0; i < drawn.size(); ++i) {
      CHECK(alike(drawn[i].direction, alone[i].direction));
      CHECK(alike(drawn[i].pdf, alone[i].pdf));
    }
  }
  const auto guided = draw(exec, {field, 1.0f}, surface, 200, 4);
  CHECK(count(guided, sampling_technique::guide) == guided.size());
  const auto asked = densities(exec, field_pdf{field}, guided);
  for (std::size_t i = 0; i < guided.size(); ++i) CHECK(alike(guided[i].pdf, asked[i]));
}

WFPG_TEST_CASE("MIS: a BSDF whose sampling fails ends the path", "[mis]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16);
  const test_surface surface = make_surface({}, up, toward_eye, bsdf_kind::black);
  const guide_mixture mixture{directional_field(built.grid(), up), 0.5f};
  const auto drawn = draw(exec, mixture, surface, 1000, 6);
  const std::size_t failed = count(drawn, sampling_technique::none);
  CHECK(failed > 400);
  CHECK(failed < 600);
  CHECK(failed + count(drawn, sampling_technique::guide) == drawn.size());
  const auto asked = densities(exec, mixture_pdf{mixture, surface}, drawn);
  for (std::size_t i = 0; i < drawn.size(); ++i)
    if (drawn[i].technique == sampling_technique::none) {
      CHECK(drawn[i].pdf == 0.0f);
      CHECK(drawn[i].direction == vec3(0.0f));
    } else {
      CHECK(alike(drawn[i].pdf, asked[i]));
    }
}

/// A cosine lobe and a lobe about the mirrored direction. A random number chooses one, and the density is the
/// sum. It does not report its parts.
struct two_lobes {
  static constexpr float narrow_fraction = 0.4f;

  test_bsdf wide, narrow;

  WFPG_HD explicit two_lobes(vec3 normal)
      : wide{bsdf_kind::lambert, normal}, narrow{bsdf_kind::glossy, normal} {}

  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return false; }
  WFPG_HD float eval(vec3 outgoing, vec3 incident) const {
    return 0.3f * wide.eval(outgoing, incident) + 0.6f * narrow.eval(outgoing, incident);
  }
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    return (1.0f - narrow_fraction) * wide.pdf(outgoing, incident) +
           narrow_fraction * narrow.pdf(outgoing, incident);
  }
  WFPG_HD wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    const bool is_narrow = u.x < narrow_fraction;
    const float rest = is_narrow ? u.x / narrow_fraction : (u.x - narrow_fraction) / (1.0f - narrow_fraction);
    wfpg::bsdf_sample drawn = (is_narrow ? narrow : wide).sample(outgoing, {std::fmin(rest, 0.999999f), u.y});
    if (drawn.pdf > 0.0f) drawn.pdf = pdf(outgoing, drawn.direction);
    return drawn;
  }
};

/// Reports how narrow the lobe is, so that it is guided less.
struct reported_lobes : two_lobes {
  using two_lobes::two_lobes;
  WFPG_HD wfpg::glossy_part glossy(vec3) const { return {narrow_fraction, 0.2f}; }
};

/// Also samples each of its lobes alone.
struct separate_lobes : reported_lobes {
  using reported_lobes::reported_lobes;
  WFPG_HD wfpg::bsdf_sample sample_part(bool glossy, vec3 outgoing, vec2 u) const {
    return (glossy ? narrow : wide).sample(outgoing, u);
  }
  WFPG_HD float pdf_part(bool glossy, vec3 outgoing, vec3 incident) const {
    return (glossy ? narrow : wide).pdf(outgoing, incident);
  }
};

static_assert(wfpg::is_bsdf_v<two_lobes> && !wfpg::has_glossy_part_v<two_lobes>);
static_assert(wfpg::is_bsdf_v<reported_lobes> && !wfpg::has_separate_parts_v<reported_lobes>);
static_assert(wfpg::is_bsdf_v<separate_lobes> && wfpg::has_separate_parts_v<separate_lobes>);

float sky(vec3 d) {
  return 0.2f + std::exp(3.0f * glm::dot(d, glm::normalize(vec3(0.1f, 0.3f, 0.9f))) - 2.0f);
}

/// Light of the sky that a surface reflects, by the midpoint rule.
template <class Bsdf>
double reflected(const wfpg::surface<Bsdf>& s) {
  constexpr int rows = 400, columns = 800;
  const double pi = 3.14159265358979323846;
  double sum = 0.0;
  for (int i = 0; i < rows * columns; ++i) {
    const double z = 2.0 * (i / columns + 0.5) / rows - 1.0, turn = 2.0 * pi * (i % columns + 0.5) / columns;
    const double r = std::sqrt(1.0 - z * z);
    const vec3 d(r * std::cos(turn), r * std::sin(turn), z);
    if (s.bsdf.transmits() || glm::dot(d, s.normal) > 0.0f)
      sum += double(sky(d)) * double(s.bsdf.eval(s.outgoing, d));
  }
  return sum * 4.0 * pi / (rows * columns);
}

/// Standard errors between the estimate and the exact value. `missing` is subtracted from the densities.
template <class Bsdf, class Missing>
double deviation(const wfpg::surface<Bsdf>& s, const std::vector<sampled_direction>& drawn, double exact,
                 const Missing& missing) {
  double sum = 0.0, squares = 0.0;
  for (const sampled_direction& d : drawn) {
    double value = 0.0;
    if (d.technique != sampling_technique::none)
      value = double(sky(d.direction)) * double(s.bsdf.eval(s.outgoing, d.direction)) /
              double(d.pdf - missing(d.direction));
    sum += value;
    squares += value * value;
  }
  const double n = double(drawn.size()), mean = sum / n;
  return (mean - exact) / std::sqrt((squares / n - mean * mean) / n);
}

/// Checks frequencies, fractions and estimates of a mixture of fields and a BSDF of two lobes. A density
/// without one of the lobes would be found.
template <class Bsdf, class Exec>
void check_two_lobes(const Exec& exec, chi_square_family& family) {
  constexpr std::size_t samples = 40000;
  const vec3 outgoing = glm::normalize(up + vec3(0.25f, 0.0f, 0.1f));  // the whole lobe is above the surface
  const wfpg::surface<Bsdf> s{{}, up, up, outgoing, Bsdf(up), true};
  const double exact = reflected(s);
  const built_field<Exec> built(exec, field_values(field_kind::noise, 16, 3), 16, 0.05f);
  for (const guide_mixture& mixture : {guide_mixture{directional_field(built.grid()), 0.3f},
                                       guide_mixture{directional_field(built.grid(), up), 0.7f}}) {
    const auto drawn = draw(exec, mixture, s, samples, 21 + family.size());
    INFO("fraction " << mixture.fraction);
    if (!mixture.field.hemisphere()) {
      std::vector<drawn_direction> directions;
      for (const sampled_direction& d : drawn) directions.push_back({d.direction, d.pdf});
      sampler_check_options options;
      options.moments = false;
      const auto report = check_sampler(directions, densities_by{exec, mixture_pdf{mixture, s}}, options);
      INFO(report.message);
      CHECK(report);
      family.add(report.frequencies, "BSDF " + std::to_string(family.size()));
    }

    const wfpg::mixture_fractions parts = mixture.fractions_of(s);
    CHECK(parts.guide + parts.glossy + parts.smooth == Approx(1.0f));
    const double guide = double(parts.guide), guided = double(count(drawn, sampling_technique::guide));
    CHECK(std::abs(guided / samples - guide) <= 4.0 * std::sqrt(guide * (1.0 - guide) / samples));

    CHECK(std::abs(deviation(s, drawn, exact, [](vec3) { return 0.0f; })) < 4.0);
    const bool apart = parts.glossy > 0.0f;
    const float narrow = apart ? parts.glossy : parts.smooth * Bsdf::narrow_fraction;
    const float wide = apart ? parts.smooth : parts.smooth * (1.0f - Bsdf::narrow_fraction);
    const auto of_narrow = [&](vec3 d) { return narrow * s.bsdf.narrow.pdf(outgoing, d); };
    const auto of_wide = [&](vec3 d) { return wide * s.bsdf.wide.pdf(outgoing, d); };
    CHECK(deviation(s, drawn, exact, of_narrow) > 8.0);
    CHECK(deviation(s, drawn, exact, of_wide) > 8.0);
  }
}

WFPG_TEST_CASE("MIS: with a BSDF of two lobes the density has both, and estimates have no bias", "[mis]") {
  const Exec exec;
  chi_square_family family;
  check_two_lobes<two_lobes>(exec, family);
  check_two_lobes<reported_lobes>(exec, family);
  check_two_lobes<separate_lobes>(exec, family);
  INFO(family.message());
  CHECK(family.accepted());
}

}  // namespace
