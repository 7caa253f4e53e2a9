// One ray's product of a field and the renderer's BSDF on one core: its weights, a direction drawn from it,
// and the density of another direction; P = 8 over F = 64. Made by an emulated warp as the guider does, and
// by plain loops that give the same bits: what the warp's lanes cost.
#include "materials.hpp"

#include <wfpg/detail/cpu_block.hpp>
#include <wfpg/product_sampler.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
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
  vec2 u;      // of the direction to draw
  vec3 other;  // whose density is asked
};

struct drawn_direction {
  vec3 direction{0.0f};
  float density = 0.0f, other_density = 0.0f;

  bool operator==(const drawn_direction& b) const {
    return direction == b.direction && density == b.density && other_density == b.other_density;
  }
};

vec2 random_vec2(std::uint64_t stream, std::uint64_t i) {
  return wfpg::detail::unit_vec2(wfpg::detail::hash(wfpg::detail::hash(1, stream), i));
}

// A field over the hemisphere above `up`, bright in a few places, and rays that meet surfaces of one material
// and many normals: branches taken for one ray say little about the next.
struct workload {
  std::vector<std::uint32_t> sums = std::vector<std::uint32_t>(field_resolution * field_resolution);
  std::vector<wfpg::product_point> hemisphere = std::vector<wfpg::product_point>(block_count);
  std::vector<wfpg::product_point> sphere = std::vector<wfpg::product_point>(block_count);
  wfpg::directional_field field;
  wfpg::product_points points{hemisphere.data(), sphere.data(), product_resolution};
  std::uint32_t side = field_resolution / product_resolution;  // of a block, in cells
  std::array<ray, 256> rays;

  explicit workload(render::material_kind kind) {
    const wfpg::detail::cpu_block<8> block(nullptr, 0);
    const wfpg::detail::cell_words cells{sums.data()};
    for (std::uint32_t i = 0; i < field_resolution * field_resolution; ++i)
      cells.set(static_cast<int>(i), std::pow(random_vec2(0, i).x, 8.0f));
    const auto grid =
        wfpg::detail::build_distribution(block, cells, static_cast<int>(field_resolution), 0.01f);
    field = wfpg::directional_field(grid, up);
    const wfpg::detail::draw_product_points draw{hemisphere.data(), sphere.data(), product_resolution, 2};
    const wfpg::detail::measure_product_blocks measure{hemisphere.data(), sphere.data(), product_resolution};
    for (std::uint32_t i = 0; i < block_count; ++i) {
      measure(i);
      draw(i);
    }
    for (std::uint32_t i = 0; i < rays.size(); ++i) rays[i] = make_ray(kind, i);
  }
  workload(const workload&) = delete;

  static ray make_ray(render::material_kind kind, std::uint32_t i) {
    const auto above = [&](vec3 axis, std::uint64_t stream) {
      return wfpg::detail::frame(axis).to_world(wfpg::square_to_hemisphere(random_vec2(stream, i)));
    };
    const vec3 normal = glm::normalize(up + 0.5f * above(up, 1));
    const vec3 outgoing = glm::normalize(0.1f * normal + above(normal, 2));
    const render::bsdf bsdf{normal, normal, vec3(0.6f, 0.4f, 0.3f), 0.2f, 1.5f, kind};
    return {{{}, normal, normal, outgoing, bsdf}, random_vec2(3, i), above(normal, 4)};
  }
};

template <int W>
drawn_direction by_warp(const workload& w, const ray& r) {
  std::uint32_t words[block_count];
  const wfpg::product_field product =
      wfpg::detail::multiply(wfpg::detail::emulated_warp<W>(), w.field, w.points, r.hit, words);
  drawn_direction result;
  if (product.empty()) return result;
  result.direction = product.sample(r.u, result.density);
  result.other_density = product.pdf(r.other);
  return result;
}

