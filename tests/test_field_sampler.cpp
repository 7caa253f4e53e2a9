// The field sampler. Compares frequencies with probabilities of the cells. Tests that densities integrate to
// one and equal the sampler's. Cells without weight are never sampled.
#include "support/evaluate.hpp"
#include "support/fields.hpp"
#include "support/policies.hpp"
#include "support/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace wfpg_test;
using wfpg::directional_field;
using wfpg::grid_distribution;
using wfpg::vec2;
using wfpg::vec3;

namespace {

constexpr std::uint32_t resolutions[] = {2, 16, 31, 32, 128};
constexpr float below_one = 1.0f - 0x1p-24f;

std::string name_of(field_kind kind, std::uint32_t resolution, std::uint64_t seed) {
  return std::string(name_of(kind)) + " field of " + std::to_string(resolution) + "², seed " +
         std::to_string(seed);
}

WFPG_HD vec2 random_point(std::uint64_t seed, std::size_t i) {
  return wfpg::unit_vec2(wfpg::hash(seed, i));
}

WFPG_HD bool in_square(vec2 p) {
  return p.x >= 0.0f && p.x < 1.0f && p.y >= 0.0f && p.y < 1.0f;
}

WFPG_HD std::size_t cell_of(vec2 uv, std::uint32_t resolution) {
  return std::size_t(uv.y * float(resolution)) * resolution + std::size_t(uv.x * float(resolution));
}

struct draw_points {
  grid_distribution grid;
  std::uint64_t seed;
  wfpg::array_view<vec2> points;
  WFPG_HD void operator()(std::size_t i) const { points[i] = grid.sample(random_point(seed, i)); }
};

struct draw_directions {
  directional_field field;
  std::uint64_t seed;
  wfpg::array_view<drawn_direction> drawn;
  WFPG_HD void operator()(std::size_t i) const {
    drawn[i].direction = field.sample(random_point(seed, i), drawn[i].pdf);
  }
};

struct field_pdf {
  directional_field field;
  WFPG_HD float operator()(vec3 direction) const { return field.pdf(direction); }
};

struct pdf_of_sample {
  directional_field field;
  WFPG_HD float operator()(vec2 u) const { return field.pdf(field.sample(u)); }
};

/// Whether a field's samples have their cells' density.
struct density_of_sample {
  directional_field field;
  WFPG_HD bool operator()(std::size_t i) const {
    const grid_distribution& grid = field.grid();
    const std::uint32_t resolution = grid.resolution();
    const vec2 u = random_point(9, i), uv = grid.sample(u);
    const auto cell = static_cast<std::uint32_t>(cell_of(uv, resolution));
    const auto weight = float(grid.weight(cell % resolution, cell / resolution));
    const float domain = (field.hemisphere() ? 2.0f : 4.0f) * wfpg::pi;
    const float density = weight / float(grid.total()) * float(resolution * resolution) / domain;
    return field.pdf(field.sample(u)) == density && density > 0.0f;
  }
};

template <class Exec, class T, class Draw>
std::vector<T> draw(const Exec& exec, std::size_t n, Draw kernel, wfpg::array_view<T> Draw::*output) {
  const wfpg::buffer<T, Exec> results(exec, n);
  kernel.*output = results.view();
  exec.for_each(n, kernel);
  return results.to_host(exec);
}

/// Numbers on both sides of each cell's border, and at both ends of [0,1).
std::vector<float> difficult_numbers(const std::vector<std::uint32_t>& weights, std::uint32_t resolution,
                                     std::uint32_t row) {
  std::vector<float> numbers = {0.0f, 0x1p-24f, 0.5f, below_one};
  double sum = 0.0, total = 0.0;
  for (std::uint32_t x = 0; x < resolution; ++x) total += weights[row * resolution + x];
  if (total == 0.0) return numbers;
  for (std::uint32_t x = 0; x < resolution; ++x) {
    sum += weights[row * resolution + x];
    const float edge = float(std::floor(sum / total * 0x1p24) * 0x1p-24);
    for (int step = -2; step <= 2; ++step)
      numbers.push_back(std::clamp(edge + float(step) * 0x1p-24f, 0.0f, below_one));
  }
  return numbers;
}

/// Midpoint rule over the square, whose map preserves area: n² points a cell.
template <class Exec>
double integral_over_square(const Exec& exec, const directional_field& field, std::uint32_t n) {
  const std::uint32_t side = field.grid().resolution() * n;
  double sum = 0.0;
  for (const float density : evaluate(exec, std::size_t(side) * side, [=] WFPG_HD(std::size_t i) {
         const vec2 uv{(float(i % side) + 0.5f) / float(side), (float(i / side) + 0.5f) / float(side)};
         return field.pdf(field.direction(uv));
       }))
    sum += double(density);
  return sum * double(field.cell_solid_angle()) / (double(n) * n);
}

const vec3 tilted = glm::normalize(vec3(0.3f, -0.8f, -0.52f));

}  // namespace

