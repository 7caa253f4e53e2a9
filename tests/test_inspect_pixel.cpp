// What wfpg-inspect shows of a pixel: incident light, samplers and their densities, bins, voxels.
#include "findings.hpp"
#include "octree_pictures.hpp"
#include "scene/builtin_scenes.hpp"
#include "support/catch.hpp"
#include "support/inspections.hpp"
#include "support/renderer_io.hpp"
#include "tracer/rng.hpp"

#include <wfpg/bins/spatial_binner.hpp>
#include <wfpg/testing/statistics.hpp>

#include <glm/vector_relational.hpp>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

namespace {

using namespace inspect_test;
using inspect::direction_grid;
using inspect::learnt_scene;
using render::image;
using render::vec2;
using render_test::check_close;

/// Relative standard deviation of a sampler's estimates under light of radiance 1 from everywhere.
double deviation_of(const inspect::pixel_sampler& sampler) {
  const int n = 50000;
  double sum = 0.0, squares = 0.0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const render::random_stream uniform{11, 0};
    const auto next = sampler.sample(uniform(i, 0).x, uniform(i, 1));
    if (!(next.pdf > 0.0f)) continue;
    const auto& at = sampler.surface();
    const double value = double(at.bsdf.eval(at.outgoing, next.direction)) / double(next.pdf);
    sum += value;
    squares += value * value;
  }
  return std::sqrt(squares * n / (sum * sum) - 1.0);
}

}  // namespace

TEST_CASE("inspect: light in a furnace is equal from everywhere", "[inspect]") {
  const render::scene furnace = render::make_builtin_scene("furnace");
  render::render_options options = small(8, 2);
  options.nee = false;
  const learnt_scene learnt(furnace, options, {});
  const render::hit_surface& at = learnt.hits()[27];
  const direction_grid cells(6, wfpg::facing_normal(at.surface));
  const auto light = learnt.arriving(at, cells, 4, {});
  // Three of four segments are left.
  for (const image* half : {&light.first, &light.second})
    for (const vec3& pixel : half->pixels)
      check_close(pixel, vec3(float(render::furnace_radiance(3))), 1e-4f);
  CHECK(light.mean().pixels.size() == 36);
}

TEST_CASE("inspect: light arrives from all lamps, however the guide groups them", "[inspect]") {
  const render::scene lamps = render::make_builtin_scene("many-lamps");
  std::vector<vec3> by_one_group;
  for (const std::uint32_t groups : {1u, 32u}) {
    render::render_options options = small(8, 2);
    options.light_groups = groups;
    const learnt_scene learnt(lamps, options, {});
    const render::hit_surface& at = learnt.hits()[27];
    const direction_grid cells(6, wfpg::facing_normal(at.surface));
    const std::vector<vec3> pixels = learnt.arriving(at, cells, 4, {}).mean().pixels;
    if (groups == 1)
      by_one_group = pixels;
    else
      CHECK(pixels == by_one_group);
  }
}

TEST_CASE("inspect: a floor under the sky is sampled as its BSDF samples", "[inspect]") {
  const learnt_scene learnt(lit_floor(render::material_kind::lambert), small(16, 4), {});
  const std::uint32_t pixel = 12 * 16 + 8;
  REQUIRE(learnt.hits()[pixel].surface.active);
  inspect::finding_options options;
  options.reference_spp = 4;
  options.histogram = 20000;
  options.reference_cells = 32;
  const inspect::findings found = inspect::find(learnt, pixel, options, {});
  const double area = double(found.cells.solid_angle());
  CHECK(found.cells.size() == 64);
  CHECK(found.fine_cells.size() == 32 * 32);
  for (const auto* density : {&found.field, &found.reference, &found.product, &found.ideal, &found.sampler})
    CHECK(sum_of(*density) * area == Approx(1.0).epsilon(0.01));
  CHECK(sum_of(found.counted.density) * area == Approx(1.0));
  // Light of radiance 1 from everywhere leaves the cosine.
  const auto cosines = inspect::cell_means(found.cells, 8, [](vec3 d) { return d.y; });
  for (std::size_t cell = 0; cell < found.cells.size(); ++cell)
    CHECK(found.ideal[cell] == Approx(cosines[cell] / double(render::pi)).margin(0.002));
  CHECK(found.noise.bsdf < 0.02);
  CHECK(found.noise.sampler < 0.3);
  CHECK(found.correlation > 0.95);
  CHECK(found.divergence < 0.05);
  CHECK(found.divergence_noise < 1e-6);
  const inspect::pixel_sampler sampler(learnt.fields(), pixel, learnt.hits()[pixel].surface);
  CHECK(found.noise.sampler == Approx(deviation_of(sampler)).epsilon(0.05));
  double mean = 0.0;  // mean contribution over the densities
  for (std::size_t cell = 0; cell < found.fine_cells.size(); ++cell)
    mean += found.contributions[cell] *
            found.sampler[found.cells.cell_of(found.fine_cells.direction(cell, vec2(0.5f))).value()];
  CHECK(mean * double(found.fine_cells.solid_angle()) == Approx(1.0).epsilon(0.05));
}