// The same by plain loops. Resolutions are variables as they are to the library.
struct scalar_product {
  static drawn_direction of_ray(const workload& w, const ray& r) {
    std::uint32_t weights[block_count];
    drawn_direction result;
    if (wfpg::detail::has_product(w.field, r.hit, wfpg::detail::facing_normal(r.hit))) {
      result.direction = w.field.sample(r.u, result.density);
      result.other_density = w.field.pdf(r.other);
      return result;
    }
    if (!multiply(w, r.hit, weights)) return result;
    result.direction = sample(w, weights, r.u, result.density);
    vec2 uv;
    if (w.field.locate(r.other, uv)) {
      const auto& grid = w.field.grid();
      result.other_density = cell_pdf(w, weights, grid.cell_along(uv.x), grid.cell_along(uv.y));
    }
    return result;
  }

  // Entry (x, y) of the table with a row and a column of zeros before it.
  static std::uint32_t before(const workload& w, std::uint32_t x, std::uint32_t y) {
    return x > 0 && y > 0 ? w.sums[(y - 1) * w.field.grid().resolution() + x - 1] : 0;
  }
  static std::uint32_t sum(const workload& w, std::uint32_t x, std::uint32_t y, std::uint32_t side) {
    return before(w, x + side, y + side) - before(w, x, y + side) - before(w, x + side, y) + before(w, x, y);
  }

  // Inclusive sums of the blocks' integer weights; false where all are zero.
  static bool multiply(const workload& w, const surface& s, std::uint32_t* weights) {
    const std::uint32_t p = w.points.resolution;
    const bool hemisphere = w.field.hemisphere();
    const wfpg::product_point* point = hemisphere ? w.points.hemisphere : w.points.sphere;
    const vec3 up = wfpg::detail::facing_normal(s);
    float products[block_count];
    float brightest = 0.0f;
    for (std::uint32_t i = 0; i < p * p; ++i) {
      const std::uint32_t weight = sum(w, i % p * w.side, i / p * w.side, w.side);
      products[i] = weight > 0 ? static_cast<float>(weight) * factor(w, s, up, point[i]) : 0.0f;
      brightest = products[i] > brightest ? products[i] : brightest;
    }
    if (!(brightest > 1.0e-25f)) return false;
    const float scale = 0x1p31f / static_cast<float>(p * p) / brightest;
    std::uint32_t total = 0;
    for (std::uint32_t i = 0; i < p * p; ++i) {
      const auto weight = static_cast<std::uint32_t>(products[i] * scale);
      weights[i] = total += std::max(weight, products[i] > 0.0f ? 1u : 0u);
    }
    return true;
  }

  static float factor(const workload& w, const surface& s, vec3 up, const wfpg::product_point& point) {
    const float cosine = glm::dot(w.field.to_world(point.mean), up), r = point.radius;
    if (cosine <= -r && !s.bsdf.transmits()) return 0.0f;
    vec3 direction = w.field.to_world(point.direction);
    float value = s.bsdf.eval(s.outgoing, direction);
    if (value == 0.0f) {
      direction = w.field.to_world(point.opposite);
      value = s.bsdf.eval(s.outgoing, direction);
    }
    if (!(value > 0.0f) || !wfpg::detail::is_finite(value)) return 0.0f;
    const float there = glm::dot(direction, up), towards = there >= 0.0f ? cosine : -cosine;
    const float above = towards + r < 0.0f ? 0.0f : towards + r < 2.0f * r ? towards + r : 2.0f * r;
    const float mean = above * above / (4.0f * r) + (towards - r > 0.0f ? towards - r : 0.0f);
    const float bounded = value < 1.0e25f ? value : 1.0e25f;
    const float steepness = std::fabs(there) > 1.0e-3f ? std::fabs(there) : 1.0e-3f;
    return bounded * mean / (steepness * (w.field.hemisphere() ? point.mean.z : 1.0f));
  }