TEST_CASE("chi-square test: tails are known, small cells pooled, wrong counts found", "[chi_square]") {
  CHECK(chi_square_tail(3.841, 1.0) == Approx(0.05).epsilon(1e-3));
  CHECK(chi_square_tail(10.828, 1.0) == Approx(0.001).epsilon(1e-3));
  CHECK(chi_square_tail(124.342, 100.0) == Approx(0.05).epsilon(1e-3));
  CHECK(chi_square_tail(10.0, 10.0) == Approx(0.44049).epsilon(1e-4));
  const std::vector<double> expected = {100, 1, 1, 1, 1, 1, 1, 100};
  const auto fair = chi_square_test({104, 0, 2, 1, 1, 1, 1, 96}, expected);
  CHECK(fair.degrees == 2.0);
  CHECK(fair.p > 0.5);
  CHECK(chi_square_test({160, 1, 1, 1, 1, 1, 1, 40}, expected).p < 1e-6);
  CHECK(chi_square_test({1, 0, 205, 0, 0, 0, 0, 0}, expected).p < 1e-6);
  CHECK(chi_square_test({10, 1}, {11, 0}).p == 0.0);
  CHECK(chi_square_test({160, 40}, {100, 100}).message.find("bin 0, observed 160, expected 100") !=
        std::string::npos);

  chi_square_family small_errors;
  for (int i = 0; i < 100; ++i) small_errors.add(chi_square_test({110, 90}, {100, 100}), "biased a little");
  CHECK(!small_errors.accepted());
  chi_square_family one_error;
  for (int i = 0; i < 99; ++i) one_error.add(chi_square_test({102, 98}, {100, 100}), "fair");
  CHECK(one_error.accepted());
  one_error.add(chi_square_test({150, 50}, {100, 100}), "wrong");
  CHECK(!one_error.accepted());
}

namespace {

WFPG_TEST_CASE("field sampler: frequencies of 100 random fields match their probabilities",
               "[field_sampler]") {
  const Exec exec;
  chi_square_family family;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const auto kind = static_cast<field_kind>(seed % std::uint64_t(field_kind::count));
    const std::uint32_t resolution = resolutions[seed / std::uint64_t(field_kind::count) % 5];
    const auto values = field_values(kind, resolution, seed);
    const built_field<Exec> field(exec, values, resolution);
    const std::size_t samples = std::max<std::size_t>(10000, 2 * values.size());
    const auto points = draw(exec, samples, draw_points{field.grid(), 1000 + seed, {}}, &draw_points::points);

    std::vector<double> expected = cell_probabilities(values);
    for (double& p : expected) p *= double(samples);
    std::vector<double> observed(values.size(), 0.0);
    REQUIRE(std::all_of(points.begin(), points.end(), [](vec2 p) { return in_square(p); }));
    for (vec2 p : points) observed[cell_of(p, resolution)] += 1.0;
    family.add(chi_square_test(observed, expected), name_of(kind, resolution, seed));
  }
  INFO(family.message());
  CHECK(family.accepted());
}

WFPG_TEST_CASE("field sampler: points are uniform inside a cell", "[field_sampler]") {
  const Exec exec;
  constexpr std::uint32_t n = 8;
  const built_field<Exec> field(exec, field_values(field_kind::noise, 31, 5), 31);
  std::vector<double> observed(n * n, 0.0);
  const std::size_t samples = 20000;
  for (vec2 p : draw(exec, samples, draw_points{field.grid(), 3, {}}, &draw_points::points)) {
    const vec2 inside = p * 31.0f - glm::floor(p * 31.0f);
    observed[cell_of(glm::min(inside, vec2(below_one)), n)] += 1.0;
  }
  const auto result = chi_square_test(observed, std::vector<double>(n * n, double(samples) / (n * n)));
  INFO(result.message);
  CHECK(result.p > 1e-3);
}

