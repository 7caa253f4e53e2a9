// check_bsdf: correct BSDFs pass, and each of many faults is found and named.
#include "support/policies.hpp"
#include "support/reports.hpp"
#include "support/scenes.hpp"

#include <wfpg/testing/check_bsdf.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::bsdf_sample;
using wfpg::testing::bsdf_check_options;
using wfpg::testing::check_bsdf;
using wfpg::testing::sphere_bins;

namespace {

using wfpg::pi;
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
const vec3 tilted = glm::normalize(vec3(0.3f, -0.5f, 0.7f));

bsdf_check_options options_for(bsdf_kind kind, vec3 normal) {
  bsdf_check_options options{normal};
  // Their values are constant or symmetric, including the cosine.
  options.reciprocal = kind != bsdf_kind::glossy && kind != bsdf_kind::glass;
  return options;
}

// BSDFs with one fault.

enum class bsdf_fault {
  none,
  large_pdf,
  no_jacobian,
  uniform_pdf,
  empty_sector,
  fails_in_sector,
  nan_at_grazing,
  infinite_sample,
  negative_eval,
  eval_beyond_pdf,
  bright,
  not_reciprocal,
  long_direction,
  leaks,
};

/// A Lambert BSDF of albedo 0.8 about `normal`, with one fault.
struct faulty_bsdf {
  bsdf_fault fault = bsdf_fault::none;
  vec3 normal{0.0f, 0.0f, 1.0f};

  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return false; }

  WFPG_HD float eval(vec3 outgoing, vec3 incident) const {
    const float out = glm::dot(outgoing, normal), in = glm::dot(incident, normal);
    if (fault == bsdf_fault::leaks && out > 0.0f) return 0.1f * std::fabs(in);
    if (out <= 0.0f || in <= 0.0f) return 0.0f;
    if (fault == bsdf_fault::nan_at_grazing && in < 0.01f) return nan_value;
    if (fault == bsdf_fault::negative_eval && in > 0.99f) return -0.1f;
    if (fault == bsdf_fault::bright) return 1.05f * in / pi;
    if (fault == bsdf_fault::not_reciprocal) return (0.4f + 0.4f * in) * in / pi;
    return 0.8f * in / pi;
  }
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    const float in = glm::dot(incident, normal);
    if (fault == bsdf_fault::leaks && glm::dot(outgoing, normal) > 0.0f) return std::fabs(in) / (2.0f * pi);
    if (glm::dot(outgoing, normal) <= 0.0f || in <= 0.0f) return 0.0f;
    if (fault == bsdf_fault::uniform_pdf) return 0.5f / pi;
    if (fault == bsdf_fault::eval_beyond_pdf && in_sector(incident)) return 0.0f;
    return (fault == bsdf_fault::large_pdf ? 1.02f : 1.0f) * in / pi;
  }
  WFPG_HD bsdf_sample sample(vec3 outgoing, vec2 u) const {
    if (glm::dot(outgoing, normal) <= 0.0f) return {};
    const float turn = 2.0f * pi * u.y * (fault == bsdf_fault::empty_sector ? 0.9f : 1.0f);
    const float z = std::sqrt(1.0f - u.x), r = std::sqrt(u.x);
    const wfpg::frame axes(normal);
    vec3 d = glm::normalize(axes.to_world({r * std::cos(turn), r * std::sin(turn), z}));
    if (fault == bsdf_fault::fails_in_sector && in_sector(d)) return {};
    if (fault == bsdf_fault::leaks && std::fmod(u.x * 1024.0f, 1.0f) < 0.5f) d = -d;
    float density = pdf(outgoing, d);
    if (fault == bsdf_fault::no_jacobian) density = z;
    if (fault == bsdf_fault::infinite_sample && u.x > 0.999f) density = infinity;
    if (fault == bsdf_fault::long_direction) d *= 1.01f;
    return {d, density};
  }

 private:
  WFPG_HD bool in_sector(vec3 d) const {
    const vec3 local = wfpg::frame(normal).to_local(d);
    return local.x > 0.0f && std::fabs(local.y) < 0.5f * local.x;
  }
};

/// A mirror with one fault.
struct faulty_mirror {
  float probability = 1.0f, value = 0.0f;
  WFPG_HD bool is_delta() const { return true; }
  WFPG_HD bool transmits() const { return false; }
  WFPG_HD float eval(vec3, vec3) const { return value; }
  WFPG_HD float pdf(vec3, vec3) const { return 0.0f; }
  WFPG_HD bsdf_sample sample(vec3 outgoing, vec2) const {
    return {vec3(-outgoing.x, -outgoing.y, outgoing.z), outgoing.z > 0.0f ? probability : 0.0f};
  }
};

enum class part_fault { none, share, alpha, sum, sample_pdf, sample_shape };