  // Where `first` plus u times the rest falls among n inclusive sums.
  template <class Sums>
  static std::uint32_t find(const Sums& sums, std::uint32_t n, std::uint32_t first, float u,
                            float& fraction) {
    const std::uint32_t total = sums(n - 1) - first;
    const std::uint64_t scaled = static_cast<std::uint64_t>(u * 0x1p24f) * total;
    std::uint32_t target = static_cast<std::uint32_t>(scaled >> 24);
    target = first + (target < total ? target : total - 1);
    std::uint32_t found = 0;
    for (std::uint32_t size = n; size > 1; size -= size / 2)
      found += sums(found + size / 2 - 1) > target ? 0 : size / 2;
    if (found > 0) first = sums(found - 1);
    fraction = (static_cast<float>(target - first) + static_cast<float>(scaled & 0xffffffu) * 0x1p-24f) /
               static_cast<float>(sums(found) - first);
    return found;
  }

  static vec3 sample(const workload& w, const std::uint32_t* weights, vec2 u, float& density) {
    const std::uint32_t p = w.points.resolution, side = w.side;
    float in_block, in_row, in_column;
    const std::uint32_t block = find([&](std::uint32_t i) { return weights[i]; }, p * p, 0, u.x, in_block);
    const std::uint32_t x0 = block % p * side, y0 = block / p * side;
    const auto rows = [&](std::uint32_t i) { return before(w, x0 + side, y0 + i) - before(w, x0, y0 + i); };
    const std::uint32_t y =
        y0 + find([&](std::uint32_t i) { return rows(i + 1); }, side, rows(0), u.y, in_row);
    const auto columns = [&](std::uint32_t i) { return before(w, x0 + i, y + 1) - before(w, x0 + i, y); };
    const std::uint32_t x = x0 + find([&](std::uint32_t i) { return columns(i + 1); }, side, columns(0),
                                      in_block < 1.0f ? in_block : 0x1.fffffep-1f, in_column);
    density = cell_pdf(w, weights, x, y);
    const auto inside = [](float fraction) {
      return fraction < 0x1p-14f ? 0x1p-14f : fraction < 1.0f - 0x1p-14f ? fraction : 1.0f - 0x1p-14f;
    };
    return w.field.direction(
        vec2(static_cast<float>(x) + inside(in_column), static_cast<float>(y) + inside(in_row)) /
        static_cast<float>(w.field.grid().resolution()));
  }

  static float cell_pdf(const workload& w, const std::uint32_t* weights, std::uint32_t x, std::uint32_t y) {
    const std::uint32_t p = w.points.resolution, block = y / w.side * p + x / w.side;
    const std::uint32_t product = weights[block] - (block > 0 ? weights[block - 1] : 0);
    if (product == 0) return 0.0f;
    const auto whole = static_cast<float>(sum(w, block % p * w.side, block / p * w.side, w.side));
    return static_cast<float>(product) * static_cast<float>(sum(w, x, y, 1)) /
           (static_cast<float>(weights[p * p - 1]) * whole * w.field.cell_solid_angle());
  }
};

using product_of_ray = drawn_direction (*)(const workload&, const ray&);

void product(benchmark::State& state, product_of_ray made, render::material_kind kind) {
  const workload w(kind);
  int drawn = 0;
  for (const ray& r : w.rays) {
    const drawn_direction result = made(w, r);
    if (!(result == scalar_product::of_ray(w, r)))
      state.SkipWithError("the warp's bits are not those of the loops");
    drawn += result.density > 0.0f;
  }
  if (drawn < 200) state.SkipWithError("too few rays have a product");
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(made(w, w.rays[i++ % w.rays.size()]));
  state.SetItemsProcessed(state.iterations());  // rays
}

constexpr auto plastic = render::material_kind::plastic, lambert = render::material_kind::lambert;
template <int W, render::material_kind kind>
void product_warp(benchmark::State& state) {
  product(state, by_warp<W>, kind);
}
template <render::material_kind kind>
void product_scalar(benchmark::State& state) {
  product(state, scalar_product::of_ray, kind);
}

BENCHMARK(product_scalar<plastic>);
BENCHMARK(product_warp<8, plastic>);
BENCHMARK(product_warp<16, plastic>);
BENCHMARK(product_warp<32, plastic>);
BENCHMARK(product_scalar<lambert>);
BENCHMARK(product_warp<8, lambert>);
BENCHMARK(product_warp<16, lambert>);
BENCHMARK(product_warp<32, lambert>);

}  // namespace

BENCHMARK_MAIN();
