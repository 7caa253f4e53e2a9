// Products of a field and a BSDF, made by a policy, and directions sampled from them.
#pragma once

#include "support/fields.hpp"
#include "support/scenes.hpp"
#include "support/statistics.hpp"

#include <wfpg/sampling/mixture.hpp>
#include <wfpg/sampling/product_sampler.hpp>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace wfpg_test {

struct product_size {
  std::uint32_t field, product;
};
constexpr product_size product_sizes[] = {{16, 4}, {16, 8}, {16, 16}, {24, 8},  {32, 4},  {32, 8},  {32, 16},
                                          {64, 4}, {64, 8}, {64, 16}, {128, 4}, {128, 8}, {128, 16}};

/// A direction of the product alone, with its pdf(), and one of its mixture with the BSDF.
struct product_draw {
  drawn_direction product;
  float asked = 0.0f;
  wfpg::sampled_direction mixed;
  float mixed_asked = 0.0f;
};

template <class Bsdf>
struct make_product {
  wfpg::directional_field field;
  wfpg::product_points points;
  wfpg::surface<Bsdf> surface;
  std::uint32_t* weights;
  wfpg::product_field* product;
  WFPG_HD void operator()(std::size_t) const {
    *product = wfpg::multiply_field(field, points, surface, weights);
  }
};

template <class Bsdf>
struct draw_product {
  const wfpg::product_field* product;
  wfpg::surface<Bsdf> surface;
  wfpg::array_view<product_draw> drawn;

  WFPG_HD void operator()(std::size_t i) const {
    const wfpg::product_field made = *product;
    const auto draw = static_cast<std::uint32_t>(i);
    const hashed_numbers random{5};
    product_draw d;
    if (!made.empty()) {
      d.product.direction = made.sample(random(draw, 0), d.product.pdf);
      d.asked = made.pdf(d.product.direction);
      const wfpg::product_mixture mixture{made, 0.7f};
      d.mixed = mixture.sample(surface, random(draw, 1).x, random(draw, 2));
      if (d.mixed.pdf > 0.0f) d.mixed_asked = mixture.pdf(surface, d.mixed.direction);
    }
    drawn[i] = d;
  }
};

/// A product in a policy's memory.
template <class Exec, class Bsdf>
class made_product {
 public:
  /// Over the hemisphere above `up`, or over the sphere. `seed` chooses the points in blocks.
  made_product(const Exec& exec, const product_size& size, const std::vector<float>& values, bool hemisphere,
               const wfpg::surface<Bsdf>& surface, std::uint64_t seed, std::size_t samples)
      : exec_(exec),
        built_(exec, values, size.field, 0.01f),
        field_(hemisphere ? wfpg::directional_field(built_.grid(), up)
                          : wfpg::directional_field(built_.grid())),
        resolution_(size.product),
        weights_(exec, blocks()),
        points_(exec, 2 * blocks()) {
    wfpg::product_point* const sphere = points_.data() + blocks();
    exec.for_each(blocks(), wfpg::measure_product_blocks{points_.data(), sphere, resolution_});
    exec.for_each(blocks(), wfpg::draw_product_points{points_.data(), sphere, resolution_, seed});
    const wfpg::buffer<wfpg::product_field, Exec> product(exec, 1);
    const wfpg::buffer<product_draw, Exec> results(exec, samples);
    exec.for_each(
        1, make_product<Bsdf>{
               field_, {points_.data(), sphere, resolution_}, surface, weights_.data(), product.data()});
    exec.for_each(samples, draw_product<Bsdf>{product.data(), surface, results.view()});
    product_ = product.to_host(exec).front();
    drawn_ = results.to_host(exec);
  }

  const std::vector<product_draw>& drawn() const { return drawn_; }
  bool empty() const { return !(drawn_.front().product.pdf > 0.0f); }
  const wfpg::directional_field& field() const { return field_; }
  /// Precondition: not empty.
  const wfpg::product_field& product() const { return product_; }
  wfpg::product_mixture mixture() const { return {product_, 0.7f}; }

  /// The integral of the density over each cell.
  std::vector<double> cells() const {
    const std::uint32_t n = field_.grid().resolution();
    const wfpg::directional_field field = field_;
    const wfpg::product_field product = product_;
    return evaluate(exec_, std::size_t(n) * n, [=] WFPG_HD(std::size_t i) {
      const vec2 middle = (vec2(float(i % n), float(i / n)) + 0.5f) / float(n);
      return double(product.pdf(field.direction(middle))) * double(field.cell_solid_angle());
    });
  }
  /// The number of directions sampled in each cell.
  std::vector<double> counts() const {
    const std::uint32_t n = field_.grid().resolution();
    std::vector<double> result(std::size_t(n) * n, 0.0);
    for (const product_draw& d : drawn_) {
      vec2 uv;
      if (field_.locate(d.product.direction, uv)) result[field_.grid().cell_of(uv)] += 1.0;
    }
    return result;
  }

 private:
  std::size_t blocks() const { return std::size_t(resolution_) * resolution_; }

  Exec exec_;
  built_field<Exec> built_;
  wfpg::directional_field field_;
  std::uint32_t resolution_;
  wfpg::buffer<std::uint32_t, Exec> weights_;
  wfpg::buffer<wfpg::product_point, Exec> points_;
  wfpg::product_field product_;
  std::vector<product_draw> drawn_;
};

/// Checks densities, samples and queries of many products together.
class product_family {
 public:
  template <class Exec, class Bsdf>
  void add(const made_product<Exec, Bsdf>& made, const std::string& name) {
    std::vector<double> expected = made.cells();
    double integral = 0.0;
    for (double& cell : expected) {
      integral += cell;
      cell *= double(made.drawn().size());
    }
    INFO(name);
    CHECK(std::fabs(integral - 1.0) < 1.0e-3);
    int differing = 0, mixed_differing = 0;
    for (const product_draw& d : made.drawn()) {
      differing += !agree(d.product.pdf, d.asked) || !(d.product.pdf > 0.0f);
      mixed_differing += !agree(d.mixed.pdf, d.mixed_asked);
    }
    CHECK(differing == 0);
    CHECK(mixed_differing == 0);
    family_.add(chi_square_test(made.counts(), expected), name);
  }
  const chi_square_family& frequencies() const { return family_; }

 private:
  static bool agree(float a, float b) { return std::fabs(a - b) <= 1.0e-5f * a; }

  chi_square_family family_;
};

}  // namespace wfpg_test
