// One ray's product of a field and the renderer's BSDF on one core, with P = 8 and F = 64. Times its weights,
// a direction sampled from it, and the density of another direction. Also times the BSDF's evaluations alone.
#include "materials/materials.hpp"

#include <wfpg/exec/support/cpu_block.hpp>
#include <wfpg/sampling/product_sampler.hpp>

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <vector>

namespace {

using wfpg::vec2;
using wfpg::vec3;
using surface = wfpg::surface<render::bsdf>;

constexpr std::uint32_t field_resolution = 64, product_resolution = 8;
constexpr std::uint32_t block_count = product_resolution * product_resolution;
const vec3 up = glm::normalize(vec3(0.3f, 0.2f, 0.9f));

struct ray {
  surface hit;
  vec2 u;      // random numbers of the direction
  vec3 other;  // whose density is queried
};

struct drawn_direction {
  vec3 direction{0.0f};
  float density = 0.0f, other_density = 0.0f;
};

vec2 random_vec2(std::uint64_t stream, std::uint64_t i) {
  return wfpg::unit_vec2(wfpg::hash(wfpg::hash(1, stream), i));
}

// A field over the hemisphere above `up`, bright in a few places. Rays hit surfaces of one material with many
// normals, so that branches are hard to predict.
struct workload {
  std::vector<std::uint32_t> sums =
      std::vector<std::uint32_t>(wfpg::grid_distribution::words(field_resolution));
  std::vector<wfpg::product_point> hemisphere = std::vector<wfpg::product_point>(block_count);
  std::vector<wfpg::product_point> sphere = std::vector<wfpg::product_point>(block_count);
  wfpg::directional_field field;
  wfpg::product_points points{hemisphere.data(), sphere.data(), product_resolution};
  std::array<ray, 256> rays;

  explicit workload(render::material_kind kind) {
    const wfpg::cpu_block<8> block(nullptr, 0);
    const wfpg::cell_words cells{sums.data()};
    for (std::uint32_t i = 0; i < field_resolution * field_resolution; ++i)
      cells.set(static_cast<int>(i), std::pow(random_vec2(0, i).x, 8.0f));
    const auto grid = wfpg::build_distribution(block, cells, static_cast<int>(field_resolution), 0.01f);
    field = wfpg::directional_field(grid, up);
    const wfpg::draw_product_points draw{hemisphere.data(), sphere.data(), product_resolution, 2};
    const wfpg::measure_product_blocks measure{hemisphere.data(), sphere.data(), product_resolution};
    for (std::uint32_t i = 0; i < block_count; ++i) {
      measure(i);
      draw(i);
    }
    for (std::uint32_t i = 0; i < rays.size(); ++i) rays[i] = make_ray(kind, i);
  }
  workload(const workload&) = delete;

  static ray make_ray(render::material_kind kind, std::uint32_t i) {
    const auto above = [&](vec3 axis, std::uint64_t stream) {
      return wfpg::frame(axis).to_world(wfpg::square_to_hemisphere(random_vec2(stream, i)));
    };
    const vec3 normal = glm::normalize(up + 0.5f * above(up, 1));
    const vec3 outgoing = glm::normalize(0.1f * normal + above(normal, 2));
    const render::bsdf bsdf{normal, normal, vec3(0.6f, 0.4f, 0.3f), 0.2f, 1.5f, kind};
    return {{{}, normal, normal, outgoing, bsdf}, random_vec2(3, i), above(normal, 4)};
  }
};

drawn_direction product_of(const workload& w, const ray& r) {
  std::uint32_t words[block_count];
  const wfpg::product_field product = wfpg::multiply_field(w.field, w.points, r.hit, words);
  drawn_direction result;
  if (product.empty()) return result;
  result.direction = product.sample(r.u, result.density);
  result.other_density = product.pdf(r.other);
  return result;
}

template <render::material_kind kind>
void product(benchmark::State& state) {
  const workload w(kind);
  int drawn = 0;
  for (const ray& r : w.rays) drawn += product_of(w, r).density > 0.0f;
  if (drawn < 200) state.SkipWithError("too few rays have a product");
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(product_of(w, w.rays[i++ % w.rays.size()]));
  state.SetItemsProcessed(state.iterations());  // rays
}

/// The time of the BSDF's evaluations alone.
template <render::material_kind kind>
void evaluations(benchmark::State& state) {
  const workload w(kind);
  std::size_t i = 0;
  for (auto _ : state) {
    const surface& s = w.rays[i++ % w.rays.size()].hit;
    float sum = 0.0f;
    for (const wfpg::product_point& point : w.hemisphere)
      sum += s.bsdf.eval(s.outgoing, w.field.to_world(point.direction));
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations());
}

BENCHMARK(product<render::material_kind::plastic>);
BENCHMARK(evaluations<render::material_kind::plastic>);
BENCHMARK(product<render::material_kind::lambert>);
BENCHMARK(evaluations<render::material_kind::lambert>);

}  // namespace

BENCHMARK_MAIN();