WFPG_TEST_CASE("field sampler: directions have the reported density", "[field_sampler]") {
  const Exec exec;
  chi_square_family family;
  const std::size_t samples = 20000;
  std::size_t below = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const std::uint32_t resolution = seed % 2 ? 16 : 31;
    const auto kind = seed < 4 ? field_kind::noise : field_kind::uniform;
    const built_field<Exec> built(exec, field_values(kind, resolution, seed), resolution, 0.1f);
    const directional_field field = seed % 3
                                        ? directional_field(built.grid())
                                        : directional_field(built.grid(), seed ? tilted : vec3(0, 0, -1));
    const auto drawn = draw(exec, samples, draw_directions{field, 77 + seed, {}}, &draw_directions::drawn);
    for (const drawn_direction& d : drawn)
      below += field.hemisphere() && glm::dot(d.direction, field.normal()) < -1e-6f;
    sampler_check_options options;
    options.moments = seed < 2;
    const auto report = check_sampler(drawn, densities_by{exec, field_pdf{field}}, options);
    INFO(name_of(kind, resolution, seed) << ": " << report.message);
    CHECK(report);
    family.add(report.frequencies, name_of(kind, resolution, seed));
  }
  CHECK(below == 0);
  INFO(family.message());
  CHECK(family.accepted());
}

WFPG_TEST_CASE("field sampler: every coordinate has a cell", "[field_sampler]") {
  const Exec exec;
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  const std::vector<float> coordinates = {nan,     -nan, infinity, -infinity, 3.0e38f, -3.0e38f, 1.0f,
                                          1.0001f, 0.5f, -0.0f,    -1.0e-7f,  0.0f,    0.99f};
  for (std::uint32_t resolution : resolutions) {
    const wfpg::buffer<float, Exec> asked(exec, coordinates);
    const wfpg::buffer<std::uint32_t, Exec> found(exec, coordinates.size());
    const auto from = const_view(asked);
    const auto to = found.view();
    exec.for_each(coordinates.size(), [=] WFPG_HD(std::size_t i) {
      to[i] = grid_distribution(nullptr, resolution).cell_along(from[i]);
    });
    const std::vector<std::uint32_t> cells = found.to_host(exec);
    for (std::size_t i = 0; i < 2; ++i) CHECK(cells[i] < resolution);
    for (std::size_t i : {2, 4, 6, 7}) CHECK(cells[i] == resolution - 1);
    for (std::size_t i : {3, 5, 9, 10, 11}) CHECK(cells[i] == 0);
    CHECK(cells[8] == resolution / 2);
    CHECK(cells[12] == static_cast<std::uint32_t>(0.99f * static_cast<float>(resolution)));
  }
}

/// Rectangles of equal solid angle above a normal: rows along it, columns about it.
struct rectangles_above {
  static constexpr std::uint32_t rows = 8, columns = 16, count = rows * columns;
  static constexpr float full_turn = 6.28318531f;

  vec3 normal, tangent, bitangent;

  explicit rectangles_above(vec3 n)
      : normal(n),
        tangent(glm::normalize(glm::cross(n, vec3(0.3f, 0.9f, 0.1f)))),
        bitangent(glm::cross(n, tangent)) {}

  WFPG_HD std::uint32_t of(vec3 d) const {
    const float turn = std::atan2(glm::dot(d, bitangent), glm::dot(d, tangent)) / full_turn;
    const float row = wfpg::max(glm::dot(d, normal), 0.0f) * float(rows);
    const float column = (turn < 0.0f ? turn + 1.0f : turn) * float(columns);
    return wfpg::min(std::uint32_t(row), rows - 1) * columns + wfpg::min(std::uint32_t(column), columns - 1);
  }
  /// A direction from fractional (row, column).
  WFPG_HD vec3 direction(float row, float column) const {
    const float z = row / float(rows), turn = full_turn * column / float(columns);
    const float r = std::sqrt(1.0f - z * z);
    return z * normal + r * std::cos(turn) * tangent + r * std::sin(turn) * bitangent;
  }
};

struct rectangle_of_sample {
  directional_field field;
  rectangles_above rectangles;
  std::uint64_t seed;
  WFPG_HD std::uint32_t operator()(std::size_t i) const {
    return rectangles.of(field.sample(random_point(seed, i)));
  }
};