TEST_CASE("inspect: samples have the shown density, and not another pixel's", "[inspect]") {
  for (const auto method : {render::sampling_method::wfpg, render::sampling_method::wfpg_product})
    for (const auto lifetime : {render::fields::kept, render::fields::transient}) {
      render::render_options options = small(24, 6);
      options.method = method;
      options.lifetime = lifetime;
      const learnt_scene learnt(render::make_builtin_scene("glossy-room"), options, {});
      const auto sampler_of = [&](std::uint32_t pixel) {
        return std::make_unique<inspect::pixel_sampler>(learnt.fields(), pixel, learnt.hits()[pixel].surface);
      };
      const auto here = sampler_of(12 * 24 + 5), there = sampler_of(20 * 24 + 20);
      REQUIRE((here->fraction() > 0.0f && there->fraction() > 0.0f));
      const inspect::sample_counts counted =
          inspect::count_samples(*here, direction_grid(here->field()), 40000);
      CHECK(counted.p > 1e-3);
      CHECK(counted.below < 0.01);
      std::vector<vec3> drawn, hints;
      for (std::uint32_t i = 0; i < 20000; ++i) {
        const render::random_stream uniform{7, 0};
        const auto next = there->sample(uniform(i, 0).x, uniform(i, 1));
        if (next.pdf > 0.0f) (i % 2 ? drawn : hints).push_back(next.direction);
      }
      CHECK(inspect::chi_square_p(*there, drawn, hints) > 1e-3);
      CHECK(inspect::chi_square_p(*here, drawn, hints) < 1e-6);
    }
}

TEST_CASE("inspect: histograms match the density cell by cell", "[inspect]") {
  const learnt_scene learnt(render::make_builtin_scene("cornell-box"), small(24, 6), {});
  inspect::finding_options options;
  options.reference_spp = 2;
  options.reference_cells = 8;
  options.histogram = 100000;
  const inspect::findings found = inspect::find(learnt, 20 * 24 + 12, options, {});
  std::vector<double> observed, expected;
  for (std::size_t cell = 0; cell < found.cells.size(); ++cell) {
    observed.push_back(found.counted.density[cell] * double(found.cells.solid_angle()) * options.histogram);
    expected.push_back(found.sampler[cell]);
  }
  const double scale = sum_of(observed) / sum_of(expected);
  for (double& e : expected) e *= scale;
  const auto test = wfpg::testing::chi_square_test(observed, expected);
  INFO(test.message);
  CHECK(test.p > 1e-3);
}

TEST_CASE("inspect: a pixel's point lies in its bin's node, on a surface of its orientation", "[inspect]") {
  for (const auto lifetime : {render::fields::kept, render::fields::transient}) {
    render::render_options options = small(24, 4);
    options.lifetime = lifetime;
    const learnt_scene learnt(render::make_builtin_scene("cornell-box"), options, {});
    const auto tree = learnt.cache().octree();
    std::size_t binned = 0;
    for (std::uint32_t pixel = 0; pixel < learnt.hits().size(); ++pixel) {
      const std::uint32_t bin = learnt.bins()[pixel];
      CHECK((bin != inspect::no_bin) == learnt.fields().guides(pixel));
      if (bin == inspect::no_bin) continue;
      ++binned;
      const auto& surface = learnt.hits()[pixel].surface;
      const wfpg::bounds3 box = tree.bounds(bin / wfpg::orientations);
      const vec3 slack(1.5f * tree.grid().voxel_size());  // a ray without a voxel uses a neighbour's
      CHECK(glm::all(glm::greaterThan(surface.position, box.lower - slack)));
      CHECK(glm::all(glm::lessThan(surface.position, box.upper + slack)));
      CHECK(bin % wfpg::orientations == wfpg::dominant_axis(wfpg::facing_normal(surface)));
    }
    CHECK(binned > 24 * 24 / 2);
    CHECK(learnt.bytes().field > 8 * 8 * 4);
  }
}

TEST_CASE("inspect: pictures of the octree show what the pixels hit", "[inspect]") {
  const learnt_scene learnt(lit_floor(render::material_kind::lambert), small(16, 4), {});
  const std::size_t sky = 2 * 16 + 8, floor = 12 * 16 + 8;
  const image normals = inspect::normal_picture(learnt);
  check_close(normals.pixels[floor], {0.5f, 1.0f, 0.5f}, 0.02f);
  check_close(normals.pixels[sky], vec3(0.0f));
  const inspect::exitance_pictures exitance = inspect::exitance_of(learnt);
  double sum = 0.0, lit = 0.0;
  for (const vec3& pixel : exitance.facing.pixels)
    if (pixel.x >= 0.0f) {
      sum += double(pixel.x);
      lit += 1.0;
    }
  CHECK(lit > 64.0);
  CHECK(sum / lit == Approx(0.8).epsilon(0.03));  // of the incident light
  CHECK(exitance.turned.pixels[floor].x < 0.0f);
  CHECK(exitance.facing.pixels[sky].x < 0.0f);
  CHECK(exitance.greatest >= double(exitance.facing.pixels[floor].x));
  check_close(inspect::bin_picture(learnt).pixels[sky], vec3(0.0f));
  CHECK(inspect::bin_picture(learnt).pixels[floor] != vec3(0.0f));
  const image marked = inspect::marked(render::make_image(16, 16), 0, 15);
  CHECK(marked.pixels[11 * 16 + 4] != vec3(0.0f));
  CHECK(marked.pixels[15 * 16] == vec3(0.0f));
}
