// The product sampler: frequencies against the product worked out from field and BSDF, densities that
// integrate to one and are the sampler's own.
#include "support/chi_square.hpp"
#include "support/fields.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"

#include <wfpg/product_sampler.hpp>

#include <cmath>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::directional_field;
using wfpg::product_field;
using wfpg::product_point;

namespace {

struct resolutions {
  std::uint32_t field, product;
};
constexpr resolutions all_resolutions[] = {{16, 4},  {16, 8}, {16, 16}, {24, 8},  {32, 4},  {32, 8},
                                           {32, 16}, {64, 4}, {64, 8},  {64, 16}, {128, 8}, {128, 16}};

struct drawn_direction {
  vec3 direction;
  float pdf, asked;
};

/// Makes the product by one warp, and draws from it.
struct draw_product {
  directional_field field;
  wfpg::product_points points;
  test_surface surface;
  std::uint32_t* weights;
  wfpg::array_view<drawn_direction> drawn;
  template <class Block>
  void operator()(Block& block, std::size_t) const {
    block.for_each_warp(1, [&](const auto& warp, int) {
      const product_field product = wfpg::detail::multiply(warp, field, points, surface, weights);
      for (std::size_t i = 0; i < drawn.size(); ++i) {
        drawn[i] = {};
        if (product.empty()) continue;
        drawn_direction& d = drawn[i];
        d.direction = product.sample(hashed_numbers{5}(std::uint32_t(i), 0), d.pdf);
        d.asked = product.pdf(d.direction);
      }
    });
  }
};

/// A field, a BSDF, and directions from their product.
template <class Exec>
struct product_of {
  std::vector<drawn_direction> drawn;
  bool was_empty = false;
  std::vector<double> cells;     ///< probability of each, from the density
  std::vector<double> observed;  ///< directions in each
  double integral = 0.0;

  product_of(resolutions r, bool hemisphere, bsdf_kind kind, std::uint64_t seed, std::size_t samples) {
    const Exec exec;
    const built_field<Exec> built(exec, field_values(field_kind::noise, r.field, seed), r.field, 0.01f);
    const directional_field field =
        hemisphere ? directional_field(built.grid(), up) : directional_field(built.grid());
    const std::size_t blocks = std::size_t(r.product) * r.product;
    const wfpg::buffer<std::uint32_t, Exec> scan(exec, blocks);
    const wfpg::buffer<product_point, Exec> points(exec, 2 * blocks);
    const wfpg::buffer<drawn_direction, Exec> results(exec, samples);
    exec.for_each(blocks,
                  wfpg::detail::draw_product_points{points.data(), points.data() + blocks, r.product, seed});
    exec.for_each_block(1, 0,
                        draw_product{field,
                                     {points.data(), points.data() + blocks, r.product},
                                     make_surface({}, up, toward_eye, kind),
                                     scan.data(),
                                     results.view()});
    drawn = results.to_host(exec);
    was_empty = !(drawn.front().pdf > 0.0f);
    if (was_empty) return;
    const product_field product(field, r.product, scan.data());
    for (std::uint32_t i = 0; i < r.field * r.field; ++i) {
      const wfpg::vec2 middle(float(i % r.field) + 0.5f, float(i / r.field) + 0.5f);
      cells.push_back(double(product.pdf(field.direction(middle / float(r.field)))) *
                      double(field.cell_solid_angle()));
      integral += cells.back();
    }
    observed.resize(cells.size(), 0.0);
    for (const drawn_direction& d : drawn) {
      wfpg::vec2 uv;
      if (field.locate(d.direction, uv))
        observed[field.grid().cell_along(uv.y) * r.field + field.grid().cell_along(uv.x)] += 1.0;
    }
  }
};

WFPG_TEST_CASE("product sampler: densities are frequencies, integrate to one, and answer queries",
               "[product_sampler]") {
  chi_square_family family;
  constexpr std::size_t samples = 4000;
  for (const resolutions& r : all_resolutions)
    for (const bool hemisphere : {false, true})
      for (const bsdf_kind kind : {bsdf_kind::lambert, bsdf_kind::glossy, bsdf_kind::glass}) {
        const product_of<Exec> made(r, hemisphere, kind, 3 + std::uint64_t(family.size()), samples);
        INFO("field " << r.field << ", product " << r.product << ", hemisphere " << hemisphere << ", BSDF "
                      << int(kind));
        CHECK(std::fabs(made.integral - 1.0) < 1e-3);
        int differing = 0;
        for (const drawn_direction& d : made.drawn)
          differing += !(std::fabs(d.pdf - d.asked) <= 1e-5f * d.pdf) || !(d.pdf > 0.0f);
        CHECK(differing == 0);
        std::vector<double> expected = made.cells;
        for (double& e : expected) e *= double(samples);
        family.add(chi_square_test(made.observed, expected),
                   std::to_string(r.field) + "/" + std::to_string(r.product));
      }
  INFO(family.message());
  CHECK(family.accepted());
}

WFPG_TEST_CASE("product sampler: a black BSDF leaves nothing to draw from", "[product_sampler]") {
  const product_of<Exec> black({16, 8}, true, bsdf_kind::black, 1, 10);
  for (const drawn_direction& d : black.drawn) CHECK(d.pdf == 0.0f);
  CHECK(black.was_empty);
  CHECK(product_field().empty());
}

}  // namespace
