// The BSDFs of examples/kernels: value, density and drawn directions agree, also where the first two are
// estimates.
#include "bsdfs.hpp"
#include "materials/materials.hpp"
#include "support/catch.hpp"
#include "support/policies.hpp"

#include <wfpg/exec/seq.hpp>
#include <wfpg/testing/check_bsdf.hpp>
#include <wfpg/testing/statistics.hpp>

#include <cmath>

namespace {

using kernels::vec2;
using kernels::vec3;
using wfpg::testing::sample_mean;

/// Stands in for the random numbers of a walk, which these BSDFs do not ask for.
struct no_numbers {
  KERNELS_BOTH vec2 operator()() const { return vec2(0.5f); }
};

/// A kernel's BSDF in the library's form, so that its check can be used.
template <class Bsdf>
struct in_world {
  Bsdf bsdf;
  vec3 normal;
  bool through;

  WFPG_HD float eval(vec3 wo, vec3 wi) const {
    no_numbers n;
    return kernels::mean_of(bsdf.value(local(wo), local(wi), n));
  }
  WFPG_HD float pdf(vec3 wo, vec3 wi) const {
    no_numbers n;
    return bsdf.density(local(wo), local(wi), n);
  }
  WFPG_HD wfpg::bsdf_sample sample(vec3 wo, vec2 u) const {
    no_numbers n;
    // The low bits choose the lobe.
    const float lobe = 4096.0f * u.x - std::floor(4096.0f * u.x);
    const kernels::drawn_direction drawn = bsdf.draw(local(wo), lobe, u, n);
    if (!(kernels::mean_of(drawn.weight) > 0.0f)) return {};
    const vec3 wi = glm::normalize(wfpg::frame(normal).to_world(drawn.wi));
    return {wi, drawn.is_delta ? drawn.pdf : pdf(wo, wi), drawn.is_delta};
  }
  WFPG_HD bool is_delta() const { return Bsdf::is_delta; }
  WFPG_HD bool transmits() const { return through; }

 private:
  WFPG_HD vec3 local(vec3 w) const { return wfpg::frame(normal).to_local(w); }
};

template <class Bsdf>
void check(float alpha, bool through = false) {
  wfpg::testing::bsdf_check_options options;
  options.normal = glm::normalize(vec3(0.3f, -0.2f, 0.8f));
  options.ior = through ? 1.5f : 1.0f;
  Bsdf bsdf;
  bsdf.in = {{0.9f, 0.7f, 0.5f, 0.3f}, alpha, 1.5f};
  const auto report =
      wfpg::testing::check_bsdf(wfpg::exec::seq(), in_world<Bsdf>{bsdf, options.normal, through}, options);
  INFO(report.message);
  CHECK(report);
}

vec2 pair_of(wfpg_test::random_numbers& random) {
  const float first = random.unit();
  return {first, random.unit()};
}

/// The renderer's BSDF of one of the kernels' kinds, with its normals along z.
render::bsdf renderers(render::material_kind kind, float alpha) {
  render::bsdf f;
  f.kind = kind;
  f.colour = vec3(0.9f, 0.6f, 0.3f);
  f.alpha = alpha;
  f.ior = 1.5f;
  return f;
}
/// The kernels' BSDF with the same colours.
template <class Bsdf>
Bsdf kernels_own(float alpha) {
  Bsdf bsdf;
  bsdf.in = {{0.9f, 0.6f, 0.3f, 0.3f}, alpha, 1.5f};
  return bsdf;
}

/// Checks value and density against the renderer's, which has tests of its own.
template <class Bsdf>
void check_values(float alpha) {
  const render::bsdf expected = renderers(Bsdf::kind, alpha);
  const Bsdf found = kernels_own<Bsdf>(alpha);
  wfpg_test::random_numbers random(21);
  no_numbers n;
  for (int i = 0; i < 1000; ++i) {
    const vec3 wo = random.direction(), wi = random.direction();
    const vec3 value = expected.eval_rgb(wo, wi), own = vec3(found.value(wo, wi, n));
    INFO(value.x << ' ' << own.x << ", " << expected.pdf(wo, wi) << ' ' << found.density(wo, wi, n));
    CHECK(glm::distance(value, own) <= 1e-4f * glm::length(value));
  }
}

/// Checks the delta lobes of both sides: their weights, and that they are drawn as the renderer's are.
template <class Bsdf>
void check_delta_lobes() {
  const render::bsdf expected = renderers(Bsdf::kind, 0.1f);
  const Bsdf found = kernels_own<Bsdf>(0.1f);
  wfpg_test::random_numbers random(22);
  no_numbers n;
  for (int i = 0; i < 1000; ++i) {
    const vec3 wo = random.direction();
    const float u = random.unit();
    const wfpg::bsdf_sample drawn = expected.sample(wo, vec2(u, 0.5f));
    const kernels::drawn_direction own = found.draw(wo, u, vec2(0.5f), n);
    if (!(drawn.pdf > 0.0f)) {
      CHECK(kernels::mean_of(own.weight) == 0.0f);
      continue;
    }
    CHECK(own.is_delta);
    CHECK(glm::distance(own.wi, drawn.direction) < 1e-5f);
    CHECK(own.pdf == Approx(drawn.pdf));
    const vec3 weight = expected.delta_weight_rgb(wo, drawn.direction, drawn.pdf);
    CHECK(glm::distance(weight, vec3(own.weight)) <= 1e-5f * glm::length(weight));
  }
}

/// Random numbers of a walk.
struct walk_numbers {
  wfpg_test::random_numbers* random;
  vec2 operator()() { return pair_of(*random); }
};

}  // namespace

