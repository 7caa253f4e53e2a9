// The renderer's BSDFs. They pass the library's checks and match known values.
#include "materials/materials.hpp"
#include "support/catch.hpp"
#include "tracer/rng.hpp"

#include <wfpg/exec/tbb.hpp>
#include <wfpg/testing/check_bsdf.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace {

using render::bsdf;
using render::frame;
using render::material_kind;
using render::vec2;
using render::vec3;

struct named_bsdf {
  std::string name;
  bsdf f;
};

bsdf make(material_kind kind, vec3 colour, float alpha = 0.3f) {
  bsdf f;
  f.kind = kind;
  f.colour = colour;
  f.alpha = alpha;
  return f;
}

const vec3 colour(0.9f, 0.5f, 0.2f), white(1.0f);

std::vector<named_bsdf> non_delta() {
  std::vector<named_bsdf> all = {{"lambert", make(material_kind::lambert, colour)},
                                 {"plastic, black base", make(material_kind::plastic, vec3(0.0f), 0.2f)},
                                 {"smooth plastic", make(material_kind::smooth_plastic, colour, 0.2f)}};
  for (const float alpha : {0.05f, 0.2f, 0.6f}) {
    const std::string roughness = ' ' + std::to_string(alpha);
    all.push_back({"conductor" + roughness, make(material_kind::conductor, colour, alpha)});
    all.push_back({"plastic" + roughness, make(material_kind::plastic, colour, alpha)});
    // Refraction compresses the lobe to a third of the angle, which the checks do not resolve.
    if (alpha < 0.1f) continue;
    all.push_back({"rough dielectric" + roughness, make(material_kind::rough_dielectric, white, alpha)});
  }
  const std::size_t flat = all.size();
  for (std::size_t i = 0; i < flat; ++i) {
    if (i > 0 && all[i].f.alpha != 0.2f) continue;
    named_bsdf tilted = all[i];
    tilted.name += ", tilted";
    tilted.f.normal = glm::normalize(vec3(0.5f, -0.2f, 1.0f));
    all.push_back(tilted);
  }
  return all;
}

/// A material with all lobes: metal, facets, transmission and diffuse transmission.
bsdf layered(material_kind kind, const float (&factors)[4], float alpha, float ior = 1.5f) {
  bsdf f = make(kind, colour, alpha);
  f.ior = ior;
  f.transmitted_colour = render::unorm8x3(vec3(0.3f, 0.9f, 0.4f));
  f.factors.metallic = render::unorm8(factors[0]);
  f.factors.specular = render::unorm8(factors[1]);
  f.factors.transmission = render::unorm8(factors[2]);
  f.factors.diffuse_transmission = render::unorm8(factors[3]);
  return f;
}

std::vector<named_bsdf> layered_bsdfs() {
  constexpr float fractions[][4] = {{0, 0.5f, 0, 0},       {0.4f, 1, 0, 0},       {0.3f, 0.2f, 0, 0},
                                    {0, 1, 0.6f, 0},       {0.3f, 0.7f, 0.5f, 0}, {0, 0, 1, 0},
                                    {0, 0.3f, 0, 0.7f},    {0, 0, 0, 1},          {0, 1, 0.4f, 0.3f},
                                    {0.5f, 0.8f, 1, 0.5f}, {0, 0, 0, 0},          {1, 0, 1, 1}};
  std::vector<named_bsdf> all;
  for (const auto& factors : fractions)
    for (const float alpha : {0.15f, 0.6f})
      for (const material_kind kind :
           {material_kind::metallic_roughness, material_kind::thin_metallic_roughness}) {
        const bsdf f = layered(kind, factors, alpha, alpha < 0.5f ? 1.8f : 1.3f);
        const bool thin = kind == material_kind::thin_metallic_roughness;
        if (thin ? !f.transmits() : f.transmits() && factors[3] > 0.0f) continue;
        std::string name = thin ? "thin, factors" : "factors";
        for (const float factor : factors) name += ' ' + std::to_string(factor);
        all.push_back({name + ", alpha " + std::to_string(alpha), f});
      }
  return all;
}

