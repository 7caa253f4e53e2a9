// The product sampler. Compares frequencies with the product's cells. Densities integrate to one and equal
// the sampler's. tests/test_renderer_products.cpp tests many more BSDFs.
#include "support/products.hpp"

#include <wfpg/sampling/product_sampler.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::directional_field;
using wfpg::product_field;

namespace {

constexpr std::size_t samples = 4000;

template <class Exec>
made_product<Exec, test_bsdf> make(const product_size& size, bool hemisphere, bsdf_kind kind,
                                   std::uint64_t seed) {
  return {Exec(),
          size,
          field_values(field_kind::noise, size.field, seed),
          hemisphere,
          make_surface({}, up, toward_eye, kind),
          seed,
          samples};
}

WFPG_TEST_CASE("product sampler: densities match frequencies, integrate to one, and answer queries",
               "[product_sampler]") {
  product_family family;
  for (const product_size& size : product_sizes)
    for (const bool hemisphere : {false, true})
      for (const bsdf_kind kind : {bsdf_kind::lambert, bsdf_kind::glossy, bsdf_kind::glass})
        family.add(make<Exec>(size, hemisphere, kind, 3 + std::uint64_t(family.frequencies().size())),
                   std::to_string(size.field) + "/" + std::to_string(size.product) + ", BSDF " +
                       std::to_string(int(kind)) + (hemisphere ? ", hemisphere" : ", sphere"));
  INFO(family.frequencies().message());
  CHECK(family.frequencies().accepted());
}

WFPG_TEST_CASE("product sampler: black and delta BSDFs give an empty product", "[product_sampler]") {
  for (const bsdf_kind kind : {bsdf_kind::black, bsdf_kind::mirror}) {
    const auto made = make<Exec>({16, 8}, true, kind, 1);
    CHECK(made.empty());
    for (const product_draw& d : made.drawn()) CHECK(d.product.pdf == 0.0f);
  }
}

/// Probability of each block of a field, if the density is proportional to `light`.
template <class Light>
std::vector<double> shares_of_blocks(const directional_field& field, std::uint32_t p, const Light& light) {
  constexpr std::uint32_t n = 32;  // points of the midpoint rule along a block's side
  std::vector<double> blocks(p * p, 0.0);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < p * p * n * n; ++i) {
    const std::uint32_t x = i % (p * n), y = i / (p * n);
    const double here = light(field.direction((vec2(float(x), float(y)) + 0.5f) / float(p * n)));
    blocks[y / n * p + x / n] += here;
    sum += here;
  }
  for (double& block : blocks) block /= sum;
  return blocks;
}

/// The cosine about a normal where it is positive, 0 below.
double cosine_above(vec3 d, vec3 normal) {
  return std::max(double(glm::dot(d, normal)), 0.0);
}

WFPG_TEST_CASE("product sampler: a Lambertian under uniform light samples the cosine", "[product_sampler]") {
  constexpr product_size size{16, 8};
  const made_product<Exec, test_bsdf> made(Exec(), size, field_values(field_kind::uniform, size.field, 1),
                                           false, make_surface({}, up, toward_eye), 1, 10);
  const std::vector<double> cells = made.cells();
  const std::vector<double> expected =
      shares_of_blocks(made.field(), size.product, [](vec3 d) { return cosine_above(d, up); });
  std::vector<double> blocks(expected.size(), 0.0);
  for (std::uint32_t i = 0; i < cells.size(); ++i)
    blocks[i / size.field / 2 * size.product + i % size.field / 2] += cells[i];
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    INFO("block " << i << ": " << blocks[i] << ", expected " << expected[i]);
    CHECK(std::fabs(blocks[i] - expected[i]) < 0.02 * expected[i] + 0.0015);
  }
}

/// A Lambertian that reports that no part of it is narrow.
struct matte_bsdf : test_bsdf {
  WFPG_HD wfpg::glossy_part glossy(vec3) const { return {}; }
};

/// Radiance that varies slowly.
double glow(vec3 d) {
  const double along = 1.0 + double(glm::dot(d, glm::normalize(vec3(0.7f, 0.5f, -0.4f))));
  return 0.2 + along * along;
}

/// Cell values of a field over the hemisphere above `up`, or over the sphere. Values over a hemisphere
/// include the cosine, as in the guide's fields.
std::vector<float> cells_of_glow(std::uint32_t n, bool hemisphere) {
  const directional_field domain = hemisphere ? directional_field(wfpg::grid_distribution(nullptr, n), up)
                                              : directional_field(wfpg::grid_distribution(nullptr, n));
  std::vector<float> values;
  for (std::uint32_t i = 0; i < n * n; ++i) {
    const vec3 d = domain.direction((vec2(float(i % n), float(i / n)) + 0.5f) / float(n));
    values.push_back(float(glow(d)) * (hemisphere ? glm::dot(d, up) : 1.0f));
  }
  return values;
}