/// Integrates a field's density over each rectangle, with a random point in each of n² parts. The midpoint
/// rule would fail where cell edges lie along a rectangle's.
struct integrate_rectangle {
  directional_field field;
  rectangles_above rectangles;
  WFPG_HD double operator()(std::size_t i) const {
    constexpr std::uint32_t n = 100;
    double sum = 0.0;
    for (std::uint32_t k = 0; k < n * n; ++k) {
      const vec2 inside = (vec2(float(k % n), float(k / n)) + random_point(wfpg::hash(1, i), k)) / float(n);
      sum += double(field.pdf(rectangles.direction(float(i / rectangles_above::columns) + inside.y,
                                                   float(i % rectangles_above::columns) + inside.x)));
    }
    return sum / (n * n) * double(rectangles_above::full_turn) / rectangles_above::count;
  }
};

/// Parts of the hemisphere. The smallest is an eighth.
constexpr bool (*parts_of_hemisphere[])(std::uint32_t row, std::uint32_t column) = {
    [](std::uint32_t row, std::uint32_t) { return row >= 4; },
    [](std::uint32_t row, std::uint32_t) { return row == 0; },
    [](std::uint32_t row, std::uint32_t) { return row == 7; },
    [](std::uint32_t, std::uint32_t column) { return column < 8; },
    [](std::uint32_t row, std::uint32_t column) { return row < 4 && column >= 12; },
    [](std::uint32_t row, std::uint32_t column) { return (row + column) % 2 == 0; }};

WFPG_TEST_CASE("field sampler: the test finds a density off by 2% in a part of the hemisphere",
               "[field_sampler]") {
  const Exec exec;
  constexpr std::size_t samples = 3 << 20, at_once = samples / 3;
  chi_square_family family;
  for (const field_kind kind : {field_kind::uniform, field_kind::noise}) {
    const vec3 normal = kind == field_kind::uniform ? vec3(0.0f, 0.0f, 1.0f) : tilted;
    const built_field<Exec> built(exec, field_values(kind, 16, 33), 16, 0.1f);
    const directional_field field(built.grid(), normal);
    const rectangles_above rectangles(normal);
    INFO(name_of(kind, 16, 33));

    double integral = 0.0;
    std::vector<double> expected =
        evaluate(exec, rectangles_above::count, integrate_rectangle{field, rectangles});
    for (const double fraction : expected) integral += fraction;
    CHECK(integral == Approx(1.0).margin(5.0e-4));
    for (double& fraction : expected) fraction *= double(samples) / integral;
    if (kind == field_kind::uniform)
      for (const double count : expected) CHECK(count == Approx(samples / rectangles_above::count));

    std::vector<double> observed(rectangles_above::count, 0.0);
    for (std::uint64_t chunk = 0; chunk < samples / at_once; ++chunk)
      for (const std::uint32_t i :
           evaluate(exec, at_once, rectangle_of_sample{field, rectangles, wfpg::hash(50, chunk)}))
        observed[i] += 1.0;
    family.add(chi_square_test(observed, expected), name_of(kind, 16, 33));

    for (const auto part : parts_of_hemisphere)
      for (const double factor : {0.98, 1.02}) {
        std::vector<double> wrong = expected;
        double sum = 0.0;
        for (std::uint32_t i = 0; i < wrong.size(); ++i) {
          if (part(i / rectangles_above::columns, i % rectangles_above::columns)) wrong[i] *= factor;
          sum += wrong[i];
        }
        for (double& count : wrong) count *= double(samples) / sum;
        CHECK(chi_square_test(observed, wrong).p < 1.0e-6);
      }
  }
  INFO(family.message());
  CHECK(family.accepted());
}

WFPG_TEST_CASE("field sampler: a sampled direction's density is its cell's, bit for bit",
               "[field_sampler][bits]") {
  const Exec exec;
  for (std::uint32_t resolution : resolutions)
    for (std::uint32_t k = 0; k < std::uint32_t(field_kind::count); ++k) {
      const auto kind = static_cast<field_kind>(k);
      const built_field<Exec> built(exec, field_values(kind, resolution, 17), resolution);
      const grid_distribution grid = built.grid();
      std::size_t differing = 0;
      for (const directional_field& field : {directional_field(grid), directional_field(grid, tilted)})
        differing += 500 - count_where(exec, 500, density_of_sample{field});
      INFO(name_of(kind, resolution, 17));
      CHECK(differing == 0);
    }
}