std::vector<vec3> viewers() {
  return {vec3(0.0f, 0.0f, 1.0f), glm::normalize(vec3(0.6f, 0.1f, 0.8f)),
          glm::normalize(vec3(0.5f, -0.9f, 0.3f))};
}

vec2 numbers(std::uint32_t i, std::uint32_t use) {
  return render::random_stream{7, 0}(i, use);
}

vec3 uniform_sphere(vec2 u) {
  const float z = 1.0f - 2.0f * u.x;
  const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  return {r * std::cos(2.0f * render::pi * u.y), r * std::sin(2.0f * render::pi * u.y), z};
}

using estimate = wfpg::testing::sample_mean;

void check(const std::string& name, const bsdf& f) {
  wfpg::testing::bsdf_check_options options;
  options.normal = f.normal;
  options.samples = std::size_t(1) << 14;
  const bool thin =
      f.kind == material_kind::thin_dielectric || f.kind == material_kind::thin_metallic_roughness;
  if (f.transmits() && !thin) options.ior = f.ior;
  const auto report = wfpg::testing::check_bsdf(wfpg::exec::tbb(), f, options);
  INFO(name << ": " << report.message);
  CHECK(report);
}

}  // namespace

TEST_CASE("materials pass the library's checks of BSDFs", "[renderer][bsdf]") {
  for (const auto& [name, f] : non_delta()) check(name, f);
  for (const material_kind kind :
       {material_kind::mirror, material_kind::dielectric, material_kind::thin_dielectric})
    check("smooth", make(kind, white));
  for (const material_kind kind : {material_kind::lambert, material_kind::conductor, material_kind::plastic,
                                   material_kind::smooth_plastic})
    check("white", make(kind, white, 0.2f));
  check("black", make(material_kind::lambert, vec3(0.0f)));
  check("smooth coat over black", make(material_kind::smooth_plastic, vec3(0.0f)));
}

TEST_CASE("all lobes together pass the library's checks of BSDFs", "[renderer][bsdf][thorough]") {
  for (auto [name, f] : layered_bsdfs()) {
    check(name, f);
    f.normal = glm::normalize(vec3(0.4f, 0.1f, 1.0f));
    if (f.alpha == 0.6f) check(name + ", tilted", f);
  }
}

TEST_CASE("each kind equals all lobes together with its factors", "[renderer][bsdf]") {
  const auto is_same = [](const bsdf& a, const bsdf& b) {
    for (std::uint32_t i = 0; i < 1000; ++i) {
      const vec3 wo = uniform_sphere(numbers(i, 8)), wi = uniform_sphere(numbers(i, 9));
      const vec3 expected = a.eval_rgb(wo, wi);
      if (glm::length(expected - b.eval_rgb(wo, wi)) > 1e-4f * glm::length(expected) + 1e-6f) return false;
    }
    return true;
  };
  for (const float alpha : {0.1f, 0.5f}) {
    const auto of = [&](std::initializer_list<float> f) {
      return layered(material_kind::metallic_roughness, {f.begin()[0], f.begin()[1], f.begin()[2], 0.0f},
                     alpha);
    };
    CHECK(is_same(make(material_kind::lambert, colour, alpha), of({0, 0, 0})));
    CHECK(is_same(make(material_kind::plastic, colour, alpha), of({0, 1, 0})));
    CHECK(is_same(make(material_kind::conductor, colour, alpha), of({1, 1, 0})));
    CHECK(is_same(make(material_kind::rough_dielectric, colour, alpha), of({0, 1, 1})));
    CHECK_FALSE(is_same(make(material_kind::plastic, colour, alpha), of({0, 0.5f, 0})));
  }
}

TEST_CASE("a thin dielectric lets light straight through", "[renderer][bsdf]") {
  const bsdf pane = make(material_kind::thin_dielectric, colour);
  for (const float side : {1.0f, -1.0f}) {
    const vec3 wo = side * viewers()[1];
    const wfpg::bsdf_sample through = pane.sample(wo, {0.9f, 0.5f}), back = pane.sample(wo, {0.0f, 0.5f});
    CHECK(through.direction == -wo);
    CHECK(pane.delta_weight_rgb(wo, through.direction, through.pdf) == colour);
    CHECK(glm::length(back.direction - vec3(-wo.x, -wo.y, wo.z)) < 1e-5f);
    CHECK(through.pdf + back.pdf == Approx(1.0f));
  }
}

