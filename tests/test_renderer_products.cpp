// Products of fields with the renderer's BSDFs: random pairs on every policy, width and resolution. Also the
// guide's fraction beside glossy parts, and rays on a thin wall's dark side.
#include "casters/embree_caster.hpp"
#include "materials/materials.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/either_guide.hpp"
#include "support/policies.hpp"
#include "support/products.hpp"
#include "tracer/unguided.hpp"
#include "tracer/wavefront.hpp"

#include <wfpg/path_guider.hpp>

#include <cmath>
#include <string>
#include <vector>

using namespace wfpg_test;
using render::bsdf;
using render::material_kind;

namespace {

struct named_bsdf {
  const char* name;
  material_kind kind;
  float alpha;
};
constexpr named_bsdf bsdfs[] = {
    {"Lambert", material_kind::lambert, 1.0f},   {"GGX 0.05", material_kind::conductor, 0.05f},
    {"GGX 0.2", material_kind::conductor, 0.2f}, {"GGX 0.6", material_kind::conductor, 0.6f},
    {"plastic", material_kind::plastic, 0.2f},   {"rough dielectric", material_kind::rough_dielectric, 0.3f}};
constexpr std::uint64_t kinds = sizeof bsdfs / sizeof bsdfs[0];

/// One of many pairs of a field and a surface. BSDFs alternate, and every other view is grazing.
struct random_pair {
  named_bsdf scatters;
  bool grazing, hemisphere;
  field_kind kind;
  wfpg::surface<bsdf> surface;

  explicit random_pair(std::uint64_t seed)
      : scatters(bsdfs[seed % kinds]),
        grazing(seed / kinds % 2 == 1),
        hemisphere(scatters.kind != material_kind::rough_dielectric && seed / (2 * kinds) % 2 == 0),
        kind(seed % 5 == 4   ? field_kind::extreme
             : seed % 5 == 3 ? field_kind::one_row
                             : field_kind::noise) {
    random_numbers random(seed);
    const vec3 normal = glm::normalize(up + 0.2f * random.direction());
    const vec3 across = glm::normalize(glm::cross(normal, random.direction()));
    const vec3 outgoing = glm::normalize((grazing ? 0.05f : 4.0f) * normal + across);
    surface.geometric_normal = surface.normal = normal;
    surface.outgoing = outgoing;
    surface.bsdf = {normal, normal, vec3(0.8f, 0.5f, 0.3f), scatters.alpha, 1.5f, scatters.kind};
  }

  std::string name() const {
    return std::string(scatters.name) + (grazing ? ", grazing" : ", normal view") +
           (hemisphere ? ", hemisphere, " : ", sphere, ") + name_of(kind);
  }
};

WFPG_TEST_CASE("products of 50 fields and BSDFs are right at every resolution", "[renderer][products]") {
  const Exec exec;
  product_family family;
  int empty = 0;
  for (const product_size& size : product_sizes)
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
      const random_pair pair(seed);
      const made_product<Exec, bsdf> made(exec, size, field_values(pair.kind, size.field, seed),
                                          pair.hemisphere, pair.surface, seed, 2000);
      empty += made.empty();
      if (!made.empty())
        family.add(made,
                   std::to_string(size.field) + "/" + std::to_string(size.product) + ", " + pair.name());
    }
  INFO(family.frequencies().message());
  CHECK(family.frequencies().accepted());
  CHECK(empty == 0);
}

}  // namespace

TEST_CASE("mixtures of products and BSDFs report their densities over the sphere",
          "[renderer][products][thorough]") {
  const one_policy exec;
  for (std::uint64_t seed = 0; seed < 4 * kinds; ++seed) {
    const random_pair pair(seed);
    const made_product<one_policy, bsdf> made(exec, {32, 8}, field_values(pair.kind, 32, seed),
                                              pair.hemisphere, pair.surface, seed, 40000);
    std::vector<drawn_direction> drawn;
    for (const product_draw& d : made.drawn())
      if (d.mixed.pdf > 0.0f) drawn.push_back({d.mixed.direction, d.mixed.pdf});
    // Samples fail where the BSDF's do. The density integrates to the fraction that succeeds.
    sampler_check_options options;
    options.total = double(drawn.size()) / double(made.drawn().size());
    options.moments = seed % 4 == 0;
    options.tolerance = 5.0 * std::sqrt((1.0 - options.total) / double(drawn.size())) + 1.0e-3;
    const sampler_report report =
        check_sampler(drawn, each([&](vec3 d) { return made.mixture().pdf(pair.surface, d); }), options);
    INFO(pair.name() << ": " << report.message);
    CHECK(report);
  }
}

TEST_CASE("a diffuse surface's product is its field, if the field has the cosine", "[renderer][products]") {
  const one_policy exec;
  const auto values = field_values(field_kind::noise, 16, 3);
  const auto is_field = [&](material_kind kind, bool hemisphere, vec3 normal) {
    wfpg::surface<bsdf> s;
    s.normal = s.outgoing = normal;
    s.bsdf = {normal, normal, vec3(0.8f, 0.5f, 0.3f), 0.3f, 1.5f, kind};
    const made_product<one_policy, bsdf> made(exec, {16, 8}, values, hemisphere, s, 1, 100);
    REQUIRE(!made.empty());
    for (const product_draw& d : made.drawn())
      if (d.product.pdf != made.field().pdf(d.product.direction)) return false;
    return true;
  };
  CHECK(is_field(material_kind::lambert, true, up));
  CHECK_FALSE(is_field(material_kind::lambert, true, glm::normalize(up + vec3(0.3f, 0.0f, 0.0f))));
  CHECK_FALSE(is_field(material_kind::lambert, false, up));
  CHECK_FALSE(is_field(material_kind::plastic, true, up));
}

