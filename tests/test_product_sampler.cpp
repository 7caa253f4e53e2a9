// The product sampler: frequencies against the product's own cells, densities that integrate to one and are
// the sampler's own. tests/test_renderer_products.cpp does the same for many more BSDFs.
#include "support/products.hpp"

#include <wfpg/product_sampler.hpp>

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

WFPG_TEST_CASE("product sampler: a product is the field times the BSDF, block by block",
               "[product_sampler]") {
  constexpr product_size size{16, 8};
  // Light everywhere, and a Lambertian: cosines are left, in the sphere's case of the upper half alone.
  const Exec exec;
  for (const bool hemisphere : {false, true}) {
    const made_product<Exec, test_bsdf> made(exec, size, field_values(field_kind::uniform, size.field, 1),
                                             hemisphere, make_surface({}, up, toward_eye), 1, 10);
    random_numbers random(2);
    for (int i = 0; i < 300; ++i) {
      const vec3 d = random.direction();
      const float cosine = glm::dot(d, up), density = made.product().pdf(d);
      if (cosine < -0.5f) CHECK(density == 0.0f);
      // A field over a hemisphere carries the cosine by itself; this one is even, so none is left.
      const float expected = hemisphere ? 0.5f : cosine;
      if (cosine > 0.5f)
        CHECK(density == Approx(expected / wfpg::detail::pi).epsilon(hemisphere ? 0.02 : 0.4));
    }
  }
}

}  // namespace

TEST_CASE("product sampler: a default product is empty", "[product_sampler]") {
  CHECK(product_field().empty());
}