WFPG_TEST_CASE("field sampler: cells without weight are never sampled, even at borders and ends",
               "[field_sampler]") {
  const Exec exec;
  for (std::uint32_t resolution : {2u, 16u, 31u, 32u, 100u, 128u}) {
    std::vector<float> values(std::size_t(resolution) * resolution,
                              0.0f);  // every other cell, every other row
    for (std::size_t i = 0; i < values.size(); ++i)
      if (i % resolution % 2 == 1 && i / resolution % 2 == 0) values[i] = 1.0f;
    const built_field<Exec> built(exec, values, resolution);
    const grid_distribution grid = built.grid();
    std::size_t outside = 0, empty = 0, no_density = 0;
    std::vector<vec2> numbers;
    for (float x : difficult_numbers(cell_weights(exec, grid), resolution, 0))
      for (float y : {0.0f, 0x1p-24f, 0.3f, 0.5f, 0.5f + 0x1p-24f, below_one}) numbers.push_back({x, y});
    for (const vec2 p : evaluate(exec, numbers, [=] WFPG_HD(vec2 u) { return grid.sample(u); })) {
      outside += !in_square(p);
      empty += in_square(p) && values[cell_of(p, resolution)] == 0.0f;
    }
    for (const directional_field& field : {directional_field(grid), directional_field(grid, tilted)})
      for (const float density : evaluate(exec, numbers, pdf_of_sample{field}))
        no_density += !(density > 0.0f);
    INFO("resolution " << resolution);
    CHECK(outside == 0);
    CHECK(empty == 0);
    CHECK(no_density == 0);
  }
}

WFPG_TEST_CASE("field sampler: u = 0 samples the first cell with weight, u near 1 the last",
               "[field_sampler]") {
  const Exec exec;
  for (std::uint32_t resolution : resolutions) {
    std::vector<float> values = field_values(field_kind::noise, resolution, 3);
    for (std::uint32_t i = 0; i < resolution; ++i) values[i] = 0.0f;  // the first row
    values[resolution] = 0.0f;
    values[resolution + 1] = 1.0f;
    values[values.size() - 1] = 2.0f;
    const built_field<Exec> built(exec, values, resolution);
    const grid_distribution grid = built.grid();
    const auto ends = evaluate(exec, std::vector<vec2>{{0.0f, 0.0f}, {below_one, below_one}},
                               [=] WFPG_HD(vec2 u) { return grid.sample(u); });
    CHECK(cell_of(ends[0], resolution) == resolution + 1);
    CHECK(cell_of(ends[1], resolution) == values.size() - 1);
  }
}

WFPG_TEST_CASE("field sampler: stratified numbers stay in order inside a row", "[field_sampler]") {
  const Exec exec;
  const built_field<Exec> built(exec, field_values(field_kind::extreme, 31, 4), 31, 1.0f);
  for (float y : {0.1f, 0.7f}) {
    float last_x = 0.0f;
    int disorder = 0;
    const grid_distribution grid = built.grid();
    for (const vec2 p : evaluate(exec, 5000, [=] WFPG_HD(std::size_t i) {
           return grid.sample({float(i) / 5000.0f, y});
         })) {
      disorder += p.x < last_x;
      last_x = p.x;
    }
    CHECK(disorder == 0);
  }
}

WFPG_TEST_CASE("field sampler: densities integrate to one", "[field_sampler]") {
  const Exec exec;
  for (std::uint32_t resolution : resolutions)
    for (std::uint32_t k = 0; k < std::uint32_t(field_kind::count); ++k) {
      const auto kind = static_cast<field_kind>(k);
      const built_field<Exec> built(exec, field_values(kind, resolution, 21), resolution,
                                    k % 2 ? 0.0f : 0.01f);
      INFO(name_of(kind, resolution, 21));
      const std::uint32_t n = resolution > 100 ? 1 : 2;
      CHECK(integral_over_square(exec, directional_field(built.grid()), n) == Approx(1.0).margin(1e-5));
      CHECK(integral_over_square(exec, directional_field(built.grid(), tilted), n) ==
            Approx(1.0).margin(1e-5));
    }
}