/// 0.3 of its samples are uniform above the surface, the rest have a cosine density.
struct parted_bsdf {
  part_fault fault = part_fault::none;
  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return false; }
  WFPG_HD float eval(vec3 outgoing, vec3 incident) const {
    return outgoing.z > 0.0f && incident.z > 0.0f ? 0.5f * incident.z / pi : 0.0f;
  }
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    return 0.3f * part(true, outgoing, incident) + 0.7f * part(false, outgoing, incident);
  }
  WFPG_HD bsdf_sample sample(vec3 outgoing, vec2 u) const {
    const bool glossy = u.x < 0.3f;
    const vec3 d = draw(glossy, {glossy ? u.x / 0.3f : (u.x - 0.3f) / 0.7f, u.y});
    return {d, pdf(outgoing, d)};
  }
  WFPG_HD wfpg::glossy_part glossy(vec3) const {
    return {fault == part_fault::share ? 1.3f : 0.3f, fault == part_fault::alpha ? 1.5f : 0.7f};
  }
  WFPG_HD bsdf_sample sample_part(bool glossy, vec3 outgoing, vec2 u) const {
    const bool drawn = fault == part_fault::sample_shape ? !glossy : glossy;
    const vec3 d = draw(drawn, u);
    return {d, (fault == part_fault::sample_pdf ? 0.3f : 1.0f) * part(glossy, outgoing, d)};
  }
  WFPG_HD float pdf_part(bool glossy, vec3 outgoing, vec3 incident) const {
    return (fault == part_fault::sum ? 0.9f : 1.0f) * part(glossy, outgoing, incident);
  }

 private:
  WFPG_HD static float part(bool glossy, vec3 outgoing, vec3 incident) {
    if (outgoing.z <= 0.0f || incident.z <= 0.0f) return 0.0f;
    return glossy ? 0.5f / pi : incident.z / pi;
  }
  WFPG_HD static vec3 draw(bool glossy, vec2 u) {
    const float z = glossy ? 1.0f - u.x : std::sqrt(1.0f - u.x), turn = 2.0f * pi * u.y;
    const float r = std::sqrt(1.0f - z * z);
    return glm::normalize(vec3(r * std::cos(turn), r * std::sin(turn), z));
  }
};
static_assert(wfpg::has_separate_parts_v<parted_bsdf>);

enum class coat_fault { none, large_pdf, probability, silent };

/// A mirror that draws 0.3 of the samples, over a diffuse lobe; but for a fault.
struct coated_bsdf {
  coat_fault fault = coat_fault::none;
  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return false; }
  WFPG_HD float eval(vec3 outgoing, vec3 incident) const {
    return outgoing.z > 0.0f && incident.z > 0.0f ? 0.5f * incident.z / pi : 0.0f;
  }
  WFPG_HD float pdf(vec3 outgoing, vec3 incident) const {
    const float fraction = fault == coat_fault::large_pdf ? 1.0f : 0.7f;
    return outgoing.z > 0.0f && incident.z > 0.0f ? fraction * incident.z / pi : 0.0f;
  }
  WFPG_HD bsdf_sample sample(vec3 outgoing, vec2 u) const {
    if (outgoing.z <= 0.0f) return {};
    if (u.x < 0.3f)
      return {vec3(-outgoing.x, -outgoing.y, outgoing.z), fault == coat_fault::probability ? 1.3f : 0.3f,
              fault != coat_fault::silent};
    const float x = (u.x - 0.3f) / 0.7f, r = std::sqrt(x), turn = 2.0f * pi * u.y;
    const vec3 d = glm::normalize(vec3(r * std::cos(turn), r * std::sin(turn), std::sqrt(1.0f - x)));
    return {d, pdf(outgoing, d)};
  }
};

/// A rough boundary that scatters to both sides by Lambert's law. It reflects half, and transmits half with
/// radiance times the square of the ratio of indices. The index below is `ior`.
struct diffuse_boundary {
  float ior = 1.5f;
  bool scales_radiance = true;
  WFPG_HD bool is_delta() const { return false; }
  WFPG_HD bool transmits() const { return true; }
  WFPG_HD float eval(vec3 outgoing, vec3 incident) const {
    const float n_out = outgoing.z > 0.0f ? 1.0f : ior;
    const float scale = (scales_radiance ? n_out * n_out : 1.0f) / (ior * ior);
    return 0.5f * scale * std::fabs(incident.z) / pi;
  }
  WFPG_HD float pdf(vec3, vec3 incident) const { return 0.5f * std::fabs(incident.z) / pi; }
  WFPG_HD bsdf_sample sample(vec3 outgoing, vec2 u) const {
    const float side = u.x < 0.5f ? 1.0f : -1.0f, x = u.x < 0.5f ? 2.0f * u.x : 2.0f * u.x - 1.0f;
    const float z = std::sqrt(1.0f - x), r = std::sqrt(x), turn = 2.0f * pi * u.y;
    const vec3 d = glm::normalize(vec3(r * std::cos(turn), r * std::sin(turn), side * z));
    return {d, pdf(outgoing, d)};
  }
};