TEST_CASE("a white GGX conductor loses only shadowed light", "[renderer][bsdf]") {
  const bsdf smooth = make(material_kind::conductor, vec3(1.0f), 0.05f);
  estimate albedo;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const wfpg::bsdf_sample drawn = smooth.sample(viewers()[1], numbers(i, 5));
    albedo.add(drawn.pdf > 0.0f ? double(smooth.eval(viewers()[1], drawn.direction) / drawn.pdf) : 0.0);
  }
  CHECK(albedo.mean() > 0.99);
  CHECK(albedo.mean() <= 1.00001);
}

TEST_CASE("no light leaks where shading and geometric sides differ", "[renderer][bsdf]") {
  std::vector<named_bsdf> all = non_delta();
  for (named_bsdf& each : layered_bsdfs()) {
    each.f.normal = glm::normalize(vec3(0.4f, 0.1f, 1.0f));
    all.push_back(each);
  }
  for (const auto& [name, f] : all) {
    INFO(name);
    for (std::uint32_t i = 0; i < 5000; ++i) {
      const vec3 wo = uniform_sphere(numbers(i, 8)), wi = uniform_sphere(numbers(i, 9));
      const float value = f.eval(wo, wi);
      REQUIRE(value >= 0.0f);
      if (value > 0.0f) REQUIRE(f.pdf(wo, wi) > 0.0f);
      const bool agree = glm::dot(wi, f.normal) * glm::dot(wi, f.geometric_normal) > 0.0f &&
                         glm::dot(wo, f.normal) * glm::dot(wo, f.geometric_normal) > 0.0f;
      const bool above = glm::dot(wi, f.normal) > 0.0f && glm::dot(wo, f.normal) > 0.0f;
      if (!agree || !(above || f.transmits())) REQUIRE((value == 0.0f && f.pdf(wo, wi) == 0.0f));
    }
  }
}

TEST_CASE("black surfaces have no density", "[renderer][bsdf]") {
  const bsdf black = make(material_kind::lambert, vec3(0.0f));
  const vec3 up(0.0f, 0.0f, 1.0f);
  CHECK(black.sample(up, {0.3f, 0.4f}).pdf == 0.0f);
  CHECK(black.pdf(up, up) == 0.0f);
  CHECK(make(material_kind::mirror, vec3(0.0f)).sample(up, {0.3f, 0.4f}).pdf == 0.0f);
}

TEST_CASE("a mirror mirrors", "[renderer][bsdf]") {
  const bsdf mirror = make(material_kind::mirror, vec3(0.9f, 0.8f, 0.7f));
  const vec3 wo = viewers()[1];
  const wfpg::bsdf_sample drawn = mirror.sample(wo, {0.3f, 0.4f});
  CHECK(drawn.pdf == 1.0f);
  CHECK(glm::length(drawn.direction - vec3(-wo.x, -wo.y, wo.z)) < 1e-5f);
  CHECK(mirror.delta_weight_rgb(wo, drawn.direction, drawn.pdf) == mirror.colour);
  CHECK((mirror.is_delta() && !mirror.transmits()));
  CHECK(mirror.eval(wo, drawn.direction) == 0.0f);
  CHECK(mirror.sample(-wo, {0.3f, 0.4f}).pdf == 0.0f);
}

