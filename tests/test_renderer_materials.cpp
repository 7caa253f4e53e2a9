// The renderer's BSDFs against what a BSDF has to be: value, density and samples agree by Monte Carlo, energy
// is not made, nothing leaks through a surface.
#include "materials.hpp"
#include "rng.hpp"
#include "support/catch.hpp"

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

std::vector<named_bsdf> non_delta() {
  const vec3 colour(0.9f, 0.5f, 0.2f);
  std::vector<named_bsdf> all;
  all.push_back({"lambert", make(material_kind::lambert, colour)});
  for (const float alpha : {0.05f, 0.2f, 0.5f, 1.0f}) {
    all.push_back({"conductor " + std::to_string(alpha), make(material_kind::conductor, colour, alpha)});
    all.push_back({"plastic " + std::to_string(alpha), make(material_kind::plastic, colour, alpha)});
  }
  all.push_back({"plastic, black base", make(material_kind::plastic, vec3(0.0f), 0.2f)});
  const std::size_t flat = all.size();
  for (std::size_t i = 0; i < flat; ++i) {
    named_bsdf tilted = all[i];
    tilted.name += ", tilted";
    tilted.f.normal = glm::normalize(vec3(0.5f, -0.2f, 1.0f));
    all.push_back(tilted);
  }
  return all;
}

std::vector<vec3> viewers() {
  return {vec3(0.0f, 0.0f, 1.0f), glm::normalize(vec3(0.6f, 0.1f, 0.8f)),
          glm::normalize(vec3(0.5f, -0.9f, 0.3f))};
}

constexpr std::uint32_t sample_count = 200000;

vec2 numbers(std::uint32_t i, std::uint32_t use) {
  return render::random_stream{7, 0}(i, use);
}

vec3 uniform_sphere(vec2 u) {
  const float z = 1.0f - 2.0f * u.x;
  const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  return {r * std::cos(2.0f * render::pi * u.y), r * std::sin(2.0f * render::pi * u.y), z};
}

/// Mean and its standard error.
struct estimate {
  double sum = 0.0, squares = 0.0, n = 0.0;
  void add(double x) { sum += x, squares += x * x, n += 1.0; }
  double mean() const { return sum / n; }
  double error() const { return std::sqrt(std::max(0.0, squares / n - mean() * mean()) / n); }
};

bool agree(const estimate& a, const estimate& b) {
  const double error = std::sqrt(a.error() * a.error() + b.error() * b.error());
  return std::abs(a.mean() - b.mean()) <= 4.5 * error + 1e-4;
}

// Cells of equal solid angle about the z axis.
constexpr int rings = 8, sectors = 16, cells = rings * sectors;
// The grid of cell_mass does not see narrower lobes.
constexpr float finest_alpha = 0.1f;

int cell_of(vec3 w) {
  const int ring = std::min(rings - 1, static_cast<int>(0.5f * (1.0f - w.z) * rings));
  const float turn = std::atan2(w.y, w.x) / (2.0f * render::pi) + 0.5f;
  return ring * sectors + std::min(sectors - 1, static_cast<int>(turn * sectors));
}

/// Integral of the density over a cell, by a fine grid.
double cell_mass(const bsdf& f, vec3 wo, int cell) {
  constexpr int steps = 48;
  double sum = 0.0;
  for (int i = 0; i < steps * steps; ++i) {
    const float ring = static_cast<float>(cell / sectors) + (static_cast<float>(i / steps) + 0.5f) / steps;
    const float sector = static_cast<float>(cell % sectors) + (static_cast<float>(i % steps) + 0.5f) / steps;
    const float z = 1.0f - 2.0f * ring / rings;
    const float angle = 2.0f * render::pi * (sector / sectors - 0.5f);
    const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
    sum += static_cast<double>(f.pdf(wo, {r * std::cos(angle), r * std::sin(angle), z}));
  }
  return sum / (steps * steps) * 4.0 * static_cast<double>(render::pi) / cells;
}

}  // namespace

TEST_CASE("a sample's density is pdf() of it", "[renderer][bsdf]") {
  for (const auto& [name, f] : non_delta()) {
    INFO(name);
    for (const vec3 wo : viewers())
      for (std::uint32_t i = 0; i < 2000; ++i) {
        const wfpg::bsdf_sample drawn = f.sample(wo, numbers(i, 0));
        if (drawn.pdf == 0.0f) continue;
        REQUIRE(drawn.pdf == f.pdf(wo, drawn.direction));
        REQUIRE(glm::length(drawn.direction) == Approx(1.0f).margin(1e-5));
      }
  }
}

TEST_CASE("a density integrates to the probability that sampling succeeds", "[renderer][bsdf]") {
  for (const auto& [name, f] : non_delta()) {
    if (f.alpha < finest_alpha) continue;
    INFO(name);
    for (const vec3 wo : viewers()) {
      double mass = 0.0;
      for (int cell = 0; cell < cells; ++cell) mass += cell_mass(f, wo, cell);
      estimate success;
      for (std::uint32_t i = 0; i < sample_count; ++i)
        success.add(f.sample(wo, numbers(i, 1)).pdf > 0.0f ? 1.0 : 0.0);
      CHECK(mass == Approx(success.mean()).margin(0.01));
    }
  }
}