template <class Exec>
check_report check_faulty(bsdf_fault fault, bool reciprocal = true) {
  const Exec exec;
  bsdf_check_options options{tilted};
  options.reciprocal = reciprocal;
  return check_bsdf(exec, faulty_bsdf{fault, tilted}, options);
}

WFPG_TEST_CASE("check_bsdf: correct BSDFs pass", "[testing]") {
  const Exec exec;
  for (const bsdf_kind kind :
       {bsdf_kind::lambert, bsdf_kind::glossy, bsdf_kind::mirror, bsdf_kind::glass, bsdf_kind::black}) {
    INFO(int(kind));
    check_passes(check_bsdf(exec, test_bsdf{kind, tilted}, options_for(kind, tilted)));
  }
}

}  // namespace

TEST_CASE("check_bsdf: each fault is found and named", "[testing]") {
  check_passes(check_faulty<one_policy>(bsdf_fault::none));
  check_names(check_faulty<one_policy>(bsdf_fault::large_pdf),
              {"the integral of pdf()", "is 1.02, but the fraction", "is 1 of"});
  check_names(check_faulty<one_policy>(bsdf_fault::no_jacobian),
              {"pdf() disagrees with sample(): seen from (", "has pdf", "pdf() says"});
  check_names(check_faulty<one_policy>(bsdf_fault::uniform_pdf),
              {"sample() draws too", "z in [", "chi^2", "p = "});
  check_names(check_faulty<one_policy>(bsdf_fault::empty_sector),
              {"sample() draws too few", "phi in [", "observed 0", "p = "});
  check_names(check_faulty<one_policy>(bsdf_fault::fails_in_sector),
              {"sample() draws too few", "observed 0"});
  check_names(check_faulty<one_policy>(bsdf_fault::nan_at_grazing), {"eval() is ", "nan", "expected finite"});
  check_names(check_faulty<one_policy>(bsdf_fault::infinite_sample), {"sample() seen from", "gives pdf inf"});
  check_names(check_faulty<one_policy>(bsdf_fault::negative_eval),
              {"eval() is -0.1, expected finite and at least"});
  check_names(check_faulty<one_policy>(bsdf_fault::eval_beyond_pdf),
              {"eval() is ", "where pdf() is 0, expected a positive pdf()"});
  check_names(check_faulty<one_policy>(bsdf_fault::bright),
              {"energy is not conserved", "is 1.05, expected at most 1"});
  check_names(check_faulty<one_policy>(bsdf_fault::not_reciprocal), {"eval() is not reciprocal", "expected"});
  check_names(check_faulty<one_policy>(bsdf_fault::long_direction), {"of length 1.01, expected unit length"});
  check_names(check_faulty<one_policy>(bsdf_fault::leaks), {"through the surface", "transmits() is false"});
  check_passes(check_faulty<one_policy>(bsdf_fault::not_reciprocal, false));
}

TEST_CASE("check_bsdf: faults of delta BSDFs are found and named", "[testing]") {
  const one_policy exec;
  check_passes(check_bsdf(exec, faulty_mirror{}));
  check_names(check_bsdf(exec, faulty_mirror{1.2f}), {"gives pdf 1.2, expected a probability"});
  check_names(check_bsdf(exec, faulty_mirror{1.0f, 0.3f}), {"eval() is 0.3", "expected 0 of a delta BSDF"});
}

TEST_CASE("check_bsdf: faults of parts are found and named", "[testing]") {
  const one_policy exec;
  const auto check = [&](part_fault fault) { return check_bsdf(exec, parted_bsdf{fault}); };
  check_passes(check(part_fault::none));
  check_names(check(part_fault::share), {"glossy() seen from", "gives fraction 1.3, expected in [0, 1]"});
  check_names(check(part_fault::alpha), {"glossy() seen from", "gives alpha 1.5, expected in [0, 1]"});
  check_names(check(part_fault::sum), {"pdf_part() does not add up to pdf()", "pdf() says"});
  check_names(check(part_fault::sample_pdf), {"pdf_part(true) disagrees with sample_part(true)"});
  check_names(check(part_fault::sample_shape), {"sample_part(true) draws too"});
}

TEST_CASE("check_bsdf: faults of delta lobes beside others", "[testing]") {
  const one_policy exec;
  const auto check = [&](coat_fault fault) { return check_bsdf(exec, coated_bsdf{fault}); };
  check_passes(check(coat_fault::none));
  check_names(check(coat_fault::large_pdf), {"the integral of pdf()", "delta lobes aside, is 0.7"});
  check_names(check(coat_fault::probability), {"sample() of a delta lobe", "gives pdf 1.3"});
  check_names(check(coat_fault::silent), {"pdf() disagrees with sample()"});
}

