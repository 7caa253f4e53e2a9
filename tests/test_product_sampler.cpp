// The product sampler: frequencies against the product's own cells, densities that integrate to one and are
// the sampler's own. tests/test_renderer_products.cpp does the same for many more BSDFs.
#include "support/products.hpp"

#include <wfpg/product_sampler.hpp>

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

WFPG_TEST_CASE("product sampler: densities are frequencies, integrate to one, and answer queries",
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

WFPG_TEST_CASE("product sampler: nothing is left of black and of delta BSDFs", "[product_sampler]") {
  for (const bsdf_kind kind : {bsdf_kind::black, bsdf_kind::mirror}) {
    const auto made = make<Exec>({16, 8}, true, kind, 1);
    CHECK(made.empty());
    for (const product_draw& d : made.drawn()) CHECK(d.product.pdf == 0.0f);
  }
}

/// The cosine about `up`, where it is positive, over blocks of a field of light everywhere: their
/// probabilities.
std::vector<double> cosines_of_blocks(const directional_field& field, std::uint32_t p) {
  constexpr std::uint32_t n = 32;  // of the midpoint rule, along a block's side
  std::vector<double> blocks(p * p, 0.0);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < p * p * n * n; ++i) {
    const std::uint32_t x = i % (p * n), y = i / (p * n);
    const vec3 d = field.direction((vec2(float(x), float(y)) + 0.5f) / float(p * n));
    const double cosine = std::max(double(glm::dot(d, up)), 0.0);
    blocks[y / n * p + x / n] += cosine;
    sum += cosine;
  }
  for (double& block : blocks) block /= sum;
  return blocks;
}

WFPG_TEST_CASE("product sampler: of light everywhere and a Lambertian cosines are left",
               "[product_sampler]") {
  constexpr product_size size{16, 8};
  const made_product<Exec, test_bsdf> made(Exec(), size, field_values(field_kind::uniform, size.field, 1),
                                           false, make_surface({}, up, toward_eye), 1, 10);
  const std::vector<double> cells = made.cells(), expected = cosines_of_blocks(made.field(), size.product);
  std::vector<double> blocks(expected.size(), 0.0);
  for (std::uint32_t i = 0; i < cells.size(); ++i)
    blocks[i / size.field / 2 * size.product + i % size.field / 2] += cells[i];
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    INFO("block " << i << ": " << blocks[i] << ", expected " << expected[i]);
    CHECK(std::fabs(blocks[i] - expected[i]) < 0.02 * expected[i] + 0.0015);
  }
}

}  // namespace

TEST_CASE("product sampler: a default product is empty", "[product_sampler]") {
  CHECK(product_field().empty());
}