TEST_CASE("samples fall as the density says", "[renderer][bsdf]") {
  for (const auto& [name, f] : non_delta()) {
    if (f.alpha < finest_alpha) continue;
    INFO(name);
    for (const vec3 wo : viewers()) {
      std::vector<double> counts(cells, 0.0);
      for (std::uint32_t i = 0; i < sample_count; ++i) {
        const wfpg::bsdf_sample drawn = f.sample(wo, numbers(i, 2));
        if (drawn.pdf > 0.0f) counts[static_cast<std::size_t>(cell_of(drawn.direction))] += 1.0;
      }
      double chi2 = 0.0;
      int used = 0;
      for (int cell = 0; cell < cells; ++cell) {
        const double expected = cell_mass(f, wo, cell) * sample_count;
        const double counted = counts[static_cast<std::size_t>(cell)];
        if (expected < 10.0) continue;
        chi2 += (counted - expected) * (counted - expected) / expected;
        ++used;
      }
      // Wilson and Hilferty's normal approximation, 5 sigma; a little more for the grid's error.
      const double k = used, spread = 2.0 / (9.0 * k);
      CHECK(chi2 < k * std::pow(1.0 - spread + 5.0 * std::sqrt(spread), 3.0) + 0.1 * k);
    }
  }
}

TEST_CASE("sampling the BSDF and sampling the sphere give one albedo, below 1", "[renderer][bsdf]") {
  for (const auto& [name, f] : non_delta()) {
    INFO(name);
    for (const vec3 wo : viewers()) {
      estimate by_bsdf, by_sphere;
      for (std::uint32_t i = 0; i < sample_count; ++i) {
        const wfpg::bsdf_sample drawn = f.sample(wo, numbers(i, 3));
        by_bsdf.add(drawn.pdf > 0.0f ? double(f.eval(wo, drawn.direction)) / double(drawn.pdf) : 0.0);
        by_sphere.add(4.0 * double(render::pi) * double(f.eval(wo, uniform_sphere(numbers(i, 4)))));
      }
      INFO(by_bsdf.mean() << " +- " << by_bsdf.error() << ", " << by_sphere.mean() << " +- "
                          << by_sphere.error());
      CHECK(agree(by_bsdf, by_sphere));
      CHECK(by_bsdf.mean() <= 1.0 + 3.0 * by_bsdf.error());
    }
  }
}

TEST_CASE("a white GGX conductor loses only what shadowing takes", "[renderer][bsdf]") {
  const bsdf smooth = make(material_kind::conductor, vec3(1.0f), 0.05f);
  estimate albedo;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const wfpg::bsdf_sample drawn = smooth.sample(viewers()[1], numbers(i, 5));
    albedo.add(drawn.pdf > 0.0f ? double(smooth.eval(viewers()[1], drawn.direction) / drawn.pdf) : 0.0);
  }
  CHECK(albedo.mean() > 0.99);
  CHECK(albedo.mean() <= 1.00001);
}

TEST_CASE("flat BSDFs are reciprocal", "[renderer][bsdf]") {
  for (const auto& [name, f] : non_delta()) {
    if (f.normal != f.geometric_normal) continue;
    INFO(name);
    for (std::uint32_t i = 0; i < 1000; ++i) {
      const vec3 a = render::cosine_hemisphere(numbers(i, 6));
      const vec3 b = render::cosine_hemisphere(numbers(i, 7));
      const float forth = f.eval(a, b) * a.z, back = f.eval(b, a) * b.z;
      REQUIRE(forth == Approx(back).epsilon(2e-3).margin(1e-6));
    }
  }
}

TEST_CASE("nothing leaks where shading and geometric sides differ", "[renderer][bsdf]") {
  for (const auto& [name, f] : non_delta()) {
    INFO(name);
    for (std::uint32_t i = 0; i < 5000; ++i) {
      const vec3 wo = uniform_sphere(numbers(i, 8)), wi = uniform_sphere(numbers(i, 9));
      const float value = f.eval(wo, wi);
      REQUIRE(value >= 0.0f);
      if (value > 0.0f) REQUIRE(f.pdf(wo, wi) > 0.0f);
      const bool above = glm::dot(wi, f.normal) > 0.0f && glm::dot(wi, f.geometric_normal) > 0.0f &&
                         glm::dot(wo, f.normal) > 0.0f && glm::dot(wo, f.geometric_normal) > 0.0f;
      if (!above) REQUIRE((value == 0.0f && f.pdf(wo, wi) == 0.0f));
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
  CHECK(mirror.delta_weight_rgb(wo, drawn.direction) == mirror.colour);
  CHECK((mirror.is_delta() && !mirror.transmits()));
  CHECK(mirror.eval(wo, drawn.direction) == 0.0f);
  CHECK(mirror.sample(-wo, {0.3f, 0.4f}).pdf == 0.0f);
}

TEST_CASE("a dielectric reflects and refracts as Fresnel and Snell say", "[renderer][bsdf]") {
  const bsdf glass = make(material_kind::dielectric, vec3(1.0f));
  CHECK((glass.is_delta() && glass.transmits()));
  CHECK(render::fresnel_dielectric(1.0f, 1.5f) == Approx(0.04));
  for (const float side : {1.0f, -1.0f})
    for (const vec3 above : viewers()) {
      const vec3 wo = side * above;
      const float eta = side > 0.0f ? 1.5f : 1.0f / 1.5f;
      const wfpg::bsdf_sample reflected = glass.sample(wo, {0.0f, 0.0f});
      CHECK(glm::length(reflected.direction - vec3(-wo.x, -wo.y, wo.z)) < 1e-5f);
      CHECK(glass.delta_weight_rgb(wo, reflected.direction) == vec3(1.0f));
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
      CHECK(glass.delta_weight_rgb(wo, refracted.direction).x == Approx(1.0f / (eta * eta)));
      // Light that goes in and comes out again is neither squeezed nor spread.
      CHECK(glass.delta_weight_rgb(wo, refracted.direction).x *
                glass.delta_weight_rgb(refracted.direction, wo).x ==
            Approx(1.0f));
    }
}