TEST_CASE("narrower glossy parts leave the guide a smaller fraction", "[renderer][products]") {
  CHECK(wfpg::guided_part(0.5f, 0.5f) == 1.0f);
  CHECK(wfpg::guided_part(1.0f, 0.5f) == 1.0f);
  CHECK(wfpg::guided_part(0.25f, 0.5f) == Approx(0.25f + 0.75f / 4.0f));
  CHECK(wfpg::guided_part(0.001f, 0.5f) == Approx(0.25f).epsilon(1e-4));

  const one_policy exec;
  const built_field<one_policy> built(exec, field_values(field_kind::noise, 16, 3), 16);
  const wfpg::guide_mixture mixture{wfpg::directional_field(built.grid(), up), 0.6f};
  const auto fractions = [&](material_kind kind, float alpha) {
    wfpg::surface<bsdf> s;
    s.normal = s.outgoing = up;
    s.bsdf = {up, up, vec3(0.8f, 0.5f, 0.3f), alpha, 1.5f, kind};
    return mixture.fractions_of(s);
  };
  const wfpg::mixture_fractions lambert = fractions(material_kind::lambert, 0.1f);
  CHECK((lambert.guide == 0.6f && lambert.glossy == 0.0f));
  const wfpg::mixture_fractions mirror_like = fractions(material_kind::conductor, 0.01f);
  CHECK(mirror_like.guide == Approx(0.6f * wfpg::guided_part(0.01f, 0.5f)));
  CHECK(mirror_like.smooth == Approx(0.0f).margin(1e-6));
  const wfpg::mixture_fractions coated = fractions(material_kind::plastic, 0.1f);
  CHECK(coated.guide < 0.6f);
  CHECK(coated.guide > mirror_like.guide);
  for (const wfpg::mixture_fractions& s : {lambert, mirror_like, coated})
    CHECK(s.guide + s.glossy + s.smooth == Approx(1.0f));
}

namespace {

/// Points on the thin wall's dark side, seen from in front of it.
struct dark_side {
  std::uint64_t seed;
  wfpg::surface<bsdf> operator()(std::uint32_t ray) const {
    const vec2 u = hashed_numbers{seed}(ray, 0);
    const vec3 normal(1.0f, 0.0f, 0.0f);
    wfpg::surface<bsdf> s;
    s.position = {0.0f, 2.6f * u.x, -2.0f + 4.0f * u.y};
    s.geometric_normal = s.normal = normal;
    s.outgoing = wfpg::frame(normal).to_world(render::cosine_hemisphere(hashed_numbers{seed}(ray, 1)));
    s.bsdf = {normal, normal, vec3(0.7f, 0.6f, 0.45f), 1.0f, 1.5f, material_kind::lambert};
    return s;
  }
};

/// The fraction of guided rays from there that go below the surface. Plain bins, transient fields, after
/// `samples` samples of the scene.
double fraction_below(std::uint32_t product_resolution, int samples) {
  const one_policy exec;
  const render::scene scene = render::make_builtin_scene("thin-wall");
  const render::device_scene<one_policy> geometry(exec, scene);
  const render::light_distribution<one_policy> lights(exec, scene);
  const render::embree_scene accelerated(scene);
  constexpr int side = 64;
  render::path_tracer<one_policy, render::embree_caster> tracer(
      exec, {side, side, 6, 1}, {geometry.view(), lights.view(), true}, accelerated.caster());
  guider_options options;
  options.mode = wfpg::guiding_mode::plain;
  options.fields = field_lifetime::transient;
  options.product_resolution = unless_zero(product_resolution);
  options.include_emission = false;
  options.max_paths = side * side;
  options.max_depth = 6;
  octree_guider<one_policy> guider(exec, {geometry.view().positions, geometry.view().triangles}, options);
  const render::pinhole camera(scene.view, side, side);
  for (int i = 0; i < samples; ++i) tracer.render_sample(guider, camera, std::uint32_t(i), 1.0f);

  const std::size_t n = side * side;
  const wfpg::buffer<wfpg::sampled_direction, one_policy> directions(exec, n);
  guider.begin_sample();
  guider.sample_directions(wfpg::wave{0u, n, dark_side{7}, hashed_numbers{8}}, accelerated.caster(),
                           directions.view());
  double guided = 0.0, below = 0.0;
  for (const wfpg::sampled_direction& d : directions.to_host(exec)) {
    if (d.technique != wfpg::sampling_technique::guide) continue;
    guided += 1.0;
    below += d.direction.x < 0.0f ? 1.0 : 0.0;
  }
  REQUIRE(guided > 0.3 * double(n));
  return below / guided;
}

}  // namespace

TEST_CASE("products send no rays from a thin wall's dark side to the bright side", "[renderer][products]") {
  const double without = fraction_below(0, 16), with = fraction_below(8, 16);
  INFO("below the surface: " << 100.0 * with << "% with products, " << 100.0 * without << "% without");
  CHECK(with < 0.01);
  CHECK(without > 0.1);
}