/// The fraction of directions that a product samples in other blocks than the exact product.
template <class Exec, class Bsdf>
double misplaced(bool hemisphere, vec3 normal) {
  constexpr product_size size{32, 8};
  wfpg::surface<Bsdf> surface;
  surface.geometric_normal = surface.normal = normal;
  surface.outgoing = glm::normalize(normal + 0.5f * toward_eye);
  surface.bsdf.normal = normal;
  const made_product<Exec, Bsdf> made(Exec(), size, cells_of_glow(size.field, hemisphere), hemisphere,
                                      surface, 1, 10);
  // Light that a Lambertian surface reflects.
  std::vector<double> difference =
      shares_of_blocks(made.field(), size.product, [&](vec3 d) { return glow(d) * cosine_above(d, normal); });
  const std::vector<double> cells = made.cells();
  constexpr std::uint32_t side = size.field / size.product;
  for (std::uint32_t i = 0; i < cells.size(); ++i)
    difference[i / size.field / side * size.product + i % size.field / side] -= cells[i];
  double sum = 0.0;
  for (const double d : difference) sum += 0.5 * std::fabs(d);
  return sum;
}

WFPG_TEST_CASE("product sampler: the cosine counts once, even if the field has it", "[product_sampler]") {
  for (const bool hemisphere : {false, true})
    for (const vec3 normal : {up, glm::normalize(up + vec3(0.4f, 0.0f, -0.3f))}) {
      const double lambert = misplaced<Exec, test_bsdf>(hemisphere, normal);
      const double matte = misplaced<Exec, matte_bsdf>(hemisphere, normal);
      INFO("hemisphere " << hemisphere << ", the field's normal " << (normal == up) << ": misplaced "
                         << lambert << ", reported as matte " << matte);
      CHECK(lambert < 0.02);
      CHECK(matte < 0.02);
    }
}

/// Reflects and transmits equally where a direction lies in the far half of its block. `blocks` is their
/// number along a side of the sphere's square.
struct half_black_bsdf : test_bsdf {
  std::uint32_t blocks = 8;

  WFPG_HD bool transmits() const { return true; }
  WFPG_HD float eval(vec3, vec3 incident) const {
    const float along = wfpg::sphere_to_square(incident).x * static_cast<float>(blocks);
    return along - std::floor(along) > 0.5f ? 0.3f : 0.0f;
  }
};

WFPG_TEST_CASE("product sampler: a block that is black at one of its points is still sampled",
               "[product_sampler]") {
  constexpr product_size size{16, 8};
  wfpg::surface<half_black_bsdf> surface;
  surface.geometric_normal = surface.normal = up;
  surface.outgoing = toward_eye;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const made_product<Exec, half_black_bsdf> made(
        Exec(), size, field_values(field_kind::uniform, size.field, 1), false, surface, seed, 10);
    std::size_t black = 0;
    for (const double fraction : made.cells()) black += fraction > 0.0 ? 0 : 1;
    CHECK(black == 0);  // one of a block's two points is in the reflecting half
  }
}

/// Scatters to both sides of the surface as a Lambertian to one.
struct two_sided_bsdf : test_bsdf {
  WFPG_HD bool transmits() const { return true; }
  WFPG_HD float eval(vec3, vec3 incident) const {
    return std::fabs(glm::dot(normal, incident)) / (2.0f * wfpg::pi);
  }
};

WFPG_TEST_CASE("product sampler: transmitted light counts as reflected light does", "[product_sampler]") {
  constexpr product_size size{32, 8};
  wfpg::surface<two_sided_bsdf> surface;
  surface.geometric_normal = surface.normal = surface.bsdf.normal = up;
  surface.outgoing = toward_eye;
  const made_product<Exec, two_sided_bsdf> made(Exec(), size, cells_of_glow(size.field, false), false,
                                                surface, 1, 10);
  const std::vector<double> cells = made.cells();
  double drawn = 0.0, below = 0.0, all = 0.0;  // below the surface: of the product, and of the light
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    const vec3 d = made.field().direction((vec2(float(i % size.field), float(i / size.field)) + 0.5f) /
                                          float(size.field));
    const double light = glow(d) * std::fabs(double(glm::dot(d, up)));
    drawn += glm::dot(d, up) < 0.0f ? cells[i] : 0.0;
    below += glm::dot(d, up) < 0.0f ? light : 0.0;
    all += light;
  }
  CHECK(drawn == Approx(below / all).margin(0.02));
}

}  // namespace

TEST_CASE("product sampler: a default product is empty", "[product_sampler]") {
  CHECK(product_field().empty());
}