TEST_CASE("a dielectric reflects and refracts by Fresnel and Snell", "[renderer][bsdf]") {
  const bsdf glass = make(material_kind::dielectric, vec3(1.0f));
  CHECK((glass.is_delta() && glass.transmits()));
  CHECK(render::fresnel_dielectric(1.0f, 1.5f) == Approx(0.04));
  for (const float side : {1.0f, -1.0f})
    for (const vec3 above : viewers()) {
      const vec3 wo = side * above;
      const float eta = side > 0.0f ? 1.5f : 1.0f / 1.5f;
      const wfpg::bsdf_sample reflected = glass.sample(wo, {0.0f, 0.0f});
      CHECK(glm::length(reflected.direction - vec3(-wo.x, -wo.y, wo.z)) < 1e-5f);
      CHECK(glass.delta_weight_rgb(wo, reflected.direction, reflected.pdf) == vec3(1.0f));
      const wfpg::bsdf_sample refracted = glass.sample(wo, {0.9999f, 0.0f});
      const float sine = std::sqrt(1.0f - wo.z * wo.z);
      if (sine >= eta) {
        CHECK(refracted.direction.z * wo.z > 0.0f);
        CHECK(refracted.pdf == 1.0f);
        continue;
      }
      CHECK(refracted.direction.z * wo.z < 0.0f);
      CHECK(glm::length(vec2(refracted.direction)) == Approx(sine / eta).margin(1e-5));
      CHECK(reflected.pdf + refracted.pdf == Approx(1.0f));
      CHECK(glass.delta_weight_rgb(wo, refracted.direction, refracted.pdf).x == Approx(1.0f / (eta * eta)));
      // Light that enters and leaves is neither compressed nor spread.
      CHECK(glass.delta_weight_rgb(wo, refracted.direction, refracted.pdf).x *
                glass.delta_weight_rgb(refracted.direction, wo, 1.0f).x ==
            Approx(1.0f));
    }
}

TEST_CASE("reflectance of smooth glass is 1 reflected, and its colour transmitted", "[renderer][bsdf]") {
  const vec3 colour(0.5f, 0.25f, 0.0f);
  for (const material_kind kind : {material_kind::dielectric, material_kind::thin_dielectric})
    for (const bool is_black : {false, true}) {
      const bsdf glass = make(kind, is_black ? vec3(0.0f) : colour);
      const vec3 wo = viewers()[1];
      const vec3 reflected = glass.sample(wo, {0.0f, 0.0f}).direction;
      const vec3 transmitted = glass.sample(wo, {0.9999f, 0.0f}).direction;
      REQUIRE(transmitted.z * wo.z < 0.0f);
      CHECK(glass.reflectance(wo, reflected, true) == Approx(1.0f));
      CHECK(glass.reflectance(wo, transmitted, true) == Approx(is_black ? 0.0f : wfpg::luminance(colour)));
    }
}

TEST_CASE("a rough dielectric of little roughness has the smooth one's albedo", "[renderer][bsdf]") {
  const bsdf rough = make(material_kind::rough_dielectric, white, 0.02f);
  for (const float side : {1.0f, -1.0f})
    for (const vec3 above : viewers()) {
      const vec3 wo = side * above;
      const float eta = side > 0.0f ? 1.5f : 1.0f / 1.5f;
      const float reflected = render::fresnel_dielectric(above.z, eta);
      estimate mirrored, through;
      for (std::uint32_t i = 0; i < 20000; ++i) {
        const wfpg::bsdf_sample drawn = rough.sample(wo, numbers(i, 6));
        const bool same_side = drawn.direction.z * wo.z > 0.0f;
        const double value = drawn.pdf > 0.0f ? double(rough.eval(wo, drawn.direction) / drawn.pdf) : 0.0;
        mirrored.add(same_side ? value : 0.0);
        through.add(same_side ? 0.0 : value);
      }
      CHECK(mirrored.mean() == Approx(reflected).margin(0.03 + 4.0 * mirrored.error()));
      CHECK(through.mean() * eta * eta ==
            Approx(1.0 - reflected).margin(0.03 + 4.0 * through.error() * eta * eta));
    }
}

namespace {

/// The fraction of light from everywhere that a coat of index 1.5 lets to a base, and the base's colour then
/// sends toward a viewer: midpoint rule over the squared sine.
float albedo_below(float cosine, float base) {
  constexpr int steps = 20000;
  double through = 0.0;
  for (int i = 0; i < steps; ++i) {
    const float incident = std::sqrt((static_cast<float>(i) + 0.5f) / static_cast<float>(steps));
    through += double(1.0f - render::fresnel_dielectric(incident, 1.5f)) / steps;
  }
  return (1.0f - render::fresnel_dielectric(cosine, 1.5f)) * base * static_cast<float>(through);
}

}  // namespace