TEST_CASE("kernels' BSDFs: values, densities and directions agree", "[kernels]") {
  check<kernels::matte>(0.1f);
  for (const float alpha : {0.1f, 0.5f}) check<kernels::metal>(alpha);
  check<kernels::varnish>(0.1f);
  for (const float alpha : {0.1f, 0.4f}) check<kernels::frosted_glass>(alpha, true);
}

TEST_CASE("kernels' BSDFs: those that the renderer has too are the same", "[kernels]") {
  check_values<kernels::matte>(0.1f);
  for (const float alpha : {0.1f, 0.5f}) {
    check_values<kernels::metal>(alpha);
    check_values<kernels::frosted_glass>(alpha);
  }
  check_delta_lobes<kernels::mirror>();
  check_delta_lobes<kernels::glass>();
}

TEST_CASE("kernels' BSDFs: a coat reflects what Fresnel's formula says", "[kernels]") {
  const auto varnish = kernels_own<kernels::varnish>(0.1f);
  no_numbers n;
  for (const float z : {0.1f, 0.5f, 1.0f}) {
    const vec3 wo(std::sqrt(1.0f - z * z), 0.0f, z);
    const kernels::drawn_direction drawn = varnish.draw(wo, 0.0f, vec2(0.5f), n);
    CHECK(drawn.is_delta);
    CHECK(drawn.wi == vec3(-wo.x, -wo.y, wo.z));
    CHECK(drawn.weight.x * drawn.pdf == Approx(kernels::fresnel_dielectric(z, 1.5f)));
  }
}

TEST_CASE("kernels' BSDFs: the estimates of a layered one have the means of its directions", "[kernels]") {
  kernels::paint paint;
  paint.in = {kernels::spectrum(0.8f), 0.3f, 1.5f};
  wfpg_test::random_numbers random(3);
  walk_numbers walk{&random};
  const auto moments = {+[](vec3) { return 1.0f; }, +[](vec3 w) { return w.z; }, +[](vec3 w) { return w.x; }};
  for (const vec3 wo : {vec3(0.0f, 0.0f, 1.0f), glm::normalize(vec3(0.8f, 0.1f, 0.5f))})
    for (const auto moment : moments) {
      sample_mean drawn, of_density, scattered, of_value;
      for (int i = 0; i < 400000; ++i) {
        const auto d = paint.draw(wo, random.unit(), pair_of(random), walk);
        const bool succeeds = d.weight.x > 0.0f;
        drawn.add(succeeds ? double(moment(d.wi)) : 0.0);
        scattered.add(succeeds ? double(moment(d.wi) * d.weight.x) : 0.0);
        const vec2 u = pair_of(random);
        const vec3 wi = render::cosine_hemisphere(u);
        const float over = render::pi / std::fmax(wi.z, 1e-6f);
        of_density.add(double(moment(wi) * paint.density(wo, wi, walk) * over));
        of_value.add(double(moment(wi) * paint.value(wo, wi, walk).x * over));
      }
      const auto distance = [](const sample_mean& a, const sample_mean& b, double factor = 1.0) {
        return std::fabs(a.mean() - factor * b.mean()) / std::hypot(a.error(), factor * b.error());
      };
      INFO(drawn.mean() << ' ' << of_density.mean() << ", " << scattered.mean() << ' ' << of_value.mean());
      CHECK(distance(drawn, of_density) < 4.0);
      CHECK(distance(scattered, of_value) < 4.0);
      CHECK(std::fabs(scattered.mean()) <= 1.0);
    }
}