WFPG_TEST_CASE("field sampler: values without rounding give the same bits on every width",
               "[field_sampler]") {
  const Exec exec;
  for (std::uint32_t resolution : resolutions) {
    random_numbers random(resolution);
    std::vector<float> values(std::size_t(resolution) * resolution);
    float total = 0.0f;  // exact: integers with a sum below 2^24
    for (float& value : values) total += value = float(random.below(1000));
    const built_field<Exec> built(exec, values, resolution);

    std::vector<std::uint32_t> expected(values.size());
    const float scale = 0x1p31f / total;
    for (std::uint32_t i = 0; i < values.size(); ++i) {
      const float value = values[i];
      expected[i] = value > 0.0f ? std::max(std::uint32_t(std::min(value * scale, 0x1p31f)), 1u) : 0u;
      if (i % resolution > 0) expected[i] += expected[i - 1];
    }
    std::uint32_t rows = 0;
    for (std::uint32_t y = 1; y <= resolution; ++y) expected.push_back(rows += expected[y * resolution - 1]);
    INFO("resolution " << resolution);
    CHECK(built.words(exec) == expected);
  }
}

WFPG_TEST_CASE("field sampler: floors, all-zero fields and extreme values are sampled correctly",
               "[field_sampler]") {
  const Exec exec;
  const built_field<Exec> floored(exec, {0.0f, 1.0f, 0.0f, 2.0f}, 2, 1.0f);
  const auto probability = [&](const grid_distribution& grid, std::uint32_t cell) {
    const std::vector<std::uint32_t> weights = cell_weights(exec, grid);
    return double(weights[cell]) / double(weights[0] + weights[1] + weights[2] + weights[3]);
  };
  for (std::uint32_t cell = 0; cell < 4; ++cell)
    CHECK(probability(floored.grid(), cell) ==
          Approx(cell_probabilities({0.0f, 1.0f, 0.0f, 2.0f}, 1.0f)[cell]).epsilon(1e-6));

  const built_field<Exec> black(exec, {0.0f, 0.0f, 0.0f, 0.0f}, 2);
  const built_field<Exec> nearly_black(exec, {1e-38f, 0.0f, 1e-40f, 0.0f}, 2);
  for (std::uint32_t cell = 0; cell < 4; ++cell) {
    CHECK(probability(black.grid(), cell) == 0.25);
    CHECK(probability(nearly_black.grid(), cell) == 0.25);
  }
  const built_field<Exec> bright(exec, {1e30f, 3e30f, 1e-30f, 0.0f}, 2);
  CHECK(probability(bright.grid(), 0) == Approx(0.25).epsilon(1e-6));
  CHECK(probability(bright.grid(), 1) == Approx(0.75).epsilon(1e-6));
  CHECK(cell_weights(exec, bright.grid())[2] == 1);
  CHECK(cell_weights(exec, bright.grid())[3] == 0);
}

struct direction_about {
  vec3 normal, direction;
};

WFPG_TEST_CASE("field sampler: hemispheres have no density below the horizon", "[field_sampler]") {
  const Exec exec;
  const built_field<Exec> built(exec, std::vector<float>(16 * 16, 1.0f), 16);
  random_numbers random(8);
  std::vector<direction_about> pairs;
  for (int i = 0; i < 200; ++i) {
    const vec3 normal = random.direction();
    pairs.push_back({normal, random.direction()});
  }
  const grid_distribution grid = built.grid();
  const auto densities = evaluate(exec, pairs, [=] WFPG_HD(const direction_about& pair) {
    return directional_field(grid, pair.normal).pdf(pair.direction);
  });
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const float along = glm::dot(pairs[i].direction, pairs[i].normal);
    if (along > 1e-4f) CHECK(densities[i] == Approx(1.0 / (2.0 * 3.14159265)).epsilon(1e-5));
    if (along < -1e-4f) CHECK(densities[i] == 0.0f);
  }
}

}  // namespace

TEST_CASE("field sampler: a default field is empty", "[field_sampler]") {
  CHECK(directional_field().empty());
  CHECK(!directional_field(grid_distribution(nullptr, 4)).empty());
  CHECK(directional_field(grid_distribution(nullptr, 4)).cell_solid_angle() ==
        Approx(4.0 * 3.14159265 / 16.0));
  CHECK(directional_field(grid_distribution(nullptr, 4), tilted).cell_solid_angle() ==
        Approx(2.0 * 3.14159265 / 16.0));
}