TEST_CASE("a smooth coat mirrors by Fresnel, and its base is diffuse", "[renderer][bsdf]") {
  const bsdf coat = make(material_kind::smooth_plastic, colour);
  CHECK((!coat.is_delta() && !coat.transmits()));
  for (const vec3 wo : viewers()) {
    const float reflected = render::fresnel_dielectric(wo.z, 1.5f);
    const wfpg::glossy_part part = coat.glossy(wo);
    CHECK(part.alpha == 0.0f);
    const wfpg::bsdf_sample drawn = coat.sample(wo, {0.0f, 0.4f}), alone = coat.sample_part(true, wo, {});
    CHECK((drawn.is_delta && alone.is_delta));
    CHECK(glm::length(drawn.direction - vec3(-wo.x, -wo.y, wo.z)) < 1e-5f);
    CHECK(alone.direction == drawn.direction);
    CHECK(alone.pdf == 1.0f);
    CHECK(drawn.pdf == part.fraction);
    const vec3 weight = coat.delta_weight_rgb(wo, drawn.direction, drawn.pdf);
    CHECK(drawn.pdf * weight.x == Approx(reflected));
    CHECK(weight.x == weight.z);
    CHECK(coat.reflectance(wo, drawn.direction, true) == Approx(weight.x));
    CHECK(0.5f * coat.delta_weight_rgb(wo, drawn.direction, 0.5f).x == Approx(reflected));
    const wfpg::bsdf_sample diffuse = coat.sample(wo, {0.95f, 0.4f});
    CHECK_FALSE((diffuse.is_delta || coat.sample_part(false, wo, {0.3f, 0.4f}).is_delta));
    CHECK(diffuse.pdf == Approx((1.0f - part.fraction) * diffuse.direction.z / render::pi));
    CHECK(coat.pdf_part(true, wo, drawn.direction) == 0.0f);
  }
  CHECK(coat.sample(-viewers()[1], {0.0f, 0.4f}).pdf == 0.0f);
}

TEST_CASE("samples of a smooth coat have its albedo", "[renderer][bsdf]") {
  const bsdf coat = make(material_kind::smooth_plastic, vec3(0.6f));
  for (const vec3 wo : viewers()) {
    estimate mirrored, below;
    for (std::uint32_t i = 0; i < 20000; ++i) {
      const wfpg::bsdf_sample drawn = coat.sample(wo, numbers(i, 5));
      const float weight = drawn.is_delta ? coat.delta_weight_rgb(wo, drawn.direction, drawn.pdf).x
                                          : coat.eval(wo, drawn.direction) / drawn.pdf;
      mirrored.add(drawn.is_delta ? double(weight) : 0.0);
      below.add(drawn.is_delta ? 0.0 : double(weight));
    }
    CHECK(mirrored.mean() == Approx(render::fresnel_dielectric(wo.z, 1.5f)).margin(4.0 * mirrored.error()));
    CHECK(below.mean() == Approx(albedo_below(wo.z, 0.6f)).margin(4.0 * below.error()));
  }
}

TEST_CASE("a rough plastic of little roughness has the smooth one's albedo", "[renderer][bsdf]") {
  const bsdf rough = make(material_kind::plastic, vec3(0.6f), 0.02f);
  for (const vec3 wo : {viewers()[0], viewers()[1]}) {
    estimate albedo;
    for (std::uint32_t i = 0; i < 20000; ++i) {
      const wfpg::bsdf_sample drawn = rough.sample(wo, numbers(i, 6));
      albedo.add(drawn.pdf > 0.0f ? double(rough.eval(wo, drawn.direction) / drawn.pdf) : 0.0);
    }
    CHECK(albedo.mean() == Approx(render::fresnel_dielectric(wo.z, 1.5f) + albedo_below(wo.z, 0.6f))
                               .margin(0.005 + 4.0 * albedo.error()));
  }
}