TEST_CASE("check_bsdf: radiance scales with the index at a boundary", "[testing]") {
  const one_policy exec;
  bsdf_check_options options;
  options.ior = 1.5f;
  check_passes(check_bsdf(exec, diffuse_boundary{}, options));
  options.ior = 1.0f;
  check_names(check_bsdf(exec, diffuse_boundary{}, options), {"not reciprocal"});
  options.ior = 1.0f / 1.5f;
  options.reciprocal = false;
  check_names(check_bsdf(exec, diffuse_boundary{}, options), {"energy is not conserved"});
  options.reciprocal = true;
  options.ior = 1.5f;
  check_names(check_bsdf(exec, diffuse_boundary{1.5f, false}, options), {"not reciprocal"});
}

TEST_CASE("check_bsdf: correct samplers are rejected no more often than stated", "[testing]") {
  const one_policy exec;
  bsdf_check_options options{tilted};
  options.samples = 4096;
  options.significance = 0.05;
  options.reciprocal = false;
  int rejected = 0;
  for (options.seed = 1; options.seed <= 60; ++options.seed)
    rejected += !check_bsdf(exec, test_bsdf{bsdf_kind::glossy, tilted}, options);
  CHECK(rejected <= 9);  // at most 3 expected; 9 is 3.5 standard deviations above
}

TEST_CASE("check_bsdf: options out of range are refused", "[testing]") {
  const one_policy exec;
  const auto check = [&](const auto& change) {
    bsdf_check_options options;
    change(options);
    return check_bsdf(exec, test_bsdf{}, options);
  };
  CHECK_THROWS_AS(check([](auto& o) { o.normal = vec3(2.0f); }), std::invalid_argument);
  CHECK_THROWS_AS(check([](auto& o) { o.samples = 10; }), std::invalid_argument);
  CHECK_THROWS_AS(check([](auto& o) { o.ior = 0.0f; }), std::invalid_argument);
  CHECK_THROWS_AS(check([](auto& o) { o.significance = 0.0; }), std::invalid_argument);
  CHECK_THROWS_AS(check([](auto& o) { o.tolerance = 2.0f; }), std::invalid_argument);
  CHECK_THROWS_AS(check([](auto& o) { o.albedo_limit = -1.0f; }), std::invalid_argument);
}

TEST_CASE("sphere bins: integrals, sizes and descriptions are right", "[testing]") {
  const wfpg::frame axes(tilted);
  const auto each = [](const auto& f) {
    return [f](const std::vector<vec3>& directions) {
      std::vector<float> values;
      for (const vec3 d : directions) values.push_back(float(f(d)));
      return values;
    };
  };
  const sphere_bins even(axes, each([](vec3) { return 0.25 / 3.14159265358979; }), 1.0e5);
  CHECK(even.integral() == Approx(1.0).epsilon(1e-6));
  random_numbers random(3);
  for (const double exponent : {20.0, 300.0, 2.0e4}) {
    INFO("exponent " << exponent);
    const vec3 about = random.direction();
    // Of unit length in double precision: the power multiplies what a float's length lacks by 20,000.
    const auto lobe = [axis = glm::normalize(glm::dvec3(about)), exponent](vec3 d) {
      const double along = std::max(glm::dot(glm::normalize(glm::dvec3(d)), axis), 0.0);
      return std::pow(along, exponent) * (exponent + 1.0) / 6.28318530717959;
    };
    std::vector<vec3> hints;
    for (int i = 0; i < 4000; ++i) {
      const double z = std::pow(random.unit(), 1.0 / (exponent + 1.0)), r = std::sqrt(1.0 - z * z);
      const double turn = 6.28318530717959 * double(random.unit());
      hints.push_back(
          wfpg::frame(about).to_world({float(r * std::cos(turn)), float(r * std::sin(turn)), float(z)}));
    }
    const sphere_bins bins(axes, each(lobe), 1.0e5, hints);
    CHECK(bins.integral() == Approx(1.0).epsilon(1e-3));
    CHECK(bins.integral_error() < 5e-3);
    CHECK(bins.size() > 150);
    CHECK(*std::max_element(bins.expected().begin(), bins.expected().end()) < 1.0e5 / 50.0);
  }
  for (std::size_t bin = 0; bin < even.size(); ++bin) REQUIRE(even.of(even.middle(bin)) == bin);
  CHECK(even.describe({0, 0, 1.0, 2.0}).find("the bin with z in [-1, ") == 0);
  CHECK(even.describe({0, 9, 1.0, 2.0}).find("the thinly filled bins from that with z in") == 0);
}
